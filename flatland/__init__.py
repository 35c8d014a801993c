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
    # "X as X" exports X for type checkers.
    from flatland.config.reader import YamlReader as YamlReader  # noqa: I001 - several per line
    from flatland.drawing import draw as draw
    from flatland.entities.body import Body as Body
    from flatland.entities.contact import (
        Contact as Contact,
        ContactImpulse as ContactImpulse,
        ModelContact as ModelContact,
        MutableContact as MutableContact,
    )
    from flatland.entities.joint import Joint as Joint
    from flatland.entities.layer import Layer as Layer
    from flatland.entities.model import Model as Model
    from flatland.errors import (
        BatchError as BatchError,
        FlatlandError as FlatlandError,
        MapFileError as MapFileError,
        PhysicsError as PhysicsError,
        Place as Place,
        PluginError as PluginError,
        StaleHandleError as StaleHandleError,
        WorldError as WorldError,
        WorldLockedError as WorldLockedError,
        YamlError as YamlError,
    )
    from flatland.loading.model_source import ModelSpec as ModelSpec
    from flatland.physics import Material as Material
    from flatland.plugin_api.dynamics_limits import DynamicsLimits as DynamicsLimits
    from flatland.plugin_api.plugin import ModelPlugin as ModelPlugin, WorldPlugin as WorldPlugin
    from flatland.plugin_api.ports import Command as Command, Output as Output
    from flatland.plugin_api.update_timer import UpdateTimer as UpdateTimer
    from flatland.plugin_api.updates import when_due as when_due
    from flatland.runtime.model_states import ModelStates as ModelStates
    from flatland.runtime.observer import WorldObserver as WorldObserver
    from flatland.runtime.snapshot import WorldSnapshot as WorldSnapshot
    from flatland.timekeeper import Timekeeper as Timekeeper
    from flatland.values import (
        AckermannCommand as AckermannCommand,
        Collision as Collision,
        Collisions as Collisions,
        Imu as Imu,
        JointState as JointState,
        LaserScan as LaserScan,
        NavSatFix as NavSatFix,
        OccupancyGrid as OccupancyGrid,
        Odometry as Odometry,
        PoseStamped as PoseStamped,
        Range as Range,
        SemanticLabel as SemanticLabel,
        SemanticScan as SemanticScan,
        Transform as Transform,
        Twist as Twist,
        TwistWithCovariance as TwistWithCovariance,
    )
    from flatland.world import World as World

    load_world = World.from_yaml

__version__ = VERSION

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
    "Material": "flatland.physics",
    "Model": "flatland.entities.model",
    "ModelContact": "flatland.entities.contact",
    "ModelPlugin": "flatland.plugin_api.plugin",
    "ModelSpec": "flatland.loading.model_source",
    "ModelStates": "flatland.runtime.model_states",
    "MutableContact": "flatland.entities.contact",
    "NavSatFix": "flatland.values",
    "OccupancyGrid": "flatland.values",
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
    "when_due": "flatland.plugin_api.updates",
}
__all__ = sorted([*_MODULES, "load_world"])


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
