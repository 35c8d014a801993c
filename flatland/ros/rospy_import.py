"""A shorter import and start of rospy."""

from __future__ import annotations

import importlib
import sys
import time
import types
from typing import Any, Final

_CATKIN: Final = "catkin.find_in_workspaces"
_REGISTRATION_POLL_PERIOD: Final = 0.002  # s


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


def shorten_registration() -> None:
    """Makes `rospy.init_node` return soon after the registration of the node.

    rospy checks whether the node is registered with the master immediately, which is too early, and
    then every 0.1 s.
    """
    import rospy.impl.init

    def sleep(seconds: float) -> None:
        time.sleep(min(seconds, _REGISTRATION_POLL_PERIOD))

    rospy.impl.init.time = types.SimpleNamespace(sleep=sleep)
