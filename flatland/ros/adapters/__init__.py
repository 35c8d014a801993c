"""The adapters of ROS 1, which convert values to messages and back.

Other packages register their own adapters:

    from flatland.ros.adapters import register_adapter
    register_adapter(Temperature, sensor_msgs.msg.Temperature, to_message=make_message)
"""

from __future__ import annotations

import importlib
from typing import Any

from flatland.node.adapters import Adapters
from flatland.node.parameters import OWN_PACKAGE
from flatland.node.transport import Adapter as Adapter
from flatland.ros import message_types
from flatland.ros.adapters.writer import RosWriter

_GRID = "nav_msgs/OccupancyGrid"


class _RosAdapters(Adapters):
    """The adapters of messages that genpy generates."""

    _grid: type[Any] | None = None

    def message_class(self, name: str) -> type[Any]:
        """Imports a message class; that of grids has arrays of numpy."""
        package, _, message = name.partition("/")
        if package == OWN_PACKAGE:
            return message_types.message_class(message)
        found: type[Any] = getattr(importlib.import_module(f"{package}.msg"), message)
        if name != _GRID:
            return found
        if self._grid is None:
            self._grid = message_types.with_arrays(found)
        return self._grid

    def deserialize(self, message_type: type[Any], data: bytes) -> Any:
        """Returns a serialized message as an object."""
        return message_type().deserialize(data)


_adapters = _RosAdapters(RosWriter)
register_adapter = _adapters.register
find_adapter = _adapters.find
message_field = _adapters.field
message_class = _adapters.message_class
