"""flatland: a fast and exact 2-D robot simulator.

`World.from_yaml` loads a world and `World.step` steps it; `docs/` describes the file formats and
the plugin interface. This package does not require ROS, except for the ROS node `flatland.ros`.
"""

from flatland.requirements import check_requirements

check_requirements()  # Otherwise, a missing package results in a traceback without a remedy.

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
from flatland.plugin_api.dynamics_limits import DynamicsLimits
from flatland.plugin_api.plugin import ModelPlugin, WorldPlugin
from flatland.plugin_api.ports import Command, Output
from flatland.plugin_api.update_timer import UpdateTimer
from flatland.runtime.model_states import ModelStates
from flatland.runtime.observer import WorldObserver
from flatland.runtime.snapshot import WorldSnapshot
from flatland.timekeeper import Timekeeper
from flatland.values import (
    Collision,
    Collisions,
    Imu,
    LaserScan,
    NavSatFix,
    Odometry,
    Transform,
    Twist,
    TwistWithCovariance,
)
from flatland.version import VERSION
from flatland.world import World

load_world = World.from_yaml

__version__ = VERSION

__all__ = [
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
    "LaserScan",
    "Layer",
    "MapFileError",
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
]
