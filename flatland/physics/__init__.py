"""Box2D behind handles: the physics world, its bodies, fixtures, joints and contacts.

All of flatland reaches the physics of its C++ core through this package. A handle holds its world
and an id. The world owns what the id stands for; once that is destroyed, or the world closed, every
use of the handle raises `StaleHandleError`. While a world steps, or makes edges, any use of it from
another thread raises `WorldLockedError`; while other threads cast rays, a change waits for them.

All lengths are in metres, angles in radians, times in seconds, masses in kilograms; numbers must
be finite and within +-1e9. Box2D computes in single precision.
"""

from flatland._core import OldManifold, PreSolveContact
from flatland.geometry import Pose
from flatland.physics.body import PhysicsBody
from flatland.physics.contact import ContactEvent, ContactInfo
from flatland.physics.fixture import PhysicsFixture
from flatland.physics.joint import PhysicsJoint
from flatland.physics.world import PhysicsWorld, RayHit, StepReport

__all__ = [
    "ContactEvent",
    "ContactInfo",
    "OldManifold",
    "PhysicsBody",
    "PhysicsFixture",
    "PhysicsJoint",
    "PhysicsWorld",
    "Pose",
    "PreSolveContact",
    "RayHit",
    "StepReport",
]
