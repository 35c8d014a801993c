"""A shorter import of rospy."""

from __future__ import annotations

import importlib
import sys
import types
from typing import Any, Final

_CATKIN: Final = "catkin.find_in_workspaces"


def defer_catkin() -> None:
    """Defers an import of roslib, and thereby of rospy, to the first search of a catkin workspace.

    The module is imported for a single function, and imports a parser, which takes longer than most
    modules of rospy. Must be called before the import of rospy.
    """
    if _CATKIN in sys.modules:
        return
    placeholder: Any = types.ModuleType(_CATKIN)

    def find_in_workspaces(*args: Any, **kwargs: Any) -> Any:
        if sys.modules.get(_CATKIN) is placeholder:
            del sys.modules[_CATKIN]
        return importlib.import_module(_CATKIN).find_in_workspaces(*args, **kwargs)

    placeholder.find_in_workspaces = find_in_workspaces
    sys.modules[_CATKIN] = placeholder
