"""The generated classes of the messages and services of flatland.

The classes exist twice, generated from the same definitions: in the ROS package `flatland`, and in
`flatland_msgs`, the package of the reference. MD5 sums and fields are equal, only the type names
differ. A process uses the classes of one of them; this module is the only one that imports them.
"""

from __future__ import annotations

import importlib
from typing import Any

from flatland.node.parameters import OWN_PACKAGE

_selected = OWN_PACKAGE


def select_package(package: str) -> None:
    """Selects the package of all classes that are looked up later.

    Must be called before the modules that publish messages are imported.

    Args:
        package: One of `MESSAGE_PACKAGES`.

    Raises:
        ImportError: The Python code of the package is not installed.
    """
    global _selected
    importlib.import_module(f"{package}.srv")
    _selected = package


def message_class(name: str) -> type[Any]:
    """Returns a message class of the selected package, for example `DebugTopicList`."""
    found: type[Any] = getattr(importlib.import_module(f"{_selected}.msg"), name)
    return found


def service_class(name: str) -> type[Any]:
    """Returns a service class of the selected package, for example `SpawnModel`."""
    found: type[Any] = getattr(importlib.import_module(f"{_selected}.srv"), name)
    return found


def with_arrays(message_type: type[Any]) -> type[Any]:
    """Returns a message class whose arrays are numpy arrays instead of Python objects."""
    import numpy as np  # late, because the clock of the node is registered first

    def serialize(self: Any, buff: Any) -> None:
        self.serialize_numpy(buff, np)

    def deserialize(self: Any, data: bytes) -> Any:
        return self.deserialize_numpy(data, np)

    members = {
        "__slots__": message_type.__slots__,  # genpy reads the field names from here
        "serialize": serialize,
        "deserialize": deserialize,
    }
    return type(message_type.__name__, (message_type,), members)
