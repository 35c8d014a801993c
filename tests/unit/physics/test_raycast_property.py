"""Scans in random worlds, compared with `b2World::RayCast`.

The distances must be equal within 1e-4 m plus 1e-5 of the length of the ray. Rays that graze a
corner, run along a wall or start on one are ill-conditioned: rounding decides which of several
surfaces they hit, if any. The distance of such a ray must equal that computed by Box2D for one of
several perturbed rays. On slanted surfaces the distances of perturbed rays differ by several
tolerances. In 2.4 million rays, the difference never exceeded ten tolerances. About one ray in a
million starts on a surface and differs from all perturbed ones; it must end at a surface and pass
none. Any other range would be a hit in mid-air.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from flatland.physics import PhysicsBody, PhysicsWorld, Pose

FloatArray = npt.NDArray[np.float64]
EdgeMaker = Callable[[np.random.Generator, int], FloatArray]

# A failure prints a blob that reproduces it. A blob is valid for one version of hypothesis only, so
# add the scene to test_raycast.py as a separate test.
PROPERTY = settings(
    max_examples=20,
    deadline=None,
    print_blob=True,
    suppress_health_check=list(HealthCheck),
)
MASKS = st.sampled_from([0xFFFF, 1, 2, 3, 6, 0])
ANGLES = st.one_of(st.sampled_from([0.0, math.pi / 2, math.pi, -math.pi / 4]), st.floats(-7, 7))


@dataclass
class Scene:
    """A world with the size of its contents [m] and their center."""

    world: PhysicsWorld
    size: float
    middle: FloatArray
    rng: np.random.Generator
    bodies: list[PhysicsBody] = field(default_factory=list)

    def add_body(self, body_type: str, point: tuple[float, float], theta: float) -> PhysicsBody:
        self.bodies.append(self.world.create_body(body_type, (*point, theta)))
        return self.bodies[-1]

    def point(self, spread: float = 1.0) -> tuple[float, float]:
        x, y = self.middle + self.rng.uniform(-spread, spread, 2) * self.size
        return float(x), float(y)


def scattered(rng: np.random.Generator, count: int) -> FloatArray:
    return rng.uniform(-1, 1, (count, 4))


def polyline(rng: np.random.Generator, count: int) -> FloatArray:
    """Returns closed outlines of edges with arbitrary slopes."""
    corners = rng.uniform(-1, 1, (count, 2))
    return np.hstack([corners, np.roll(corners, -1, axis=0)])


def pixels(rng: np.random.Generator, count: int) -> FloatArray:
    """Returns horizontal and vertical edges on a grid that touch, cross and overlap each other."""
    start = rng.integers(-5, 6, (count, 2)) / 5
    along = np.eye(2)[rng.integers(0, 2, count)]
    return np.hstack([start, start + along * rng.integers(1, 5, (count, 1)) / 5])


def slivers(rng: np.random.Generator, count: int) -> FloatArray:
    """Returns short edges with gaps between them."""
    start = rng.uniform(-1, 1, (count, 2))
    return np.hstack([start, start + rng.normal(0, 0.02, (count, 2))])


def add_edges(scene: Scene, make_edges: EdgeMaker, body_type: str, turn: float) -> None:
    rng = scene.rng
    body = scene.add_body(body_type, scene.point(rng.choice([0, 0.3])), turn)
    edges = make_edges(rng, int(rng.integers(1, 50))) * scene.size
    half = len(edges) // 2
    body.create_edges(edges[:half], category_bits=int(rng.integers(0, 8)))
    body.create_edges(edges[half:], category_bits=int(rng.integers(1, 8)))


def add_twin(scene: Scene) -> None:
    """Repeats some edges of a body in another one at the same pose, as a second layer does."""
    rng = scene.rng
    original = scene.bodies[rng.integers(len(scene.bodies))]
    edges = original.edges()
    x, y, theta = original.pose
    body = scene.add_body(original.type, (x, y), theta)
    for _ in range(rng.integers(1, 4)):
        repeated = edges[rng.random(len(edges)) < 0.7]
        body.create_edges(repeated, category_bits=int(rng.integers(0, 8)))


def add_solid(scene: Scene, body_type: str) -> None:
    rng = scene.rng
    body = scene.add_body(body_type, scene.point(), rng.uniform(-4, 4))
    for _ in range(rng.integers(1, 3)):
        options = {
            "density": 1.0,
            "is_sensor": bool(rng.random() < 0.15),
            "category_bits": int(rng.integers(0, 8)),
        }
        try:
            if rng.random() < 0.5:
                center = rng.uniform(-0.05, 0.05, 2) * scene.size
                body.create_circle(center, 0.3 * scene.size * rng.random() ** 2, **options)
            else:
                corners = rng.uniform(-0.2, 0.2, (rng.integers(3, 9), 2)) * scene.size
                body.create_polygon(corners, **options)
        except ValueError:
            # Rejected because it is too small for Box2D.
            continue


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    body_types = st.sampled_from(["static", "kinematic", "dynamic"])
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size = draw(st.floats(0.03, 1000))
    # The resolution of single precision is low far from the origin of the world.
    distance = draw(st.sampled_from([0.0, 0.0, 10.0, 1000.0]))
    scene = Scene(PhysicsWorld(), size, rng.uniform(-1, 1, 2) * distance, rng)
    for kind in draw(st.lists(st.sampled_from([scattered, polyline, pixels, slivers]), max_size=3)):
        add_edges(scene, kind, draw(body_types), draw(ANGLES))
    if scene.bodies:
        for _ in range(draw(st.integers(0, 2))):
            add_twin(scene)
    for body_type in draw(st.lists(body_types, max_size=10)):
        add_solid(scene, body_type)
    return scene


@st.composite
def fans(draw: st.DrawFn) -> npt.NDArray[np.float32]:
    """Returns rays in both directions, over more than a turn, at right angles, and so on."""
    count = draw(st.integers(1, 200))
    length = 10 ** draw(st.floats(-2, 3))
    first, last = draw(ANGLES), draw(ANGLES)
    angles = np.linspace(first, last, count)
    if draw(st.booleans()):
        angles = np.round(angles * 4 / math.pi) * math.pi / 4
    lengths = np.full(count, length)
    if draw(st.booleans()):
        lengths *= np.random.default_rng(count).random(count)
    ends = lengths[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    return ends.astype(np.float32)


@st.composite
def sensor_poses(draw: st.DrawFn, scene: Scene) -> Pose:
    """Returns random positions, also on grid lines, corners and lines of edges, and in shapes."""
    where = draw(st.sampled_from(["anywhere", "grid", "corner", "edge", "body"]))
    x, y = scene.point(1.2)
    with_edges = [b for b in scene.bodies if len(b.edges())]
    if where == "grid":
        x, y = np.round((np.array((x, y)) - scene.middle) / scene.size * 5) / 5 * scene.size
        x, y = float(x + scene.middle[0]), float(y + scene.middle[1])
    elif where in ("corner", "edge") and with_edges:
        body = with_edges[scene.rng.integers(len(with_edges))]
        edge = body.edges()[scene.rng.integers(len(body.edges()))].astype(float)
        part = 0.0 if where == "corner" else scene.rng.random()
        x, y = to_world(body, edge[:2] + part * (edge[2:] - edge[:2]))
    elif where == "body" and scene.bodies:
        x, y, _ = scene.bodies[scene.rng.integers(len(scene.bodies))].pose
    return x, y, draw(ANGLES)


def to_world(body: PhysicsBody, point: FloatArray) -> tuple[float, float]:
    x, y, theta = body.pose
    px, py = point
    return (
        x + math.cos(theta) * px - math.sin(theta) * py,
        y + math.sin(theta) * px + math.cos(theta) * py,
    )


def ranges(fractions: npt.NDArray[np.float32], lengths: FloatArray) -> FloatArray:
    """Returns distances [m], infinite for a miss."""
    return np.where(np.isnan(fractions), np.inf, fractions.astype(np.float64) * lengths)


def perturbed_poses(pose: Pose, longest: float) -> list[Pose]:
    """Returns the pose and adjacent poses within the rounding errors.

    Box2D computes in single precision, whose errors grow with the coordinates and the length of a
    ray. Nine positions and three headings yield rays on both sides of each corner and edge nearby.
    """
    x, y, theta = pose
    shift = 2e-5 + 1e-6 * (abs(x) + abs(y) + longest)
    turn = 2e-5
    return [
        (x + i * shift, y + j * shift, theta + k * turn)
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
        for k in (-1, 0, 1)
    ]


@PROPERTY
@given(st.data())
def test_scans_equal_those_of_box2d(data: st.DataObject) -> None:
    scene = data.draw(scenes())
    world = scene.world
    for _ in range(3):
        if scene.bodies and data.draw(st.booleans()):
            body = scene.bodies[scene.rng.integers(len(scene.bodies))]
            body.set_pose(*scene.point(), data.draw(ANGLES))
        ends = data.draw(fans())
        pose = data.draw(sensor_poses(scene))
        mask, reflect_mask = data.draw(MASKS), data.draw(MASKS)
        assume(max(map(abs, pose)) < 1e6)
        lengths = np.hypot(*ends.astype(np.float64).T)
        tolerance = 1e-4 + 1e-5 * lengths

        fractions, reflect = world.cast_rays(pose, ends, mask, reflect_mask)
        got = ranges(fractions, lengths)
        expected, expected_reflect = world.cast_rays_reference(pose, ends, mask, reflect_mask)
        same = equal_or_close(got, ranges(expected, lengths), tolerance)
        same_reflect = reflect == expected_reflect
        for hair in perturbed_poses(pose, float(lengths.max())):
            if same.all() and same_reflect.all():
                break
            # The error of the formula of Box2D for circles depends on the length of the ray.
            for stretch in (1.0, 1.001):
                longer = ends * np.float32(stretch)
                other = world.cast_rays_reference(hair, longer, mask, reflect_mask)
                same |= equal_or_close(got, ranges(other[0], lengths * stretch), 10 * tolerance)
                same_reflect |= reflect == other[1]
        for ray in np.nonzero(~(same & same_reflect))[0]:
            margin = 10 * float(tolerance[ray])
            assert is_valid(
                world, mask, reflect_mask, pose, ends[ray], got[ray], reflect[ray], margin
            ), f"ray {ray} from {pose}: range {got[ray]} m, reflection {reflect[ray]}"


def is_valid(
    world: PhysicsWorld,
    mask: int,
    reflect_mask: int,
    pose: Pose,
    end: npt.NDArray[np.float32],
    distance: float,
    reflect: bool,
    margin: float,
) -> bool:
    """Returns whether there is a surface at the distance [m] and none on the way.

    A ray beside it, within the margin [m], may take its place: if a ray starts on a surface,
    rounding decides whether it hits that surface, and where.
    """
    x, y, theta = pose
    length = float(np.hypot(*end.astype(np.float64)))
    along = to_unit(math.atan2(end[1], end[0]) + theta)
    reach = min(distance, length)

    # A ray that starts beside a surface and runs along it does not hit it. In the tip of a narrow
    # wedge, no such ray exists closer to the sensor than some margins.
    left = np.array((-along[1], along[0]))
    free = False
    for ahead in (1, 10):
        for side in (-1, 0, 1):
            way = reach - ahead * margin - (0.0 if math.isinf(distance) else margin)
            start = np.array((x, y)) + margin * (ahead * along + side * left)
            free = free or way <= 0 or is_free(world, mask, start, way * along)
    if not free:
        return False
    if math.isinf(distance):
        return not reflect
    # A surface at this point, unless tiny, intersects the outline of a square around it.
    point = np.array((x, y)) + reach * along
    corners = point + margin * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    for corner, others in zip(corners, (corners[[1, 3]], corners[[0, 2]]) * 2, strict=True):
        fractions, reflected = world.cast_rays_reference(
            (*corner, 0.0), others - corner, mask, reflect_mask
        )
        if np.any(~np.isnan(fractions) & (reflected == reflect)):
            return True
    return False


def is_free(world: PhysicsWorld, mask: int, start: FloatArray, way: FloatArray) -> bool:
    fractions, _ = world.cast_rays_reference((start[0], start[1], 0.0), [way], mask)
    return bool(np.isnan(fractions[0]))


def to_unit(angle: float) -> FloatArray:
    return np.array((math.cos(angle), math.sin(angle)))


def equal_or_close(a: FloatArray, b: FloatArray, tolerance: FloatArray) -> npt.NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        return (a == b) | (np.abs(a - b) <= tolerance)


@PROPERTY
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(3, 60),
    exponent=st.floats(-1.7, 2.9),
    distance=st.sampled_from([0, 100, 50_000]),
)
def test_no_ray_leaves_a_closed_outline(
    seed: int, count: int, exponent: float, distance: float
) -> None:
    """No wall is missed: every ray from the interior of a closed outline has a hit.

    Far from the origin of the world, the resolution of a float is only millimeters, which changes
    the directions of short rays.
    """
    length = 10**exponent
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * math.pi, count))
    assume(np.diff(angles, append=angles[0] + 2 * math.pi).max() < 3)
    radii = length * rng.uniform(0.2, 1, count)
    corners = (radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)).astype(np.float32)
    edges = np.hstack([corners, np.roll(corners, -1, axis=0)])
    world = PhysicsWorld()
    x, y, theta = *rng.uniform(-distance, distance, 2), rng.uniform(-4, 4)
    body = world.create_body("static", (x, y, theta))
    body.create_edges(edges)
    # Rays towards the corners, towards points of the edges, and in all directions.
    part = rng.random((count, 1)).astype(np.float32)
    on_edges = corners + part * (np.roll(corners, -1, axis=0) - corners)
    around = np.linspace(0, 2 * math.pi, 700)
    circle = np.stack([np.cos(around), np.sin(around)], 1)
    ends = np.concatenate([corners, on_edges, circle])
    ends *= (2 * length / np.hypot(*ends.T))[:, None]
    fractions, _ = world.cast_rays((x, y, theta), ends, 0xFFFF)
    assert not np.isnan(fractions).any()
