"""Contact hooks of plugins: recipients, order, arguments, and the changes of `pre_solve`."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import flatland
from flatland import Contact, ContactImpulse, ModelPlugin, MutableContact, WorldPlugin

DISC = "bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 10, friction: 1}]}]"
SLAB = """
bodies:
  - name: slab
    type: static
    footprints:
      - {type: polygon, density: 1, friction: 1, points: [[0, -9], [1, -9], [1, 9], [0, 9]]}
"""


class _Recorder:
    """Records the calls of contact hooks with their arguments."""

    calls: list[tuple[str, Contact, ContactImpulse | None]]

    def on_initialize(self, config: Any) -> None:
        self.calls = []

    def begin_contact(self, contact: Contact) -> None:
        self.calls.append(("begin", contact, None))

    def end_contact(self, contact: Contact) -> None:
        self.calls.append(("end", contact, None))

    def post_solve(self, contact: Contact, impulse: ContactImpulse) -> None:
        self.calls.append(("post_solve", contact, impulse))

    def hooks(self) -> list[str]:
        return [hook for hook, _, _ in self.calls]


class Recorder(_Recorder, ModelPlugin):
    pass


class WorldRecorder(_Recorder, WorldPlugin):
    pass


class Modifier(ModelPlugin):
    """Changes contacts in `pre_solve` as configured, and records its arguments."""

    def on_initialize(self, config: Any) -> None:
        self.change: dict[str, Any] = {}
        self.seen: list[Any] = []

    def pre_solve(self, contact: MutableContact, old_manifold: Any) -> None:
        mine = self.filter_contact(contact)
        self.seen.append((mine, contact.points, contact.normal, len(old_manifold.points)))
        for name, value in self.change.items():
            setattr(contact, name, value)
            assert getattr(contact, name) == value


@pytest.fixture
def bench(files: Any, declare_plugins: Any) -> Any:
    """Writes models with the plugins above and loads a world with a slab at x = 0.199."""
    declare_plugins(Recorder, WorldRecorder, Modifier)
    for name in ("Recorder", "Modifier"):
        files.write(f"{name}.yaml", f"{DISC}\nplugins: [{{name: p, type: 'test::{name}'}}]\n")
    files.write("disc.yaml", DISC)
    files.write("slab.yaml", SLAB)

    def load(models: str, plugins: str = "[]", layers: str = "[]") -> flatland.World:
        world: flatland.World = files.load(
            f"properties: {{}}\nlayers: {layers}\nmodels:\n{models}\nplugins: {plugins}\n"
        )
        return world

    return SimpleNamespace(load=load, files=files)


ROBOT = "  - {name: robot, model: Recorder.yaml}"
WALL = "  - {name: wall, model: slab.yaml, pose: [0.199, 0, 0]}"


def recorder(world: flatland.World, model: str = "robot") -> Any:
    return world.model(model).plugin("p")


def test_events_are_passed_in_order_with_the_points_of_their_time(bench: Any) -> None:
    world = bench.load(f"{ROBOT}\n{WALL}")
    base = world.model("robot").body("base")
    base.set_velocity(0.4, 0.3, 0.0)
    world.step()
    assert recorder(world).hooks() == ["begin", "post_solve"]
    (_, begun, _), (_, solved, impulse) = recorder(world).calls
    assert begun.contact_id == solved.contact_id
    assert {begun.body_a.name, begun.body_b.name} == {"base", "slab"}
    assert begun.points == pytest.approx(np.array([[0.2, 0.0]]), abs=0.01)
    outward = 1.0 if begun.body_a is base else -1.0
    assert begun.normal == pytest.approx(np.array([outward, 0.0]), abs=1e-4)
    assert begun.is_sensor is False
    # The full momentum along the normal; along the surface at most the friction.
    mass = base.mass
    assert impulse.normal_impulses == pytest.approx([0.4 * mass], rel=1e-3)
    assert abs(impulse.tangent_impulses[0]) == pytest.approx(0.1 * mass, rel=0.05)
    world.step()
    assert recorder(world).hooks()[2:] == ["post_solve"]
    world.move_model("robot", (-5, 0, 0))
    world.step()
    assert recorder(world).hooks()[3:] == ["end"]
    assert recorder(world).calls[3][1].contact_id == begun.contact_id


def test_end_contact_is_called_if_the_other_model_is_deleted(bench: Any) -> None:
    world = bench.load(f"{ROBOT}\n{WALL}")
    world.step()
    world.delete_model("wall")
    hook, contact, _ = recorder(world).calls[-1]
    assert hook == "end"
    # The names of the deleted model are still available.
    assert {contact.body_a.entity.name, contact.body_b.entity.name} == {"robot", "wall"}


def test_contacts_of_other_models_are_passed_to_world_plugins_and_on_request(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = bench.load(
        "  - {name: far, model: Recorder.yaml, pose: [50, 0, 0]}\n"
        f"  - {{name: disc, model: disc.yaml}}\n{WALL}",
        "[{name: p, type: 'test::WorldRecorder'}]",
    )
    world.step()
    [everywhere] = world.plugins
    assert everywhere.hooks() == ["begin", "post_solve"]
    assert recorder(world, "far").hooks() == []
    monkeypatch.setattr(type(recorder(world, "far")), "all_contacts", True)
    world.spawn_model("Recorder.yaml", "farther", pose=(90, 0, 0))
    world.step()
    assert recorder(world, "farther").hooks() == ["post_solve"]
    contact = recorder(world, "farther").calls[0][1]
    assert recorder(world, "farther").filter_contact(contact) is None


@pytest.mark.parametrize("side", ["a", "b"])
def test_filter_contact_returns_the_perspective_of_the_model(bench: Any, side: str) -> None:
    # In Box2D, polygons precede circles.
    robot_is_a = side == "a"
    if robot_is_a:
        square = DISC.replace("circle, radius: 0.2", "polygon, points: [[-1, -1], [1, -1], [0, 1]]")
        bench.files.write(
            "Recorder.yaml", f"{square}\nplugins: [{{name: p, type: 'test::Recorder'}}]\n"
        )
        other = "  - {name: wall, model: disc.yaml, pose: [0, -1.15, 0]}"
    else:
        other = WALL
    world = bench.load(f"{ROBOT}\n{other}")
    world.step()
    contact = recorder(world).calls[0][1]
    mine = recorder(world).filter_contact(contact)
    base, theirs = world.model("robot").bodies[0], world.model("wall").bodies[0]
    assert (mine.other_entity, mine.is_a) == (world.model("wall"), robot_is_a)
    assert (mine.this_body, mine.other_body) == (base, theirs)
    assert (mine.this_fixture, mine.other_fixture) == (base.fixtures[0], theirs.fixtures[0])
    assert (contact.body_a is base) is robot_is_a


def test_the_other_entity_can_be_a_layer_with_its_first_name(bench: Any) -> None:
    path = bench.files.write_map("room", ["...", ".#.", "..."], origin="[0.2, -1.5, 0]")
    world = bench.load(
        "  - {name: robot, model: Recorder.yaml, pose: [1.01, 0, 0]}",
        layers=f"[{{name: [walls, floor], map: {path}}}]",
    )
    world.step()
    mine = recorder(world).filter_contact(recorder(world).calls[0][1])
    assert mine.other_entity is world.layer("floor")
    assert mine.other_entity.name == "walls"
    assert mine.other_fixture.shape == "edge"


def test_sensors_cause_begin_and_end_but_no_post_solve(bench: Any) -> None:
    bench.files.write("disc.yaml", DISC.replace("density: 10", "density: 10, sensor: true"))
    world = bench.load(f"{ROBOT}\n  - {{name: pad, model: disc.yaml, pose: [0.3, 0, 0]}}")
    world.step(2)
    world.move_model("pad", (5, 0, 0))
    world.step()
    assert recorder(world).hooks() == ["begin", "end"]
    contact = recorder(world).calls[0][1]
    assert contact.is_sensor is True
    assert contact.points.shape == (0, 2)


class TestPreSolve:
    """A disc with a plugin is pushed against the slab and along it."""

    def push(
        self, bench: Any, velocity: tuple[float, float, float] = (0.4, 0.1, 0.0), **change: Any
    ) -> Any:
        """Returns the world, the plugin and the velocity after a step."""
        world = bench.load(f"  - {{name: robot, model: Modifier.yaml}}\n{WALL}")
        plugin, body = recorder(world), world.model("robot").body("base")
        plugin.change = change
        body.set_velocity(*velocity)
        world.step()
        assert plugin.seen
        return world, plugin, body.velocity

    def test_pre_solve_receives_the_contact(self, bench: Any) -> None:
        world, plugin, _ = self.push(bench)
        mine, points, normal, old_points = plugin.seen[0]
        assert mine.other_entity is world.model("wall")
        assert points == pytest.approx(np.array([[0.2, 0.0]]), abs=0.01)
        outward = 1.0 if mine.is_a else -1.0
        assert normal == pytest.approx(np.array([outward, 0.0]), abs=1e-4)
        assert old_points == 0
        world.step()
        assert plugin.seen[-1][3] == 1

    def test_unchanged_contacts_stop_the_disc_with_friction(self, bench: Any) -> None:
        _, _, (vx, vy, omega) = self.push(bench)
        assert vx == pytest.approx(0.0, abs=1e-4)
        assert vy < 0.09
        assert omega != 0

    def test_a_contact_is_disabled_for_one_step(self, bench: Any) -> None:
        world, plugin, velocity = self.push(bench, enabled=False)
        assert velocity == pytest.approx((0.4, 0.1, 0.0), abs=1e-5)
        plugin.change = {}
        world.step()
        assert world.model("robot").body("base").velocity[0] == pytest.approx(0.0, abs=1e-4)

    def test_without_friction_the_disc_slides(self, bench: Any) -> None:
        assert self.push(bench, friction=0.0)[2] == pytest.approx((0, 0.1, 0), abs=1e-4)

    def test_restitution(self, bench: Any) -> None:
        # Box2D applies restitution only above 1 m/s.
        _, _, velocity = self.push(bench, (4.0, 0.0, 0.0), restitution=0.5)
        assert velocity[0] == pytest.approx(-2.0, rel=1e-2)

    def test_tangent_speed_moves_the_disc_like_a_belt(self, bench: Any) -> None:
        without, along, back = (
            self.push(bench, tangent_speed=speed)[2][1] for speed in (0.0, 1.5, -1.5)
        )
        assert abs(along - without) > 0.05
        assert (along - without) * (back - without) < 0


def test_pre_solve_is_not_called_without_plugins_that_override_it(bench: Any) -> None:
    world = bench.load(f"{ROBOT}\n{WALL}")
    world.step()
    assert world.physics.pre_solve is None
    world.spawn_model("Modifier.yaml", "hand", pose=(40, 0, 0))
    world.step()
    assert world.physics.pre_solve is not None
    world.delete_model("hand")
    world.step()
    assert world.physics.pre_solve is None
