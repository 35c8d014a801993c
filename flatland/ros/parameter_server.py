"""The parameters of the node on the ROS master."""

from __future__ import annotations

from typing import Final

import rospy

USE_SIM_TIME: Final = "/use_sim_time"
# Some forks of the reference read these from the global namespace, others from the private one.
_GLOBAL_IN_FORKS: Final = ("world_path", "update_rate", "step_size", "show_viz", "viz_pub_rate")


class ParameterServer:
    """The private parameters of the node and `/use_sim_time`, read once.

    Each call of the master takes about a millisecond.

    Attributes:
        use_sim_time: Value of `/use_sim_time`, None if it is not set.
    """

    def __init__(self) -> None:
        """Reads the parameters; must be called after `rospy.init_node`."""
        private = rospy.get_param("~", {})
        # A value instead of a namespace, if someone has set a parameter with the name of the node.
        self._private: dict[str, object] = private if isinstance(private, dict) else {}
        self.use_sim_time: object = rospy.get_param(USE_SIM_TIME, None)

    def get(self, name: str) -> object:
        """Returns a private parameter, None if it is not set.

        `simplify_map` is searched for in outer namespaces too; without a `~world_path`, so are the
        parameters that the launch files of some forks of the reference set there.
        """
        is_searched = name in _GLOBAL_IN_FORKS and "world_path" not in self._private
        if name in self._private or not (name == "simplify_map" or is_searched):
            return self._private.get(name)
        # Searches the namespace of the node, then each one above it.
        resolved = rospy.search_param(name)
        return None if resolved is None else rospy.get_param(resolved, None)

    def found(self) -> dict[str, object]:
        """Returns all parameters that are set, by resolved name."""
        found = {rospy.resolve_name(f"~{name}"): value for name, value in self._private.items()}
        if self.use_sim_time is not None:
            found[USE_SIM_TIME] = self.use_sim_time
        return found
