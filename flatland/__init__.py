"""flatland: a fast and exact 2-D robot simulator.

`World.from_yaml` loads a world and `World.step` steps it; `docs/` describes the file formats and
the plugin interface. This package does not require ROS, except for the ROS node `flatland.ros`.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from flatland.requirements import check_requirements
from flatland.version import VERSION

check_requirements()  # Otherwise, a missing package results in a traceback without a remedy.

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader
    from flatland.drawing import draw
    from flatland.entities.body import Body
    from flatland.entities.contact import Contact, ContactImpulse, ModelContact, MutableContact
    from flatland.entities.joint import Joint
    from flatland.entities.layer import Layer
    from flatland.entities.model import Model
    from flatland.errors import (
        BatchError,
        FlatlandError,
        MapFileError,
        PhysicsError,
        Place,
        PluginError,
        StaleHandleError,
        WorldError,
        WorldLockedError,
        YamlError,
    )
    from flatland.loading.model_source import ModelSpec
    from flatland.maps.occupancy_grid import OccupancyGrid
    from flatland.physics.material import Material
    from flatland.plugin_api.dynamics_limits import DynamicsLimits
    from flatland.plugin_api.plugin import ModelPlugin, WorldPlugin
    from flatland.plugin_api.ports import Command, Output
    from flatland.plugin_api.schedule import when_due
    from flatland.plugin_api.update_timer import UpdateTimer
    from flatland.runtime.model_states import ModelStates
    from flatland.runtime.observer import WorldObserver
    from flatland.runtime.snapshot import WorldSnapshot
    from flatland.timekeeper import Timekeeper
    from flatland.values import (
        AckermannCommand,
        Collision,
        Collisions,
        Imu,
        JointState,
        LaserScan,
        NavSatFix,
        Odometry,
        PoseStamped,
        Range,
        SemanticLabel,
        SemanticScan,
        Transform,
        Twist,
        TwistWithCovariance,
    )
    from flatland.world import World

    load_world = World.from_yaml

__version__ = VERSION

__all__ = [
    "AckermannCommand",
    "BatchError",
    "Body",
    "Collision",
    "Collisions",
    "Command",
    "Contact",
    "ContactImpulse",
    "DynamicsLimits",
    "FlatlandError",
    "Imu",
    "Joint",
    "JointState",
    "LaserScan",
    "Layer",
    "MapFileError",
    "Material",
    "Model",
    "ModelContact",
    "ModelPlugin",
    "ModelSpec",
    "ModelStates",
    "MutableContact",
    "NavSatFix",
    "OccupancyGrid",
    "Odometry",
    "Output",
    "PhysicsError",
    "Place",
    "PluginError",
    "PoseStamped",
    "Range",
    "SemanticLabel",
    "SemanticScan",
    "StaleHandleError",
    "Timekeeper",
    "Transform",
    "Twist",
    "TwistWithCovariance",
    "UpdateTimer",
    "World",
    "WorldError",
    "WorldLockedError",
    "WorldObserver",
    "WorldPlugin",
    "WorldSnapshot",
    "YamlError",
    "YamlReader",
    "draw",
    "load_world",
    "when_due",
]

# Imported when they are first used: the ROS node publishes its time before it needs any of them.
_MODULES = {
    "AckermannCommand": "flatland.values",
    "BatchError": "flatland.errors",
    "Body": "flatland.entities.body",
    "Collision": "flatland.values",
    "Collisions": "flatland.values",
    "Command": "flatland.plugin_api.ports",
    "Contact": "flatland.entities.contact",
    "ContactImpulse": "flatland.entities.contact",
    "DynamicsLimits": "flatland.plugin_api.dynamics_limits",
    "FlatlandError": "flatland.errors",
    "Imu": "flatland.values",
    "JointState": "flatland.values",
    "Joint": "flatland.entities.joint",
    "LaserScan": "flatland.values",
    "Layer": "flatland.entities.layer",
    "MapFileError": "flatland.errors",
    "Material": "flatland.physics.material",
    "Model": "flatland.entities.model",
    "ModelContact": "flatland.entities.contact",
    "ModelPlugin": "flatland.plugin_api.plugin",
    "ModelSpec": "flatland.loading.model_source",
    "ModelStates": "flatland.runtime.model_states",
    "MutableContact": "flatland.entities.contact",
    "NavSatFix": "flatland.values",
    "OccupancyGrid": "flatland.maps.occupancy_grid",
    "Odometry": "flatland.values",
    "Output": "flatland.plugin_api.ports",
    "PhysicsError": "flatland.errors",
    "Place": "flatland.errors",
    "PluginError": "flatland.errors",
    "PoseStamped": "flatland.values",
    "Range": "flatland.values",
    "SemanticLabel": "flatland.values",
    "SemanticScan": "flatland.values",
    "StaleHandleError": "flatland.errors",
    "Timekeeper": "flatland.timekeeper",
    "Transform": "flatland.values",
    "Twist": "flatland.values",
    "TwistWithCovariance": "flatland.values",
    "UpdateTimer": "flatland.plugin_api.update_timer",
    "World": "flatland.world",
    "WorldError": "flatland.errors",
    "WorldLockedError": "flatland.errors",
    "WorldObserver": "flatland.runtime.observer",
    "WorldPlugin": "flatland.plugin_api.plugin",
    "WorldSnapshot": "flatland.runtime.snapshot",
    "YamlError": "flatland.errors",
    "YamlReader": "flatland.config.reader",
    "draw": "flatland.drawing",
    "when_due": "flatland.plugin_api.schedule",
}


def __getattr__(name: str) -> Any:
    """Returns a member of `__all__` or a module of the package, importing it."""
    value: Any
    if name in _MODULES:
        value = getattr(import_module(_MODULES[name]), name)
    elif name == "load_world":
        value = import_module("flatland.world").World.from_yaml
    elif not name.startswith("_") and find_spec(f"{__name__}.{name}") is not None:
        try:
            return import_module(f"{__name__}.{name}")
        except ImportError as error:  # The module needs an extra that is not installed.
            text = f"module {__name__!r} has no attribute {name!r}: {error}"
            raise AttributeError(text) from error
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Returns the members of the package, including those that have not been imported."""
    return sorted({*globals(), *__all__})
