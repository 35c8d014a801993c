"""The classes of messages and services, by name."""

from __future__ import annotations

import importlib
from typing import Any, Final

from flatland.node.parameters import OWN_PACKAGE

_PACKAGE: Final = "flatland_msgs"
"""ROS package of the own messages and services."""


def message_class(name: str) -> type[Any]:
    """Imports a message class, for example `sensor_msgs/LaserScan` or `flatland/ModelStates`.

    Raises:
        ImportError: The package is not installed, or has no such message.
    """
    return _find("msg", name)


def service_class(name: str) -> type[Any]:
    """Imports a service class, for example `std_srvs/Empty` or `flatland/SpawnModel`.

    Raises:
        ImportError: The package is not installed, or has no such service.
    """
    return _find("srv", name)


def _find(kind: str, name: str) -> type[Any]:
    package, _, own_name = name.partition("/")
    package = _PACKAGE if package == OWN_PACKAGE else package
    module = importlib.import_module(f"{package}.{kind}")
    try:
        found: type[Any] = getattr(module, own_name)
    except AttributeError:
        raise ImportError(f"{package}.{kind} has no {own_name}") from None
    return found


def type_name(message_type: type[Any]) -> str:
    """Returns the name of a message class as in the graph, for example `std_msgs/msg/Bool`."""
    package, kind, *_ = message_type.__module__.split(".")
    return f"{package}/{kind}/{message_type.__name__}"
