"""The services and the action of `simulation_interfaces`, with their result codes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Pose, PoseStamped, Quaternion, Twist, Vector3
from rclpy.action import ActionClient
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import (
    Bounds,
    EntityCategory,
    EntityFilters,
    EntityState,
    Result,
    SimulationState,
    SimulatorFeatures,
    TagsFilter,
)
from simulation_interfaces.srv import (
    DeleteEntity,
    GetEntities,
    GetEntitiesStates,
    GetEntityBounds,
    GetEntityInfo,
    GetEntityState,
    GetSimulationState,
    GetSimulatorFeatures,
    GetSpawnables,
    ResetSimulation,
    SetEntityState,
    SetSimulationState,
    SpawnEntity,
    StepSimulation,
)
from waiting import TIMEOUT

MODELS = """
  - {name: robot, model: robot.model.yaml, pose: [1, 2, 0]}
  - {name: box1, model: box.model.yaml, pose: [-2, 0, 1.5707963267948966]}
  - {name: pillar, model: pillar.model.yaml, pose: [3, -3, 0]}
"""
BOX = """
bodies: [{name: base, footprints:
  [{type: polygon, points: [[0, -0.1], [1, -0.1], [1, 0.1], [0, 0.1]], density: 1}]}]
"""
PILLAR = """
class: column
bodies: [{name: base, type: static, footprints: [{type: circle, radius: 0.3, density: 0}]}]
"""
PAUSED, PLAYING, STOPPED = (
    SimulationState(state=state)
    for state in (
        SimulationState.STATE_PAUSED,
        SimulationState.STATE_PLAYING,
        SimulationState.STATE_STOPPED,
    )
)


@pytest.fixture(scope="module", autouse=True)
def server(module_ros: Any, module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    world = write_world(MODELS, box=BOX, pillar=PILLAR)
    return module_launcher.server(module_ros, world, seed=1)


@pytest.fixture(autouse=True)
def fresh_world(ros: Any) -> None:
    """A paused world as after loading."""
    ros.call("/set_simulation_state", SetSimulationState, state=PLAYING)
    assert ros.call("/set_simulation_state", SetSimulationState, state=STOPPED).result.result == 1


def ok(answer: Any) -> Any:
    assert answer.result.result == Result.RESULT_OK, answer.result.error_message
    return answer


def failure(answer: Any) -> tuple[int, str]:
    return answer.result.result, answer.result.error_message


def time_ns(ros: Any) -> int:
    state = ok(ros.call("/get_entity_state", GetEntityState, entity="robot")).state
    return int(state.header.stamp.sec * 10**9 + state.header.stamp.nanosec)


def test_features_are_those_that_are_tested_here(ros: Any) -> None:
    features = ros.call("/get_simulator_features", GetSimulatorFeatures).features
    assert SimulatorFeatures.STEP_SIMULATION_ACTION in features.features
    assert SimulatorFeatures.WORLD_LOADING not in features.features
    assert features.spawn_formats == ["yaml", "yml"]


def test_states_of_the_simulation(ros: Any) -> None:
    def state() -> int:
        return int(ok(ros.call("/get_simulation_state", GetSimulationState)).state.state)

    def change(target: SimulationState) -> int:
        return int(
            ros.call("/set_simulation_state", SetSimulationState, state=target).result.result
        )

    assert state() == STOPPED.state
    assert change(STOPPED) == SetSimulationState.Response.ALREADY_IN_TARGET_STATE
    assert change(PAUSED) == Result.RESULT_OK
    assert state() == PAUSED.state
    assert change(PLAYING) == Result.RESULT_OK
    assert state() == PLAYING.state
    assert change(SimulationState(state=4)) == SetSimulationState.Response.INCORRECT_TRANSITION
    code, text = failure(ros.call("/step_simulation", StepSimulation, steps=1))
    assert (code, text) == (Result.RESULT_OPERATION_FAILED, "the simulation is not paused")
    assert change(STOPPED) == Result.RESULT_OK
    assert time_ns(ros) == 0


def test_steps(ros: Any) -> None:
    ok(ros.call("/step_simulation", StepSimulation))
    assert time_ns(ros) == 5_000_000
    ok(ros.call("/step_simulation", StepSimulation, steps=19))
    assert time_ns(ros) == 100_000_000
    code, text = failure(ros.call("/step_simulation", StepSimulation, steps=10**9))
    assert code == Result.RESULT_OPERATION_FAILED
    assert "at most 720000" in text


def run_action(ros: Any, steps: int, cancel_after: int = 0) -> tuple[Any, list[int]]:
    """Returns the result of the action, and the numbers of completed steps of the feedback."""
    client = ros.run(lambda: ActionClient(ros.node, SimulateSteps, "/simulate_steps"))
    assert client.wait_for_server(TIMEOUT)
    completed: list[int] = []
    enough = threading.Event()

    def report(message: Any) -> None:
        completed.append(message.feedback.completed_steps)
        if len(completed) == cancel_after:
            enough.set()

    def wait_for(future: Any) -> Any:
        done = threading.Event()
        future.add_done_callback(lambda _future: done.set())
        assert done.wait(TIMEOUT)
        return future.result()

    goal = wait_for(client.send_goal_async(SimulateSteps.Goal(steps=steps), report))
    assert goal.accepted
    if cancel_after:
        assert enough.wait(TIMEOUT)
        goal.cancel_goal_async()
    result = wait_for(goal.get_result_async())
    ros.run(client.destroy)
    return result.result.result, completed


def test_action(ros: Any) -> None:
    result, completed = run_action(ros, 10)
    assert result.result == Result.RESULT_OK, result.error_message
    assert completed == sorted(completed)
    assert time_ns(ros) == 50_000_000
    result, _ = run_action(ros, 100_000, cancel_after=5)
    assert result.error_message.startswith("cancelled after ")
    ok(ros.call("/set_simulation_state", SetSimulationState, state=PLAYING))
    result, completed = run_action(ros, 1)
    assert (result.result, completed) == (Result.RESULT_OPERATION_FAILED, [])


def spawn(ros: Any, **fields: Any) -> Any:
    return ros.call("/spawn_entity", SpawnEntity, **fields)


def test_spawning(ros: Any) -> None:
    pose = PoseStamped()
    pose.pose.position.x, pose.pose.position.y = -3.0, 3.0
    pose.pose.orientation = Quaternion(z=1.0, w=0.0)
    answer = ok(spawn(ros, name="b", uri="ball.model.yaml", initial_pose=pose))
    assert answer.entity_name == "b"
    state = ok(ros.call("/get_entity_state", GetEntityState, entity="b")).state
    assert (state.header.frame_id, state.pose.position.x, state.pose.position.y) == ("map", -3, 3)
    assert abs(state.pose.orientation.z) == pytest.approx(1.0)
    text = "bodies: [{name: base, footprints: []}]"
    assert ok(spawn(ros, name="b", allow_renaming=True, resource_string=text)).entity_name == "b_2"
    [uri] = [
        each.uri
        for each in ok(ros.call("/get_spawnables", GetSpawnables)).spawnables
        if each.uri.endswith("ball.model.yaml")
    ]
    assert ok(spawn(ros, allow_renaming=True, uri=f"file://{uri}")).entity_name == "ball"
    ok(ros.call("/delete_entity", DeleteEntity, entity="b"))
    code, text = failure(ros.call("/delete_entity", DeleteEntity, entity="b"))
    assert code == Result.RESULT_NOT_FOUND
    assert text == 'there is no entity "b" (hint: entities: robot, box1, pillar, b_2, ball)'


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"name": "robot", "uri": "ball.model.yaml"}, "NAME_NOT_UNIQUE"),
        ({"uri": "ball.model.yaml"}, "NAME_INVALID"),
        ({"name": "n", "uri": "robot.urdf"}, "UNSUPPORTED_FORMAT"),
        ({"name": "n", "resource_string": "<robot/>"}, "UNSUPPORTED_FORMAT"),
        ({"name": "n"}, "NO_RESOURCE"),
        ({"name": "n", "uri": "ball.model.yaml", "entity_namespace": "a b"}, "NAMESPACE_INVALID"),
        ({"name": "n", "resource_string": "bodies: 3"}, "RESOURCE_PARSE_ERROR"),
        (
            {
                "name": "n",
                "uri": "ball.model.yaml",
                "initial_pose": PoseStamped(pose=Pose(orientation=Quaternion(w=0.0))),
            },
            "INVALID_POSE",
        ),
    ],
)
def test_refused_spawns(ros: Any, fields: dict[str, Any], code: str) -> None:
    answer = spawn(ros, **fields)
    assert answer.result.result == getattr(SpawnEntity.Response, code), answer
    assert answer.result.error_message
    assert answer.entity_name == ""


def test_a_missing_file_is_not_found(ros: Any) -> None:
    code, text = failure(spawn(ros, name="n", uri="no.model.yaml"))
    assert code == Result.RESULT_NOT_FOUND
    assert "no.model.yaml" in text


@pytest.mark.parametrize(
    ("filters", "expected"),
    [
        ({}, ["robot", "box1", "pillar"]),
        ({"filter": "^box[0-9]$"}, ["box1"]),
        ({"categories": [EntityCategory(category=EntityCategory.CATEGORY_ROBOT)]}, ["robot"]),
        (
            {"categories": [EntityCategory(category=EntityCategory.CATEGORY_STATIC_OBJECT)]},
            ["pillar"],
        ),
        ({"tags": TagsFilter(tags=["column", "box"])}, ["box1", "pillar"]),
        ({"tags": TagsFilter(tags=["column", "box"], filter_mode=1)}, []),
        (
            {"bounds": Bounds(type=Bounds.TYPE_SPHERE, points=[Vector3(), Vector3(x=2.0)])},
            ["robot", "box1"],
        ),
        (
            {
                "bounds": Bounds(
                    type=Bounds.TYPE_BOX, points=[Vector3(x=4.0), Vector3(x=2.0, y=-4.0)]
                )
            },
            ["pillar"],
        ),
    ],
)
def test_filters(ros: Any, filters: dict[str, Any], expected: list[str]) -> None:
    given = EntityFilters(**filters)
    assert ok(ros.call("/get_entities", GetEntities, filters=given)).entities == expected
    answer = ok(ros.call("/get_entities_states", GetEntitiesStates, filters=given))
    assert answer.entities == expected
    assert len(answer.states) == len(expected)


def test_refused_filters(ros: Any) -> None:
    hull = EntityFilters(bounds=Bounds(type=Bounds.TYPE_CONVEX_HULL))
    code, _ = failure(ros.call("/get_entities", GetEntities, filters=hull))
    assert code == Result.RESULT_FEATURE_UNSUPPORTED
    code, text = failure(ros.call("/get_entities", GetEntities, filters=EntityFilters(filter="(")))
    assert code == Result.RESULT_OPERATION_FAILED
    assert 'invalid regular expression "("' in text


def test_information_and_bounds(ros: Any) -> None:
    info = ok(ros.call("/get_entity_info", GetEntityInfo, entity="pillar")).info
    assert info.category.category == EntityCategory.CATEGORY_STATIC_OBJECT
    assert info.tags == ["column"]
    assert info.description.endswith("/pillar.model.yaml")
    # In the frame of the entity, which is turned in the world.
    bounds = ok(ros.call("/get_entity_bounds", GetEntityBounds, entity="box1")).bounds
    upper, lower = bounds.points
    assert (upper.x, upper.y) == pytest.approx((1.0, 0.1), abs=0.02)
    assert (lower.x, lower.y) == pytest.approx((0.0, -0.1), abs=0.02)


def test_setting_the_state_of_an_entity(ros: Any) -> None:
    state = EntityState()
    state.pose.position.x = -1.0
    ok(ros.call("/set_entity_state", SetEntityState, entity="robot", state=state))
    got = ok(ros.call("/get_entity_state", GetEntityState, entity="robot")).state
    assert got.pose.position.x == -1.0
    state.header.frame_id = "base"
    code, text = failure(ros.call("/set_entity_state", SetEntityState, entity="robot", state=state))
    assert code == SetEntityState.Response.INVALID_POSE
    assert '"base"' in text
    moving = EntityState(twist=Twist(linear=Vector3(x=1.0)))
    code, _ = failure(ros.call("/set_entity_state", SetEntityState, entity="robot", state=moving))
    assert code == Result.RESULT_FEATURE_UNSUPPORTED


def test_scopes_of_a_reset(ros: Any) -> None:
    def reset(scope: int) -> int:
        return int(ros.call("/reset_simulation", ResetSimulation, scope=scope).result.result)

    def names() -> list[str]:
        return list(ros.call("/get_entities", GetEntities).entities)

    ok(ros.call("/step_simulation", StepSimulation, steps=10))
    ok(spawn(ros, name="extra", uri="ball.model.yaml"))
    assert reset(ResetSimulation.Request.SCOPE_SPAWNED) == Result.RESULT_OK
    assert names() == ["robot", "box1", "pillar"]
    assert time_ns(ros) == 50_000_000
    assert reset(ResetSimulation.Request.SCOPE_TIME) == Result.RESULT_FEATURE_UNSUPPORTED
    both = ResetSimulation.Request.SCOPE_STATE | ResetSimulation.Request.SCOPE_SPAWNED
    assert reset(both) == Result.RESULT_OK
    assert time_ns(ros) == 50_000_000
    assert reset(ResetSimulation.Request.SCOPE_DEFAULT) == Result.RESULT_OK
    assert time_ns(ros) == 0
