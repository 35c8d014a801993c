"""Names of models, and ROS graph names, cleaned and validated as in roscpp; independent of ROS."""

from __future__ import annotations

import re
from typing import Final

from flatland.checks import quoted, shown

MAX_NAME: Final = 255
"""Greatest number of characters of the name or namespace of a model."""
_CONTROL: Final = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
# Without the private prefix `~`, which has no meaning in a model.
_LEGAL_NAME = re.compile(r"[A-Za-z/][\w/]*", re.ASCII)


def clean_name(name: str) -> str:
    """Returns a name without repeated slashes and without a slash at the end."""
    if "//" in name:
        name = re.sub("/+", "/", name)
    return name.removesuffix("/")


def check_model_name(name: object, *, is_of_file: bool = False) -> None:
    """Checks the name of a model, which need not be a legal graph name.

    Args:
        name: The name.
        is_of_file: Whether the name is that of an entry of a world file. As in the reference, such
            a name may also contain `..`.

    Raises:
        ValueError: The name is invalid.
    """
    if not isinstance(name, str):
        raise ValueError(f"its name must be a text, got {shown(name)}")
    if not name:
        raise ValueError("its name must not be empty")
    if (
        len(name) > MAX_NAME
        or _CONTROL.search(name)
        or (not is_of_file and ".." in re.split(r"[/\\]", name))
    ):
        raise ValueError(
            f'its name must have at most {MAX_NAME} characters, no control characters and no ".." '
            f"between slashes, got {shown(name)}"
        )


def check_namespace(namespace: object) -> None:
    """Checks the namespace of a model: it is empty or, once cleaned, a legal graph name.

    Raises:
        ValueError: The namespace is invalid.
    """
    if not isinstance(namespace, str):
        raise ValueError(f"namespace must be a text, got {shown(namespace)}")
    cleaned = clean_name(namespace)
    if cleaned and _LEGAL_NAME.fullmatch(cleaned) is None:
        raise ValueError(
            f"namespace {quoted(namespace)} is not a legal ROS name: it must start with a letter "
            'and hold only letters, digits, "_" and "/"'
        )
    if len(namespace) > MAX_NAME:
        raise ValueError(
            f"namespace must have at most {MAX_NAME} characters, got {shown(namespace)}"
        )


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
            f'{quoted(topic)} is not a legal topic name: it must start with a letter or "/" and '
            'hold only letters, digits, "_" and "/"'
        )
    namespace = clean_name(namespace)
    return cleaned if cleaned.startswith("/") or not namespace else f"{namespace}/{cleaned}"


def global_name(name: str) -> str:
    """Returns a cleaned name with a leading slash."""
    return "/" + clean_name(name).lstrip("/")
