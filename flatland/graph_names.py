"""ROS graph names, cleaned and validated as in roscpp; independent of ROS."""

from __future__ import annotations

import re

# Without the private prefix `~`, which has no meaning in a model.
_LEGAL_NAME = re.compile(r"[A-Za-z/][\w/]*", re.ASCII)


def clean_name(name: str) -> str:
    """Returns a name without repeated slashes and without a slash at the end."""
    return re.sub("/+", "/", name).removesuffix("/")


def is_legal_namespace(namespace: str) -> bool:
    """Returns whether a namespace is empty or, once cleaned, a legal graph name."""
    cleaned = clean_name(namespace)
    return not cleaned or _LEGAL_NAME.fullmatch(cleaned) is not None


def resolve_topic(topic: str, namespace: str = "") -> str:
    """Returns the name of a topic in a namespace.

    Args:
        topic: Name of the topic, global if it starts with `/`; need not be clean.
        namespace: Namespace of the model, may be empty; need not be clean.

    Returns:
        `/topic` if the topic is global, otherwise `namespace/topic`, which starts with a slash only
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
