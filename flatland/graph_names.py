"""ROS graph names, as roscpp cleans and checks them; needs no ROS."""

from __future__ import annotations

import re

# Without the private prefix ~, which has no meaning within a model.
_LEGAL_NAME = re.compile(r"[A-Za-z/][\w/]*", re.ASCII)


def clean_name(name: str) -> str:
    """Returns a name without repeated slashes and without a slash at the end."""
    return re.sub("/+", "/", name).removesuffix("/")


def is_legal_namespace(namespace: str) -> bool:
    """Returns whether a namespace is empty or, once cleaned, a legal graph name."""
    cleaned = clean_name(namespace)
    return not cleaned or _LEGAL_NAME.fullmatch(cleaned) is not None


def resolve_topic(topic: str, namespace: str = "") -> str:
    """Puts a topic under a namespace.

    Args:
        topic: Name of the topic; a leading `/` makes it global. It is cleaned.
        namespace: Namespace of the model, may be empty. It is cleaned.

    Returns:
        `/topic` if the topic is global, else `namespace/topic`, which starts with a slash only
        if the namespace does, so that the ROS layer can resolve it in the namespace of the node.

    Raises:
        ValueError: The topic is not a legal graph name.
    """
    cleaned = clean_name(topic)
    if _LEGAL_NAME.fullmatch(cleaned) is None:
        raise ValueError(
            f'"{topic}" is not a legal topic name: it must start with a letter or "/" and hold '
            'only letters, digits, "_" and "/"'
        )
    namespace = clean_name(namespace)
    return cleaned if cleaned.startswith("/") or not namespace else f"{namespace}/{cleaned}"


def global_name(name: str) -> str:
    """Returns a cleaned name with a leading slash."""
    return "/" + clean_name(name).lstrip("/")
