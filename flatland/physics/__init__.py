"""Handles of Box2D objects: the physics world, its bodies, fixtures, joints and contacts.

This package is the only interface between flatland and the physics of its C++ extension. A handle
consists of a world and an id; the world owns the object. Once the object is destroyed or the world
is closed, every use of the handle raises `StaleHandleError`. While a world is stepping or creating
edges, every use of it in another thread raises `WorldLockedError`. A change waits until other
threads have finished casting rays.

Lengths are in metres, angles in radians, times in seconds and masses in kilograms. All numbers must
be finite and within +-1e9. Box2D computes in single precision.
"""

from flatland._core import BOX2D_VERSION, OldManifold, PreSolveContact
from flatland.geometry import Pose
from flatland.physics.body import PhysicsBody
from flatland.physics.contact import ContactEvent, ContactInfo
from flatland.physics.controller import (
    AckermannController,
    Controller,
    DriveController,
    OmniController,
    PathController,
    RollingWheel,
    TricycleController,
    TweenController,
    VelocityController,
    WheelsController,
    ease,
    easings,
)
from flatland.physics.crowd import Crowd, PersonState, RouteOrder
from flatland.physics.fixture import PhysicsFixture
from flatland.physics.joint import PhysicsJoint
from flatland.physics.material import Material
from flatland.physics.plan import (
    END_OF_ORDER,
    RunEnd,
    RunResult,
    StepPlan,
    StepRun,
    WorkTimes,
    run_worlds,
)
from flatland.physics.queries import RayHit
from flatland.physics.range_finder import (
    BeamFan,
    LabelledScan,
    RangeFinder,
    RangeNoise,
    Scan,
    ScanRequest,
    scan_all,
)
from flatland.physics.touches import Touch, Touches
from flatland.physics.world import PhysicsWorld, StepReport, to_report

__all__ = [
    "BOX2D_VERSION",
    "END_OF_ORDER",
    "AckermannController",
    "BeamFan",
    "ContactEvent",
    "ContactInfo",
    "Controller",
    "Crowd",
    "DriveController",
    "LabelledScan",
    "Material",
    "OldManifold",
    "OmniController",
    "PathController",
    "PersonState",
    "PhysicsBody",
    "PhysicsFixture",
    "PhysicsJoint",
    "PhysicsWorld",
    "Pose",
    "PreSolveContact",
    "RangeFinder",
    "RangeNoise",
    "RayHit",
    "RollingWheel",
    "RouteOrder",
    "RunEnd",
    "RunResult",
    "Scan",
    "ScanRequest",
    "StepPlan",
    "StepReport",
    "StepRun",
    "Touch",
    "Touches",
    "TricycleController",
    "TweenController",
    "VelocityController",
    "WheelsController",
    "WorkTimes",
    "ease",
    "easings",
    "run_worlds",
    "scan_all",
    "to_report",
]
