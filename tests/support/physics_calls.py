"""Calls of all public functions of the physics engine in random order, with any arguments.

Handles may be stale, of another kind or made up, and numbers extreme. After each call, the world is
compared with a model of what should exist in it.
"""

from __future__ import annotations

import copy
import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from controller_calls import ControllerCalls

from flatland.errors import PhysicsError, StaleHandleError, WorldLockedError
from flatland.physics import (
    Handle,
    PhysicsBody,
    PhysicsFixture,
    PhysicsJoint,
    PhysicsWorld,
    RangeFinder,
    RangeNoise,
    Run,
    RunEnd,
    ScanRequest,
    are_connected,
    boundary_edges,
    boundary_loops,
    connected_regions,
    dilated,
    distances_to_off,
    scan_all,
    simplified_loop,
)

ERRORS: Final = (ValueError, PhysicsError)
"""The documented errors of all calls."""

EXTREME: Final = (
    *(0.0, -0.0, 1e-45, -1e-45, 1e-38, 1e-20, 1e-9, 1e-6, 1e-3, -1e-3, 1e3, -1e3, 1e6, -1e6, 1e8),
    *(1e9, -1e9, 1.001e9, 1e15, 1e19, -1e19, 1e30, 3.4e38, -3.5e38, 1e308, -1e308),
    *(float("nan"), float("inf"), float("-inf"), 2**53 + 1),
)
BITS: Final = (0, 1, 2, 0xFFFF, 0x8000, -1, 0x10000, 2**31, 2**62)
# Processor time, far above that of the slowest call with these arguments [s].
CALL_LIMIT: Final = 5.0
MOST_BODIES: Final = 40
MOST_HANDLES: Final = 200


class CallError(AssertionError):
    """A call raised an undocumented error, took too long, or left the world inconsistent."""


@dataclass
class Objects:
    """What should exist in a world: fixtures and joints by body, in ids."""

    fixtures: dict[int, set[int]] = field(default_factory=dict)
    joints: dict[int, tuple[int, int]] = field(default_factory=dict)

    def counts(self) -> tuple[int, int, int]:
        return len(self.fixtures), sum(map(len, self.fixtures.values())), len(self.joints)

    def destroy_body(self, body: int) -> None:
        del self.fixtures[body]
        self.joints = {joint: ids for joint, ids in self.joints.items() if body not in ids}


class RandomCalls(ControllerCalls):
    """A random sequence of calls, determined by its seed."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        # Nothing may become invalid in a sequence with ordinary numbers only and without joints,
        # which can contradict each other.
        self.extremes = self.rng.choice([0.0, 0.02, 0.2])
        self.is_ordinary = not self.extremes and self.rng.random() < 0.5
        self.trace: list[str] = []
        self.calls = 0
        self.errors = 0
        self.hook_calls = 0
        self.hook_overflow = False
        self._methods: list[Callable[[], object]] = [
            method
            for name in dir(self)
            if name.startswith("do_")
            if not (self.is_ordinary and name.endswith("_joint"))
            for method in [getattr(self, name)] * _WEIGHTS.get(name, 3)
        ]
        self._start()

    def _start(self) -> None:
        self.world = PhysicsWorld()
        self.objects = Objects()
        self.bodies: list[PhysicsBody] = []
        self.fixtures: list[PhysicsFixture] = []
        self.joints: list[PhysicsJoint] = []
        self.invalid: set[int] = set()
        self.saved: tuple[PhysicsWorld, Objects, set[int]] | None = None

    # -- the run -----------------------------------------------------------------------------

    def run(self, count: int) -> None:
        """Makes calls.

        Raises:
            CallError: See there.
        """
        with np.errstate(over="ignore"):  # of the conversion to float32
            self._run(count)
        self.world.close()

    def _run(self, count: int) -> None:
        for _ in range(count):
            method = self.rng.choice(self._methods)
            self.trace.append(method.__name__)
            self.calls += 1
            before = None if self.world.closed else self._snapshot()
            start = time.process_time()
            try:
                method()
            except ERRORS:
                self.errors += 1
                if before is not None and method.__name__ != "do_close":
                    self._require(self._snapshot() == before, "changed something and raised")
            except CallError:
                raise
            except Exception as error:
                raise CallError(f"{self._last()}: {type(error).__name__}: {error}") from error
            spent = time.process_time() - start
            self._require(spent < CALL_LIMIT, f"took {spent:.1f} s")
            self._check()

    def _require(self, condition: bool, text: str) -> None:
        if not condition:
            raise CallError(f"{self._last()} {text}")

    def _last(self) -> str:
        return f"call {self.calls}, {self.trace[-1]},"

    def _snapshot(self) -> bytes:
        counts = self.world.object_counts()
        return repr(tuple(counts)[:3]).encode() + self.world.body_states().tobytes()

    def _check(self) -> None:
        """Compares the world with the model."""
        if self.world.closed:
            return
        counts = tuple(self.world.object_counts())[:3]
        self._require(
            counts == self.objects.counts(), f"leaves {counts} objects, not {self.objects.counts()}"
        )
        states = self.world.body_states()
        finite = np.isfinite(states).all(axis=1)
        if not finite.all():
            for body in self.objects.fixtures:
                values = (*self.world.body(body).pose, *self.world.body(body).velocity)
                self._require(
                    bool(np.isfinite(values).all()) or body in self.invalid,
                    f"leaves body {body:#x} with {values}",
                )
        for handle in self.rng.sample(self.bodies, min(3, len(self.bodies))):
            self._require(
                handle.alive == (handle.id in self.objects.fixtures), f"confuses {handle!r}"
            )
        for joint in self.rng.sample(self.joints, min(2, len(self.joints))):
            self._require(joint.alive == (joint.id in self.objects.joints), f"confuses {joint!r}")

    # -- arguments ---------------------------------------------------------------------------

    def number(self, low: float = -5.0, high: float = 5.0) -> float:
        if self.rng.random() < self.extremes:
            return self.rng.choice(EXTREME)
        if self.rng.random() < 0.1:
            return float(round(self.rng.uniform(low, high)))
        return self.rng.uniform(low, high)

    def positive(self, high: float = 2.0) -> float:
        return self.number(0.01, high)

    def pair(self) -> tuple[float, float]:
        return self.number(), self.number()

    def triple(self) -> tuple[float, float, float]:
        return self.number(), self.number(), self.number()

    def array(self, most: int, width: int) -> Any:
        if self.rng.random() < self.extremes / 4:
            return np.zeros(self.rng.choice([(), (0,), (3,), (2, 1), (1, 2, 2), (4, 5)]))
        rows = [[self.number() for _ in range(width)] for _ in range(self.rng.randint(0, most))]
        kind = self.rng.choice([np.float64, np.float32])
        with np.errstate(over="ignore"):
            found = np.array(rows, kind).reshape(-1, width)
        return np.asfortranarray(found) if self.rng.random() < 0.1 else found

    def bits(self) -> int:
        if self.rng.random() < self.extremes:
            return self.rng.choice(BITS)
        return self.rng.choice([1, 2, 3, 0xFFFF])

    def some_id(self) -> int:
        known: list[Handle] = [*self.bodies, *self.fixtures, *self.joints]
        if known and self.rng.random() < 0.5:
            return self.rng.choice(known).id
        near = self.rng.choice(known).id if known else 0
        return self.rng.choice([0, 1, 2**60, near ^ 1, near ^ 2**32, 2**64 - 1, near % 2**32])

    def body(self) -> PhysicsBody:
        if not self.bodies or self.rng.random() < 0.05:
            return self.world.body(self.some_id())
        if self.rng.random() < 0.8:
            live = [body for body in self.bodies if body.id in self.objects.fixtures]
            return self.rng.choice(live or self.bodies)
        return self.rng.choice(self.bodies)

    def some_bodies(self) -> list[PhysicsBody]:
        return [self.body() for _ in range(self.rng.randint(0, 3))]

    def fixture(self) -> PhysicsFixture:
        if not self.fixtures or self.rng.random() < 0.05:
            return self.world.fixture(self.some_id())
        return self.rng.choice(self.fixtures)

    def joint(self) -> PhysicsJoint:
        if not self.joints or self.rng.random() < 0.05:
            return self.world.joint(self.some_id())
        return self.rng.choice(self.joints)

    def finite(self, what: str, *values: Any) -> None:
        """Requires that values are finite."""
        for value in values:
            self._require(bool(np.isfinite(value).all()), f"returns a {what} of {value}")

    # -- objects -----------------------------------------------------------------------------

    def do_create_body(self) -> None:
        if len(self.objects.fixtures) >= MOST_BODIES:
            return
        types = ["static", "kinematic", "dynamic", "dynamic", "dynamic"]
        kind = "soft" if self.rng.random() < self.extremes / 4 else self.rng.choice(types)
        body = self.world.create_body(
            kind,
            self.triple(),
            linear_damping=self.rng.choice([0.0, self.positive()]),
            angular_damping=self.rng.choice([0.0, self.positive()]),
        )
        self.objects.fixtures[body.id] = set()
        self._remember(self.bodies, body)

    def _remember(self, handles: list[Any], handle: Handle) -> None:
        self._require(handle not in handles, f"returns the id {handle.id:#x} again")
        handles.append(handle)
        if len(handles) > MOST_HANDLES:
            del handles[0]

    def do_destroy_body(self) -> None:
        body = self.body()
        body.destroy()
        self.objects.destroy_body(body.id)

    def do_create_circle(self) -> None:
        body = self.body()
        made = body.create_circle(self.pair(), self.positive(), **self._material(), **self._solid())
        self.objects.fixtures[body.id].add(made.id)
        self._remember(self.fixtures, made)

    def do_create_polygon(self) -> None:
        body = self.body()
        made = body.create_polygon(self.array(10, 2), **self._material(), **self._solid())
        self.objects.fixtures[body.id].add(made.id)
        self._remember(self.fixtures, made)

    def do_create_edges(self) -> None:
        body = self.body()
        before = set(body.fixture_ids)
        count = body.create_edges(self.array(12, 4), **self._material())
        new = set(body.fixture_ids) - before
        self._require(len(new) == count, f"makes {len(new)} edges, not {count}")
        self.objects.fixtures[body.id] |= new
        for fixture in new:
            self._remember(self.fixtures, self.world.fixture(fixture))

    def _material(self) -> dict[str, Any]:
        return {
            "friction": self.positive(1.0),
            "restitution": self.positive(1.0),
            "category_bits": self.bits(),
            "mask_bits": self.bits(),
        }

    def _solid(self) -> dict[str, Any]:
        return {"density": self.positive(10.0), "is_sensor": self.rng.random() < 0.2}

    def do_create_revolute_joint(self) -> None:
        first, second = self.body(), self.body()
        limits = self.rng.choice([None, self.pair()])
        made = self.world.create_revolute_joint(
            first,
            second,
            self.pair(),
            self.pair(),
            limits=limits,
            collide_connected=self.rng.random() < 0.5,
        )
        self.objects.joints[made.id] = first.id, second.id
        self._remember(self.joints, made)

    def do_create_weld_joint(self) -> None:
        first, second = self.body(), self.body()
        made = self.world.create_weld_joint(
            first,
            second,
            self.pair(),
            self.pair(),
            reference_angle=self.number(),
            frequency=self.rng.choice([0.0, self.positive(20.0)]),
            damping=self.rng.choice([0.0, self.positive()]),
            collide_connected=self.rng.random() < 0.5,
        )
        self.objects.joints[made.id] = first.id, second.id
        self._remember(self.joints, made)

    def do_destroy_joint(self) -> None:
        joint = self.joint()
        joint.destroy()
        del self.objects.joints[joint.id]

    # -- changes -----------------------------------------------------------------------------

    def do_set_pose(self) -> None:
        self.body().set_pose(*self.triple())

    def do_set_velocity(self) -> None:
        self.body().set_velocity(*self.triple())

    def do_run(self) -> None:
        n, start = self.rng.randint(0, 20), 5_000_000 * self.rng.randint(0, 1000)
        run = Run(start, 5_000_000, n, 0.005, 8, 3)
        made, end, calls, failed, report = self.world.jobs.run(*run)
        self._require(0 <= made <= n, "makes too many steps")
        self._require(calls == [], "calls what was not added")
        while end != RunEnd.DONE:
            # The physics step ends a run if it reports bodies or records contacts.
            is_physics = end == RunEnd.AFTER_PHYSICS
            self._require(is_physics or bool(failed), "ends without a reason")
            if report is not None:
                self.invalid = set(report[1])
            if end == RunEnd.LAST_CALLS:
                break
            _, end, _, failed, report = self.world.jobs.run(*run._replace(n=1, continues=True))
        self._require(self.invalid <= set(self.objects.fixtures), "reports unknown bodies")

    def do_collect_touches(self) -> None:
        bodies = self.some_bodies()
        self.world.own_bodies(bodies, self.rng.random() < 0.9)
        touches = self.world.collect_touches(bodies, own=self.rng.random() < 0.5)
        self._require(len(touches) == len(touches.read()), "counts contacts that do not exist")
        touches.clear()
        if self.rng.random() < 0.5:
            touches.remove()

    def do_apply_force(self) -> None:
        self.body().apply_force(self.pair(), self.pair())

    def do_apply_torque(self) -> None:
        self.body().apply_torque(self.number())

    def do_set_awake(self) -> None:
        self.body().awake = self.rng.random() < 0.5

    def do_set_is_sensor(self) -> None:
        self.fixture().is_sensor = self.rng.random() < 0.5

    def do_set_filter(self) -> None:
        fixture, bits = self.fixture(), self.bits()
        if self.rng.random() < 0.5:
            fixture.category_bits = bits
        else:
            fixture.mask_bits = bits

    def do_set_limits(self) -> None:
        if self.rng.random() < 0.2:
            self.joint().clear_limits()
        else:
            self.joint().set_limits(*self.pair())

    # -- steps -------------------------------------------------------------------------------

    def do_step(self) -> None:
        dt = self.rng.choice([0.005, 0.01, 0.1, self.number(1e-6, 1.0)])
        iterations = [self.rng.randint(0, 20) for _ in range(2)]
        if self.rng.random() < self.extremes / 4:
            iterations[self.rng.randint(0, 1)] = -1
        self.hook_overflow = False
        report = self.world.step(dt, *iterations)
        self.invalid = set() if report is None else set(report.invalid)
        known = set(self.objects.fixtures)
        self._require(self.invalid <= known, "reports unknown bodies")
        self._require(report is None or set(report.limited) <= known, "limits unknown bodies")
        if self.is_ordinary:
            self._require(not self.invalid, "makes bodies invalid without extreme numbers")
        # Bodies overflow within a step, which is reported at its end.
        self._require(bool(self.invalid) or not self.hook_overflow, "passes NaN to pre_solve")
        for error in self.world.take_pre_solve_errors():
            self._require(isinstance(error, ERRORS), f"raises {error!r} in pre_solve")

    def do_set_hook(self) -> None:
        ids = {body.id for body in self.some_bodies()} | {self.some_id()}
        self.world.pre_solve = self.rng.choice([None, self._hook])
        self.world.pre_solve_bodies = ids

    def _hook(self, contact: Any, old: Any) -> None:
        self.hook_calls += 1
        for change in (self.world.close, lambda: self.body().destroy()):
            try:
                change()
            except WorldLockedError:
                continue
            except StaleHandleError:
                continue  # a stale or made-up handle
            raise CallError("the world can be changed in pre_solve")
        numbers = (contact.normal, contact.points, old.points, old.normal_impulses)
        self.hook_overflow |= not all(np.isfinite(values).all() for values in numbers)
        name = self.rng.choice(["enabled", "friction", "restitution", "tangent_speed"])
        setattr(contact, name, self.rng.random() < 0.5 if name == "enabled" else self.positive())
        if self.rng.random() < 0.1:
            raise ValueError("a test of errors in hooks")

    def do_find_new_contacts(self) -> None:
        self.world.find_new_contacts()

    def do_share_walls(self) -> None:
        self.world.share_walls()

    def do_record_contacts(self) -> None:
        self.world.record_contacts = self.rng.random() < 0.7

    def do_take_contact_events(self) -> None:
        self.world.take_contact_events()

    def do_contacts(self) -> None:
        for contact in self.world.contacts():
            for body, fixture in (
                (contact.body_a, contact.fixture_a),
                (contact.body_b, contact.fixture_b),
            ):
                self._require(
                    fixture in self.objects.fixtures.get(body, ()), f"returns {contact} of nothing"
                )

    # -- copies ------------------------------------------------------------------------------

    def do_save(self) -> None:
        self.saved = (self.world.copy(), copy.deepcopy(self.objects), set(self.invalid))

    def do_restore(self) -> None:
        if self.saved is not None:
            world, objects, invalid = self.saved
            self.world.become_copy_of(world)
            self.objects, self.invalid = copy.deepcopy(objects), set(invalid)
            self._require(
                self.world.body_states().tobytes() == world.body_states().tobytes(),
                "restores another state",
            )

    def do_continue_with_a_copy(self) -> None:
        made = self.world.copy()
        before = self._snapshot()
        self.bodies = [made.body(body.id) for body in self.bodies]
        self.fixtures = [made.fixture(fixture.id) for fixture in self.fixtures]
        self.joints = [made.joint(joint.id) for joint in self.joints]
        if self.rng.random() < 0.5:
            self.world.close()
        self.world, self.saved = made, None
        self._require(self._snapshot() == before, "makes a copy with another state")

    def do_clear(self) -> None:
        self.world.clear()
        self.objects, self.invalid = Objects(), set()

    # -- queries -----------------------------------------------------------------------------

    def do_read_body(self) -> None:
        body = self.body()
        numbers = (body.mass, body.inertia, body.local_center, body.linear_damping)
        # Positions and velocities may overflow in a step, which reports the body.
        places = (body.pose, body.velocity, body.world_center)
        self.finite("property", *numbers, body.angular_damping)
        self._require(body.id in self.objects.fixtures, "reads a body that does not exist")
        if body.id not in self.invalid:
            self.finite("state", *places)
        self._require(body.type in ("static", "kinematic", "dynamic"), "returns a wrong type")
        found = {fixture.id for fixture in body.fixtures}
        self._require(found == self.objects.fixtures[body.id], "returns wrong fixtures")
        joints = {joint.id for joint in body.joints}
        expected = {joint for joint, ids in self.objects.joints.items() if body.id in ids}
        self._require(joints == expected, "returns wrong joints")
        self.finite("edge", body.edges())
        _ = body.awake

    def do_read_fixture(self) -> None:
        fixture = self.fixture()
        self._require(fixture.body.id in self.objects.fixtures, "reads a fixture of nothing")
        self.finite("fixture", fixture.vertices, fixture.center, fixture.radius, fixture.density)
        self.finite("fixture", fixture.friction, fixture.restitution)
        _ = fixture.shape, fixture.is_sensor, fixture.category_bits, fixture.mask_bits

    def do_read_joint(self) -> None:
        joint = self.joint()
        bodies = joint.body_a.id, joint.body_b.id
        self._require(self.objects.joints.get(joint.id) == bodies, "returns wrong bodies")
        limits = joint.limits or (0.0, 0.0)
        self.finite("joint", joint.anchors, limits, joint.reference_angle, joint.frequency)
        self.finite("joint", joint.damping)
        _ = joint.type, joint.collide_connected

    def do_ray_cast(self) -> None:
        hit = self.world.ray_cast(self.pair(), self.pair(), self.bits())
        if hit is not None:
            self._require(0 <= hit.fraction <= 1, f"returns {hit}")
            self.finite("hit", hit.point, hit.normal)
            known = any(hit.fixture.id in ids for ids in self.objects.fixtures.values())
            self._require(known, "hits nothing")

    def do_cast_rays(self) -> None:
        cast = self.rng.choice([self.world.cast_rays, self.world.cast_rays_reference])
        ends = self.array(40, 2)
        fractions, reflects = cast(self.triple(), ends, self.bits(), self.bits())
        self._require(fractions.shape == reflects.shape == (len(ends),), "returns wrong shapes")
        inside = np.isnan(fractions) | ((fractions >= 0) & (fractions <= 1))
        self._require(bool(inside.all()), f"returns the fractions {fractions}")

    def do_scan(self) -> None:
        requests = [
            ScanRequest(
                self._range_finder(), body, self.rng.getrandbits(64), self.rng.getrandbits(9)
            )
            for body in self.some_bodies()
        ]
        for scan, request in zip(scan_all(requests, None, 2), requests, strict=True):
            alone = request.finder.scan(request.body, request.stream, request.update)
            shape = (request.finder.beams,)
            self._require(scan.ranges.shape == shape, "returns a wrong shape")
            same = np.array_equal(scan.ranges, alone.ranges, equal_nan=True)
            self._require(same, "returns other ranges than a single scan")
            if scan.intensities is not None and alone.intensities is not None:
                known = np.isin(scan.intensities, (0.0, 255.0)).all()
                same = np.array_equal(scan.intensities, alone.intensities)
                self._require(bool(known) and same, "returns wrong intensities")

    def _range_finder(self) -> RangeFinder:
        noises: list[Callable[[], RangeNoise | None]] = [
            lambda: None,
            lambda: RangeNoise.additive(self.positive()),
            lambda: RangeNoise.proportional(self.positive()),
            lambda: RangeNoise.beam(
                z_hit=self.positive(1.0),
                z_short=self.positive(1.0),
                z_max=self.positive(1.0),
                z_rand=self.positive(1.0),
                sigma_hit=self.positive(1.0),
                lambda_short=self.positive(),
                max_range=self.positive(20.0),
            ),
        ]
        noise = self.rng.choice(noises)
        return RangeFinder(
            self.array(40, 2),
            self.positive(9.0),
            origin=self.triple(),
            mask=self.bits(),
            reflect_mask=self.bits() if self.rng.random() < 0.5 else 0,
            range_min=self.positive(1.0),
            no_hit=self.rng.choice(EXTREME),
            noise=noise(),
        )

    def do_overlaps(self) -> None:
        least_gap = self.rng.choice([0.0, self.number(-0.1, 0.1)])
        found = self.world.overlapping_bodies(
            self.some_bodies(), self.triple(), ignored=self.some_bodies(), least_gap=least_gap
        )
        ids = [body.id for body in found]
        self._require(ids == sorted(set(ids)), "returns bodies twice")
        self._require(set(ids) <= set(self.objects.fixtures), "overlaps nothing")

    def do_free_poses(self) -> None:
        poses = self.array(20, 3)
        free = self.world.free_poses(self.some_bodies(), poses, ignored=self.some_bodies())
        self._require(free.shape == (len(poses),), "returns a wrong shape")

    def do_free_discs(self) -> None:
        poses = self.array(20, 3)
        only = self.rng.choice([None, self.some_bodies()])
        free = self.world.free_discs(
            poses, self.positive(), self.bits(), ignored=self.some_bodies(), only=only
        )
        self._require(free.shape == (len(poses),), "returns a wrong shape")

    def do_boundaries(self) -> None:
        shape = self.rng.choice([(0, 0), (0, 3), (1, 1), (3, 5), (17, 66), (4,), (2, 2, 2)])
        generator = np.random.default_rng(self.rng.randrange(2**32))
        mask = generator.integers(0, 2, shape).astype(self.rng.choice([np.bool_, np.uint8]))
        self.finite("boundary", boundary_edges(mask, self.positive()))
        for loop in boundary_loops(mask):
            self._require(len(loop) >= 4, "returns an open loop")
            self._require(len(simplified_loop(loop, self.positive())) >= 1, "returns no loop")
        runs = generator.integers(-9, 9, (self.rng.randrange(5), 3))
        grown = dilated(mask, runs, outside=self.rng.random() < 0.5)
        regions = connected_regions(mask, diagonally=self.rng.random() < 0.5)
        for result in (grown, regions, distances_to_off(mask)):
            self._require(result.shape == mask.shape, "returns a wrong shape")
        pixels = [(self.rng.randrange(-1, 20), self.rng.randrange(-1, 70)) for _ in range(4)]
        if are_connected(mask, *pixels):
            self._require(bool(mask[pixels[0]] and mask[pixels[1]]), "connects an off pixel")

    def do_close(self) -> None:
        old = self.world
        old.close()
        old.close()
        for call in (
            lambda: old.create_body("static", (0, 0, 0)),
            lambda: old.step(0.01, 1, 1),
            lambda: self.body().pose,
            lambda: self.fixture().shape,
            lambda: self.joint().type,
        ):
            try:
                call()
            except StaleHandleError:
                continue
            raise CallError("a closed world can be used")
        self._start()


_WEIGHTS: Final = {
    "do_create_body": 8,
    "do_create_circle": 6,
    "do_create_polygon": 6,
    "do_create_edges": 3,
    "do_destroy_body": 3,
    "do_step": 30,
    "do_set_hook": 5,  # a copy has no hook
    "do_continue_with_a_copy": 1,
    "do_restore": 1,
    "do_boundaries": 1,
    "do_clear": 1,
    "do_close": 1,
}
