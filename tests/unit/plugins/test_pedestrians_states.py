"""Requests, states, outputs and parameters of the plugin Pedestrians."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rooms_with_people import CALM, ONE, load, people_of

from flatland import WorldObserver
from flatland.errors import PluginError, WorldError
from flatland.recording import Replay
from flatland.runtime.batch import step_worlds
from tests.unit.conftest import WorldFiles

CROWD = (
    "[{name: a, count: 6, stops: {every: 10, time: [1, 2]}},"
    " {name: b, count: 4, together: 2, waypoints: [{at: [2, 2], wait: [1, 2]}, {at: [8, 4]}],"
    " order: random}, {name: c, count: 2, waypoints: [{at: [5, 3], queue: true, wait: [1, 2]},"
    " {at: [8, 2]}]}]"
)
FULL = "layers: [body], legs: {layers: [2d]}, "


@pytest.mark.parametrize("options", [FULL, FULL + "model: orca, ", FULL + "body_type: dynamic, "])
def test_runs_with_one_seed_are_equal(files: WorldFiles, options: str) -> None:
    hashes = []
    for seed, listens in ((1, False), (1, True), (2, False)):
        world = load(files, CROWD, options, seed=seed)
        if listens:
            world.output("/people")
            world.output("/people/states")
        world.step(700)
        if listens:
            for _ in range(300):
                world.step()
        else:
            world.step(300)
        hashes.append(world.state_hash())
    assert hashes[0] == hashes[1] != hashes[2]


def test_social_forces_may_be_zero(files: WorldFiles) -> None:
    forces = "strength: 0, look_ahead: 0, relative: 0, behind: 0, wall_strength: 0, gaze: 0"
    world = load(files, CROWD, f"social_force: {{{forces}, cohesion: 0, spacing: 0}}, ")
    world.step(50)
    assert len(people_of(world).people.names) == 12


def test_services_spawn_direct_and_remove_people(files: WorldFiles) -> None:
    services: dict[str, Callable[[Any], Any]] = {}

    class Bridge(WorldObserver):
        def plugin_ros(self, plugin: Any) -> Any:
            def advertise(name: str, _kind: str, serve: Callable[[Any], Any]) -> None:
                services[name] = serve

            return SimpleNamespace(advertise_service=advertise, close=lambda: None)

    world = load(files, ONE % "[7, 2]", CALM, observers=[Bridge()])
    poses = [SimpleNamespace(x=float(x), y=2.0, theta=0.0) for x in (2, 4)]
    spawned = services["spawn_people"](SimpleNamespace(group="", count=0, poses=poses))
    assert spawned == (True, "", ["a_0", "a_1"])
    unknown = services["spawn_people"](SimpleNamespace(group="nobody", count=1, poses=[]))
    assert (unknown[0], unknown[2]) == (False, [])
    assert "nobody" in unknown[1]
    stop = SimpleNamespace(names=["a_1"], action=0, STOP=0, RESUME=1, SEND=2)
    assert services["direct_people"](stop) == (True, "")
    world.step(200)
    assert people_of(world).people.poses[:, 0] == pytest.approx([2.9, 4.0], abs=0.2)
    assert services["remove_people"](SimpleNamespace(names=["a_0"])) == (True, "")
    assert people_of(world).people.names == ("a_1",)
    assert people_of(world).spawn() == ["a_2"]


@pytest.mark.parametrize("options", [FULL, FULL + "body_type: dynamic, "])
def test_snapshots_clones_and_resets_repeat_the_run(files: WorldFiles, options: str) -> None:
    world = load(files, CROWD, options)
    start = world.state_hash()
    world.step(333)
    snapshot = world.snapshot()
    with world.clone() as clone:
        world.step(700)
        later = world.state_hash()
        clone.step(700)
        assert clone.state_hash() == later
        assert people_of(clone).people.names == people_of(world).people.names
    people_of(world).spawn("a", 1)
    people_of(world).remove(["b_0"])
    world.step(50)
    world.restore(snapshot)
    assert "b_0" in people_of(world).people.names
    world.step(700)
    assert world.state_hash() == later
    world.reset()
    assert world.state_hash() == start


def test_worlds_that_compute_ways_together_have_the_results_of_single_ones(
    files: WorldFiles,
) -> None:
    world = load(files, CROWD, FULL)
    start = world.snapshot()
    # No way beyond those of the start has been computed, and all threads need the same ones.
    clones = [world.clone() for _ in range(6)]
    step_worlds(clones, 600, num_threads=6)
    world.step(600)
    expected = world.state_hash()
    assert {clone.state_hash() for clone in clones} == {expected}
    world.restore(start)  # The ways that were computed since remain valid.
    world.step(600)
    assert world.state_hash() == expected
    for clone in clones:
        clone.close()


def test_reseeding_decides_all_further_random_numbers(files: WorldFiles) -> None:
    world = load(files, CROWD, FULL)
    world.step(100)
    snapshot = world.snapshot()
    hashes = []
    for seed in (1, 1, 2):
        world.restore(snapshot)
        people_of(world).reseed(np.random.default_rng(seed))
        people_of(world).spawn("a", 2)
        world.step(300)
        hashes.append(world.state_hash())
    assert hashes[0] == hashes[1] != hashes[2]


@pytest.mark.parametrize("options", [FULL, FULL + "model: orca, ", FULL + "body_type: dynamic, "])
def test_the_places_of_an_episode_are_drawn_by_its_seed(files: WorldFiles, options: str) -> None:
    world = load(files, CROWD, options)
    world.step(100)
    snapshot = world.snapshot()
    before = world.state_hash()
    starts, ends = [], []
    for seed in (1, 2, 1):
        world.restore(snapshot)
        assert world.state_hash() == before
        world.randomize(seed)
        starts.append(people_of(world).people.poses)
        assert not people_of(world).people.velocities.any()
        world.step(300)
        ends.append(world.state_hash())
    assert ends[0] == ends[2] != ends[1]
    assert starts[0].tobytes() == starts[2].tobytes()
    assert (np.abs(starts[0] - starts[1]).max(axis=1) > 0).all()


def test_drawn_places_are_free_and_together(files: WorldFiles) -> None:
    groups = (
        "[{name: a, count: 6, together: 3}, {name: b, count: 4, area: [0, 0, 4, 5]},"
        " {name: c, count: 0}]"
    )
    world = load(files, groups, "layers: [body], legs: {layers: [2d]}, ")
    people = people_of(world)
    people.spawn("c", poses=[(5.0, 3.0, 0.0)])
    for seed in range(40):
        world.randomize(seed)
        poses = people.people.poses
        distances = np.hypot(*(poses[:, None, :2] - poses[None, :, :2]).transpose(2, 0, 1))
        np.fill_diagonal(distances, np.inf)
        assert distances.min() >= 0.44 - 1e-6
        assert all(world.is_free(tuple(p), radius=0.2, ignore=world.models) for p in poses)
        assert (poses[6:10, :2] <= [4, 5]).all()
        assert tuple(poses[10]) == (5.0, 3.0, 0.0)  # The pose was given, not drawn.
        # The other members of the first party are the people who are nearest to its first one.
        to_first = np.hypot(*(poses[1:6, :2] - poses[0, :2]).T)
        assert to_first[:2].max() <= to_first[2:].min()
        for name in people.people.names[:10]:
            model = world.model(name)
            body = np.array(model.body("body").pose)
            for leg, side in (("left_leg", 0.1), ("right_leg", -0.1)):
                x, y, theta = model.body(leg).pose
                offset = side * np.array([-math.sin(body[2]), math.cos(body[2])])
                assert [x, y, theta] == pytest.approx([*(body[:2] + offset), body[2]], abs=1e-5)


def test_people_begin_their_routes_again(files: WorldFiles) -> None:
    groups = (
        "[{name: a, count: 3, speed_deviation: 0, order: once,"
        " waypoints: [{at: [2, 2]}, {at: [8, 4], queue: true, wait: [1, 2]}]}]"
    )
    world = load(files, groups, CALM)
    snapshot = world.snapshot()
    world.step(4000)
    world.randomize(1)
    # Nothing remains of what the people did before.
    assert not people_of(world).people.standing.any()
    world.restore(snapshot)
    world.step(4000)
    assert people_of(world).people.standing.any()


def test_people_keep_their_places_without_redraw(files: WorldFiles) -> None:
    world = load(files, CROWD, FULL + "redraw: false, ")
    before = people_of(world).people.poses
    world.randomize(1)
    assert people_of(world).people.poses.tobytes() == before.tobytes()
    one = world.state_hash()
    world.randomize(2)
    assert world.state_hash() != one  # Their random numbers are new.


def test_too_few_places_are_an_error(files: WorldFiles) -> None:
    world = load(files, "[{name: a, count: 1, area: [1.2, 1.2, 2.5, 2.5]}]")
    box = (
        "bodies: [{name: box, footprints: [{type: polygon, density: 1, points:"
        " [[-3, -3], [3, -3], [3, 3], [-3, 3]]}]}]\n"
    )
    files.write("box.model.yaml", box)
    world.spawn_model("box.model.yaml", "box", pose=(2, 2, 0), if_blocked="allow")
    with pytest.raises(WorldError, match=r'plugin "people": no free place for "a_0" of group "a"'):
        world.randomize(1)
    with pytest.raises(ValueError, match="seed must be an integer of at least 0, got -1"):
        world.randomize(-1)


def test_a_recording_repeats_drawn_spawned_and_directed_people(
    files: WorldFiles, tmp_path: Path
) -> None:
    world = load(files, CROWD, FULL)
    recorder = world.record(tmp_path / "run.log")
    people = people_of(world)
    world.step(50)
    world.randomize(7)
    world.step(50)
    names = people.spawn("b", 2)
    people.send(names[:1], (8.0, 3.0))
    people.stop(["a_1"])
    world.step(100)
    people.remove(["a_0", names[1]])
    people.resume()
    world.move_model("a_2", (5.0, 4.0, 0.0))
    world.delete_model("a_3")
    world.step(250)
    recorder.close()
    replay = Replay(tmp_path / "run.log")
    assert replay.run() is None
    assert people_of(replay.world).people.names == people_of(world).people.names
    assert replay.world.state_hash() == world.state_hash()
    replay.close()


def test_people_are_sent_stopped_and_resumed(files: WorldFiles) -> None:
    world = load(files, ONE % "[8, 2]", CALM)
    people = people_of(world)
    [name] = people.spawn(poses=[(2.0, 2.0, 0.0)])
    people.send([name], (2.0, 4.0))
    world.step(1000)
    assert people.people.poses[0, :2] == pytest.approx((2.0, 4.0), abs=0.35)
    assert people.people.standing[0]
    people.resume()
    world.step(200)
    assert not people.people.standing[0]
    people.stop()
    world.step(600)
    before = people.people.poses[0, :2]
    world.step(200)
    assert people.people.poses[0, :2] == pytest.approx(before, abs=0.01)


def test_pause_drag_and_deletion_of_people(files: WorldFiles) -> None:
    world = load(files, CROWD, FULL)
    people = people_of(world)
    world.step(100)
    before = world.state_hash()
    world.pause()
    world.step(100)
    assert world.state_hash() == before
    world.resume()
    world.move_model("a_0", (3.0, 3.0, 0.0), if_blocked="allow")
    world.step(10)
    index = people.people.names.index("a_0")
    assert people.people.poses[index, :2] == pytest.approx((3.0, 3.0), abs=0.3)
    world.delete_model("a_0")
    world.step(10)
    assert "a_0" not in people.people.names
    people.remove()
    world.step(10)
    assert people.people.names == ()
    assert people.spawn("a", 2) == ["a_6", "a_7"]


def test_people_who_are_removed_leave_nothing_in_the_state(files: WorldFiles) -> None:
    groups = (
        "[{name: a, count: 0}, {name: b, count: 0, together: 2, waypoints: [{at: [2, 2]},"
        " {at: [8, 4], queue: true, wait: [1, 2]}]}]"
    )
    world = load(files, groups)
    people = people_of(world)
    numbers: Any = people.state()
    for _ in range(5):
        people.remove(people.spawn("a", 3) + people.spawn("b", 3))
        world.step(25)
        people.spawn("b", 2)
        world.step(25)
        world.delete_models(people.people.names)
    now: Any = people.state()
    assert len(now[0]) == len(numbers[0])


def test_the_end_of_a_party_does_not_affect_the_next_one(files: WorldFiles) -> None:
    groups = (
        "[{name: a, count: 6, together: 3, waypoints:"
        " [{at: [2, 2], wait: [0.1, 2]}, {at: [8, 4], wait: [0.1, 2]}], order: random}]"
    )
    worlds = [load(files, groups, FULL) for _ in range(2)]
    for world, order in zip(worlds, (1, -1), strict=True):
        people = people_of(world)
        first_party, rest = people.people.names[:3], people.people.names[3:]
        world.step(100)
        people.remove(first_party[::order])
        world.step(2000)
        assert people.people.names == rest
    assert worlds[0].state_hash() == worlds[1].state_hash()
    poses = people.people.poses[:, :2]
    assert np.hypot(*(poses - poses.mean(axis=0)).T).max() < 2.0


def test_the_names_of_new_people_are_not_those_of_models(files: WorldFiles) -> None:
    world = load(files, CROWD)
    world.spawn_model("minimal.model.yaml", "a_7", pose=(5.0, 3.0, 0.0), if_blocked="allow")
    people = people_of(world)
    assert people.spawn("a", 2) == ["a_6", "a_8"]
    assert people.spawn("a", 1) == ["a_9"]


def test_the_outputs_carry_the_people(files: WorldFiles) -> None:
    world = load(files, CROWD, "pub_rate: 5, ")
    output, states = world.output("/people"), world.output("/people/states")
    times: list[int] = []
    output.subscribe(lambda value: times.append(value.stamp))
    world.step(200)
    assert times == [200_000_000 * k for k in range(1, 6)]
    assert output.latest is not None
    assert states.latest is not None
    assert output.latest.frame_id == "map"
    assert output.latest.names == people_of(world).people.names
    assert output.latest.poses.shape == (12, 3)
    assert states.latest.groups == ("a",) * 6 + ("b",) * 4 + ("c",) * 2
    assert states.latest.velocities.shape == (12, 3)


def test_the_markers_name_people_who_were_removed(files: WorldFiles) -> None:
    world = load(files, "[{name: a, count: 3, color: [1, 0, 0, 1]}]")
    world.step()
    markers = world.output("/people/markers")
    world.step(100)
    first = markers.latest
    assert first is not None
    assert first.names == ("a_0", "a_1", "a_2")
    assert first.group_names == ("a",)
    assert first.colors == ((1.0, 0.0, 0.0, 1.0),)
    assert len(set(first.ids)) == 3
    people_of(world).remove(["a_1"])
    world.step(100)
    assert markers.latest is not None
    assert markers.latest.names == ("a_0", "a_2")
    assert set(markers.latest.ids) < set(first.ids)


def test_failed_requests_change_nothing(files: WorldFiles) -> None:
    world = load(files, CROWD)
    people = people_of(world)
    before = world.state_hash()
    for request, text in (
        (lambda: people.spawn("x"), 'group "x" does not exist; groups: a, b, c'),
        (lambda: people.spawn("a", 200), "free places"),
        (lambda: people.remove(["a_0", "nobody"]), 'there is no person "nobody"'),
        (lambda: people.send(["a_0"], (100.0, 100.0)), "there is no way for"),
        (lambda: people.spawn("a", poses=[(2, 2, 0), (math.nan, 0, 0)]), "finite"),
    ):
        with pytest.raises((WorldError, ValueError), match=text):
            request()
        assert world.state_hash() == before
    with pytest.raises(WorldError, match="does not exist"):
        world.call_plugin(people, "on_shutdown", {})


def test_more_people_than_places_are_an_error(files: WorldFiles) -> None:
    with pytest.raises(PluginError, match=r'group "a": found only .* \[.*world\.yaml:'):
        load(files, "[{name: a, count: 900}]")


def test_people_without_walls_require_an_area(files: WorldFiles) -> None:
    text = (
        "properties: {}\nlayers: [{name: 2d}]\n"
        "plugins: [{name: people, type: Pedestrians, groups: [{name: a, count: 2%s}]}]"
    )
    with pytest.raises(PluginError, match='group "a": "area" is required, because the layers'):
        files.load(text % "")
    assert len(files.load(text % ", area: [0, 0, 9, 9]").models) == 2
