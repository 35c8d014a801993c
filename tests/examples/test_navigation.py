"""The package flatland_navigation: what can be tested without amcl, SLAM nodes and move_base."""

from __future__ import annotations

import json
import math
import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest
import yaml
from programs import output_of, run_program

import flatland
from flatland.scenarios.scenario import Run
from flatland.scenarios.stage import prepare
from flatland.scenarios.suite import load_suite, scenario_files

NODES = {
    "navigation.launch": {"/flatland_server", "/rviz", "/amcl", "/move_base"},
    "navigation.launch simulator:=false": {"/amcl", "/move_base"},
    "localization.launch": {"/flatland_server", "/rviz", "/amcl"},
    "localization.launch map:=/a.yaml rviz:=false": {"/flatland_server", "/map_server", "/amcl"},
    "localization.launch map:=none simulator:=false": {"/amcl"},
    "stack.launch": {"/move_base"},
    "stack.launch amcl:=true": {"/amcl", "/move_base"},
    "mapping.launch": {"/flatland_server", "/rviz", "/gmapping", "/move_base"},
    "mapping.launch slam:=hector move_base:=false": {
        "/flatland_server",
        "/rviz",
        "/hector_mapping",
    },
}
# Reads launch files with arguments, and prints the parameters and the nodes with their remappings.
RESOLVE = dedent(
    """
    import json, sys, roslaunch.config, roslaunch.xmlloader
    result = []
    for path, *arguments in json.load(sys.stdin):
        config = roslaunch.config.ROSLaunchConfig()
        roslaunch.xmlloader.XmlLoader().load(path, config, argv=arguments, verbose=False)
        nodes = {node.namespace + node.name: dict(node.remap_args) for node in config.nodes}
        result.append(({name: param.value for name, param in config.params.items()}, nodes))
    print("JSON" + json.dumps(result))
    """
)
# Values of launch arguments.
TOPICS = {
    "scan": "lidar",
    "odom": "wheels",
    "cmd_vel": "velocity",
    "map_topic": "/floor_plan",
    "map_frame": "building",
    "odom_frame": "r1_odom",
    "base_frame": "r1_base",
}
ALL_NODES = ["navigation.launch", "mapping.launch", "mapping.launch slam:=hector"]
WITH_TOPICS = " ".join(f"{key}:={value}" for key, value in TOPICS.items())
DEFAULTS = ["odom", "base_link", "odometry/filtered"]


@pytest.fixture(scope="module")
def package(checkout: Path) -> Path:
    return checkout / "examples" / "navigation"


@pytest.fixture
def shell(ros_environment: dict[str, str], package: Path) -> dict[str, str]:
    """The environment of the README: the folder of the package is on ROS_PACKAGE_PATH."""
    ros_environment["ROS_PACKAGE_PATH"] = f"{package}:{ros_environment['ROS_PACKAGE_PATH']}"
    return ros_environment


@pytest.fixture(scope="module")
def documented(checkout: Path, package: Path) -> set[str]:
    """The launch files of all commands of the documentation, with their arguments."""
    pages = [checkout / "docs" / "navigation.md", package / "README.md", checkout / "README.md"]
    text = "\n".join(page.read_text() for page in pages)
    commands = re.findall(r"^roslaunch flatland_navigation (\S+.*?)(?: *#.*)?$", text, re.MULTILINE)
    robot = str(package / "config" / "robot.yaml")
    return {command.replace("/path/robot.yaml", robot) for command in commands}


@pytest.fixture(scope="module")
def launches(
    new_environment: Any, package: Path, documented: set[str], tmp_path_factory: Any
) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """The parameters and the remappings of nodes of launch files with arguments.

    All are resolved by one process, which takes longer to start than to resolve them.
    """
    shell = new_environment(tmp_path_factory.mktemp("roslaunch"))
    shell["ROS_PACKAGE_PATH"] = f"{package}:{shell['ROS_PACKAGE_PATH']}"
    others = ["two_robots.launch", "navigation.launch map:=/a.yaml", "mapping.launch slam:=hector"]
    with_topics = [f"{launch} {WITH_TOPICS} simulator:=false" for launch in ALL_NODES]
    names = list({*NODES, *documented, *others, *with_topics})
    files = [shlex.split(name) for name in names]
    done = run_program(
        [sys.executable, "-c", RESOLVE],
        env=shell,
        input=json.dumps([[f"{package}/launch/{name}", *more] for name, *more in files]),
        check=True,
    )
    results = json.loads(done.stdout[done.stdout.index("JSON") + 4 :])
    return dict(zip(names, results, strict=True))


@pytest.fixture(scope="module")
def params(launches: dict[str, Any]) -> dict[str, Any]:
    """The parameters of navigation.launch."""
    return launches["navigation.launch"][0]


@pytest.fixture(scope="module")
def office(checkout: Path) -> Any:
    with flatland.World.from_yaml(checkout / "worlds/office/world.yaml", seed=1) as world:
        yield world


def test_the_suite_can_be_run(package):
    (tour, *others) = load_suite(scenario_files([str(package / "suites")]))
    assert len(others) == 2
    goals = yaml.safe_load((package / "tours" / "office.yaml").read_text())["goals"]
    assert list(tour.goals) == [tuple(goal["pose"][:2]) for goal in goals]
    with flatland.World.from_yaml(tour.world, seed=1, params=tour.params) as world:
        stage = prepare(world, Run(tour, "", 1))
        world.step(100)
        assert stage.robot.name == "robot"
        # Sent by the localisation.
        assert ("map", "odom") not in world.transforms
        assert ("odom", "base_link") in world.transforms


@pytest.mark.ros
def test_the_launch_files_start_the_nodes(launches):
    for launch, nodes in NODES.items():
        assert set(launches[launch][1]) == nodes, launch


@pytest.mark.ros
def test_the_package_is_found_by_roslaunch(shell, tmp_path):
    command = ["roslaunch", "flatland_navigation", "navigation.launch", "--nodes"]
    assert "/move_base" in output_of(command, shell, tmp_path).split()
    command = ["rosrun", "flatland_navigation", "tour.py", "--help"]
    assert "--ground-truth" in output_of(command, shell, tmp_path)


@pytest.mark.ros
def test_all_commands_of_the_documentation_can_be_launched(launches, documented):
    assert len(documented) >= 8
    assert all(launches[command][1] for command in documented)


@pytest.mark.ros
def test_topics_and_frames_of_the_arguments_reach_all_nodes(launches):
    for launch in ALL_NODES:
        params, nodes = launches[f"{launch} {WITH_TOPICS} simulator:=false"]
        for node, remappings in nodes.items():
            for topic, target in remappings.items():
                assert target == TOPICS["map_topic" if topic == "map" else topic], (launch, node)
        for key, value in params.items():
            assert value not in DEFAULTS, (launch, key)
        used = {str(value) for value in params.values()}
        used |= {target for remappings in nodes.values() for target in remappings.values()}
        assert used >= set(TOPICS.values()), launch


@pytest.mark.ros
def test_two_robots_have_topics_and_frames_of_their_own(launches, package):
    params, nodes = launches["two_robots.launch"]
    with flatland.World.from_yaml(package / "worlds/two_robots/world.yaml", seed=1) as world:
        poses = {model.name: model.bodies[0].pose for model in world.models}
        robots = list(poses)
        assert robots == ["robot_1", "robot_2"]
        for robot in robots:
            tour = yaml.safe_load((package / "tours" / f"{robot}.yaml").read_text())
            for goal in tour["goals"]:
                assert world.is_free(tuple(goal["pose"]), radius=0.4, ignore=robots), goal
            scan = world.output(f"/{robot}/scan")
            world.step(50)
            assert scan.latest.frame_id == f"{robot}_laser"
    for robot in robots:
        amcl, move_base = f"/{robot}/amcl", f"/{robot}/move_base"
        assert {amcl, move_base} <= set(nodes)
        assert params[f"{amcl}/odom_frame_id"] == f"{robot}_odom"
        assert params[f"{amcl}/base_frame_id"] == f"{robot}_base_link"
        initial = [params[f"{amcl}/initial_pose_{axis}"] for axis in "xya"]
        assert initial == pytest.approx(list(poses[robot]), abs=1e-4)
        assert params[f"{move_base}/local_costmap/global_frame"] == f"{robot}_odom"
        assert params[f"{move_base}/global_costmap/robot_base_frame"] == f"{robot}_base_link"
        model = yaml.safe_load((package / f"worlds/two_robots/{robot}.model.yaml").read_text())
        assert model["plugins"][1]["odom_frame_id"] == f"{robot}_odom"


@pytest.mark.ros
def test_the_parameters_fit_the_office(checkout, launches, params, office):
    model = yaml.safe_load((checkout / "worlds/office/diff_robot.model.yaml").read_text())
    plugins = {plugin["type"]: plugin for plugin in model["plugins"]}
    laser, drive = plugins["Laser"], plugins["DiffDrive"]
    radius = model["bodies"][0]["footprints"][0]["radius"]
    assert laser["no_hit"] == "inf"
    for costmap in ("global_costmap", "local_costmap"):
        source = f"/move_base/{costmap}/obstacles/scan"
        assert params[f"{source}/inf_is_valid"] is True
        # costmap_2d converts inf to a reading of the range of the laser.
        assert params[f"{source}/obstacle_range"] < params[f"{source}/raytrace_range"]
        assert params[f"{source}/raytrace_range"] <= laser["range"]
        assert radius - 0.05 < params[f"/move_base/{costmap}/robot_radius"] <= radius
    planner = "/move_base/DWAPlannerROS"
    for limit, axis, key in (
        ("max_vel_x", "linear", "velocity_limit"),
        ("acc_lim_x", "linear", "acceleration_limit"),
        ("max_vel_theta", "angular", "velocity_limit"),
        ("acc_lim_theta", "angular", "acceleration_limit"),
    ):
        assert 0 < params[f"{planner}/{limit}"] <= drive[f"{axis}_dynamics"][key], limit
    robot = next(m for m in office.models if m.name == "robot")
    x, y, yaw = robot.bodies[0].pose
    initial = [params[f"/amcl/initial_pose_{axis}"] for axis in "xya"]
    assert initial == pytest.approx([x, y, yaw], abs=1e-6)
    assert params["/map_to_odom"] is False
    assert params["/flatland_server/publish_map"] == office.layers[0].name
    with_file, _ = launches["navigation.launch map:=/a.yaml"]
    assert with_file["/flatland_server/publish_map"] is False


@pytest.mark.ros
def test_the_slam_parameters_fit_the_laser_of_the_office(checkout, launches):
    model = yaml.safe_load((checkout / "worlds/office/diff_robot.model.yaml").read_text())
    laser = next(plugin for plugin in model["plugins"] if plugin["type"] == "Laser")
    (params, _), (hector, _) = (launches[f"mapping.launch{slam}"] for slam in ("", " slam:=hector"))
    assert 0 < params["/gmapping/maxUrange"] <= params["/gmapping/maxRange"] < laser["range"]
    assert hector["/hector_mapping/laser_max_dist"] < laser["range"]
    for parameters in (params, hector):
        # The SLAM node publishes the map.
        assert parameters["/flatland_server/publish_map"] is False
        assert parameters["/map_to_odom"] is False


def test_the_goals_of_the_office_are_free(package, office):
    tour = yaml.safe_load((package / "tours" / "office.yaml").read_text())
    assert len(tour["goals"]) == 4
    for goal in tour["goals"]:
        assert office.is_free(tuple(goal["pose"]), radius=0.4, ignore=["robot"]), goal["name"]


# The message type that each display of RViz shows.
DISPLAYS = {
    "rviz/Map": "nav_msgs/OccupancyGrid",
    "rviz/MarkerArray": "visualization_msgs/MarkerArray",
    "rviz/LaserScan": "sensor_msgs/LaserScan",
    "rviz/PoseArray": "geometry_msgs/PoseArray",
    "rviz/PoseWithCovariance": "geometry_msgs/PoseWithCovarianceStamped",
    "rviz/Path": "nav_msgs/Path",
    "rviz/Polygon": "geometry_msgs/PolygonStamped",
    "rviz/Pose": "geometry_msgs/PoseStamped",
    "rviz/Odometry": "nav_msgs/Odometry",
    "rviz/InteractiveMarkers": "visualization_msgs/InteractiveMarkerUpdate",
}
# Topics of the nodes that are not installed here; planners in the names come from move_base.yaml.
OTHERS = {
    "/map": "nav_msgs/OccupancyGrid",
    "/particlecloud": "geometry_msgs/PoseArray",
    "/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "/move_base/global_costmap/costmap": "nav_msgs/OccupancyGrid",
    "/move_base/local_costmap/costmap": "nav_msgs/OccupancyGrid",
    "/move_base/local_costmap/footprint": "geometry_msgs/PolygonStamped",
    "/move_base/current_goal": "geometry_msgs/PoseStamped",
    "/move_base/{base_global_planner}/plan": "nav_msgs/Path",
    "/move_base/{base_local_planner}/local_plan": "nav_msgs/Path",
}
# Prints the topics, the frames of messages and the tree of transforms of the simulator as JSON.
OBSERVE = dedent(
    """
    import json, time, rosgraph, rospy
    from geometry_msgs.msg import Twist
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import LaserScan
    from tf2_msgs.msg import TFMessage

    rospy.init_node("observer", disable_rostime=True)
    parents = {}
    def receive(message):
        parents.update({t.child_frame_id: t.header.frame_id for t in message.transforms})
    rospy.Subscriber("/tf", TFMessage, receive)
    scan = rospy.wait_for_message("/scan", LaserScan)
    odom = rospy.wait_for_message("/odometry/filtered", Odometry)
    truth = rospy.wait_for_message("/odometry/ground_truth", Odometry)
    while scan.header.frame_id not in parents or odom.child_frame_id not in parents:
        time.sleep(0.01)
    later = rospy.wait_for_message("/scan", LaserScan).header.stamp
    while rospy.wait_for_message("/scan", LaserScan).header.stamp.to_sec() < later.to_sec() + 0.2:
        pass  # several periods of all transforms
    master = rosgraph.Master("/observer")
    subscribed = []
    while "/cmd_vel" not in subscribed:  # the node registers asynchronously
        subscribers = master.getSystemState()[1]
        subscribed = [topic for topic, nodes in subscribers if "/flatland_server" in nodes]
        time.sleep(0.01)
    print("JSON" + json.dumps({
        "types": dict(master.getTopicTypes()),
        "parents": parents,
        "scan": scan.header.frame_id,
        "odom": [odom.header.frame_id, odom.child_frame_id],
        "truth": [truth.header.frame_id, truth.child_frame_id],
    }))
    """
)


@pytest.mark.ros
def test_the_simulator_provides_the_frames_and_topics_of_all_nodes(
    package, shell, params, start, tmp_path
):
    launch = package / "launch" / "components" / "simulator.launch"
    server = start(["roslaunch", launch, "rviz:=false"], shell)
    server.wait_for_line('loaded ".*world.yaml"')
    printed = output_of([sys.executable, "-c", OBSERVE], shell, tmp_path)
    seen = json.loads(printed[printed.index("JSON") + 4 :])

    # What amcl, the SLAM nodes and move_base subscribe to by the default arguments.
    assert seen["types"]["/scan"] == "sensor_msgs/LaserScan"
    assert seen["types"]["/odometry/filtered"] == "nav_msgs/Odometry"
    assert seen["types"]["/clock"] == "rosgraph_msgs/Clock"
    frames = [params[f"/amcl/{frame}_frame_id"] for frame in ("global", "odom", "base")]
    assert seen["odom"] == frames[1:]
    assert seen["truth"] == [frames[0], frames[2]]
    parents = seen["parents"]
    assert parents[seen["scan"]] == "base_link"
    assert parents["base_link"] == "odom"
    # The localisation sends this transform, and nothing else does.
    assert "odom" not in parents
    # RViz
    planners = {
        key: params[f"/move_base/{key}"].split("/")[-1]
        for key in ("base_global_planner", "base_local_planner")
    }
    types = {topic.format(**planners): kind for topic, kind in OTHERS.items()}
    types |= {topic: kind for topic, kind in seen["types"].items() if topic not in types}
    # Published with show_viz only, which requires a display here.
    types["/flatland_server/debug/all_models"] = "visualization_msgs/MarkerArray"
    rviz = yaml.safe_load((package / "rviz" / "navigation.rviz").read_text())[
        "Visualization Manager"
    ]
    assert rviz["Global Options"]["Fixed Frame"] == frames[0]
    shown = set()
    for display in rviz["Displays"]:
        topic = next((display[key] for key in display if key.endswith("Topic")), None)
        if topic is not None:
            assert types[topic] == DISPLAYS[display["Class"]], display["Name"]
            shown.add(topic)
    assert shown >= {topic.format(**planners) for topic in OTHERS}
    tools = {tool["Class"]: tool.get("Topic") for tool in rviz["Tools"]}
    assert tools["rviz/SetGoal"] == "/move_base_simple/goal"
    assert tools["rviz/SetInitialPose"] == "/initialpose"


# Stands for move_base: drives straight to a goal, and aborts goals outside of the room. Sends the
# frame `estimate`, 0.3 m to the left of base_link and rotated by 0.1 rad, as a localisation.
# In lockstep, so that the way does not depend on the load of the machine.
DRIVER = dedent(
    """
    import math, queue, threading, time, actionlib, rospy, tf2_ros
    from flatland.srv import StepWorld
    from geometry_msgs.msg import TransformStamped, Twist
    from move_base_msgs.msg import MoveBaseAction
    from nav_msgs.msg import Odometry

    rospy.init_node("driver")
    poses = queue.SimpleQueue()
    rospy.Subscriber("odometry/ground_truth", Odometry, poses.put)
    rospy.on_shutdown(lambda: poses.put(None))  # No message follows.
    drive = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "base_link", "estimate"
    transform.transform.translation.y = 0.3
    transform.transform.rotation.z, transform.transform.rotation.w = math.sin(0.05), math.cos(0.05)
    broadcaster = tf2_ros.StaticTransformBroadcaster()
    broadcaster.sendTransform(transform)
    target = None  # x, y, and an event that is set when the robot is there

    def execute(goal):
        global target
        position = goal.target_pose.pose.position
        if not 0 < position.x < 8:
            return server.set_aborted()
        reached = threading.Event()
        target = position.x, position.y, reached
        while not reached.wait(0.01):
            if server.is_preempt_requested() or rospy.is_shutdown():
                target = None
                return server.set_preempted()
        server.set_succeeded()

    def command_to(target, x, y, yaw):
        command = Twist()
        if target is None:
            return command
        distance = math.hypot(target[0] - x, target[1] - y)
        if distance < 0.02:
            target[2].set()
            return command
        bearing = math.remainder(math.atan2(target[1] - y, target[0] - x) - yaw, math.tau)
        command.linear.x = min(1.0, 2 * distance) if abs(bearing) < 0.05 else 0.0
        command.angular.z = 3 * bearing
        return command

    def pose_since(stamp):
        for message in iter(poses.get, None):
            if message.header.stamp >= stamp:
                return message.pose.pose
        return None

    rospy.wait_for_service("step_world")
    step_world = rospy.ServiceProxy("step_world", StepWorld, persistent=True)
    while poses.empty() or not drive.get_num_connections():
        step_world(0.02)
        time.sleep(0.01)
    server = actionlib.SimpleActionServer("move_base", MoveBaseAction, execute, auto_start=False)
    server.start()
    while pose := pose_since(step_world(0.02).stamp - rospy.Duration(0.02)):
        p, q = pose.position, pose.orientation
        drive.publish(command_to(target, p.x, p.y, 2 * math.atan2(q.z, q.w)))
        # In real time without a goal: the time until others receive a result counts as well.
        time.sleep(0.02 if target is None or target[2].is_set() else 0.005)
    """
)
TOUR = """
goals:
  - {name: east, pose: [3.5, 1.5, 0.0]}
  - {name: outside, pose: [20, 1.5, 0.0]}
  - {name: north, pose: [3.5, 3.5, 0.0]}
"""


@pytest.fixture
def tour_of(shell, package, tmp_path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Drives a tour, given as the text of its file."""

    def drive(text: str, *options: str) -> subprocess.CompletedProcess[str]:
        (tmp_path / "tour.yaml").write_text(text)
        return run_program(
            [package / "scripts" / "tour.py", tmp_path / "tour.yaml", *options], env=shell
        )

    return drive


@pytest.mark.ros
def test_a_tour_reports_times_and_errors(checkout, shell, start, tour_of):
    world = checkout / "worlds" / "simple" / "world.yaml"
    launch = ["roslaunch", "flatland", "server.launch", f"world_path:={world}", "show_viz:=false"]
    server = start([*launch, "lockstep:=true"], shell)
    server.wait_for_line('loaded ".*world.yaml"')
    driver = start([sys.executable, "-c", DRIVER], shell)
    done = tour_of(TOUR, "--base-frame", "estimate")
    assert done.returncode == 1, done.stderr
    rows = {
        line.split()[0]: line.split()[1:] for line in done.stdout.splitlines() if "  " in line[2:]
    }
    assert rows["east"][0] == "reached"
    assert rows["outside"][0] == "aborted"
    assert rows["north"][0] == "reached"
    # time [s], path [m], distance [m] and angle [deg] off the goal
    time, path, distance, angle = map(float, rows["east"][1:5])
    assert 2.0 < time < 10.0
    assert path == pytest.approx(2.0, abs=0.1)
    assert distance == pytest.approx(0.0, abs=0.03)
    assert angle == pytest.approx(0.0, abs=1)
    assert float(rows["outside"][3]) == pytest.approx(16.5, abs=0.05)
    assert float(rows["north"][2]) == pytest.approx(2.0, abs=0.2)
    assert float(rows["north"][4]) == pytest.approx(90, abs=5)
    # localisation: mean and maximum [m], mean and maximum [deg]
    for row in ("east", "north"):
        errors = list(map(float, rows[row][5:]))
        assert errors[:2] == pytest.approx([0.3, 0.3], abs=2e-3)
        assert errors[2:] == pytest.approx([math.degrees(0.1)] * 2, abs=0.02)
    assert rows["all"][:3] == ["2", "of", "3"]

    done = tour_of("goals: [{pose: [1.5, 1.5, 0]}]", "--repeat", "2")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 of 2" in done.stdout.splitlines()[-1]
    done = tour_of("goals: [{pose: [2, 5, 0]}]", "--timeout", "1")
    assert done.returncode == 1
    assert "timeout" in done.stdout
    done = tour_of(TOUR, "--wait", "0.2", "--action", "nobody")
    assert done.returncode == 1
    assert "tour: action server /nobody: not within 0.2 s" in done.stderr
    assert "Traceback" not in done.stderr + driver.output


@pytest.mark.ros
def test_an_invalid_tour_is_an_error(package, tour_of, tmp_path):
    program = runpy.run_path(str(package / "scripts" / "tour.py"))
    file = tmp_path / "tour.yaml"
    for text, message in (
        ("goals: []", "expected goals:"),
        ("goals: [{name: a}]", "expected goals:"),
        ("goals: [{pose: [1, 2]}]", "expected goals:"),
        ("[1, 2]", "expected goals:"),
        ("goals: [{pose: [1, 2, .nan]}]", "goal 1 is not finite"),
        ("goals: [", "expected goals:"),
    ):
        file.write_text(text)
        with pytest.raises(program["TourError"]) as raised:
            program["read_tour"](file)
        assert str(raised.value).startswith(f"{file}: {message}"), text
    done = tour_of("goals: []")
    assert done.returncode == 1
    assert done.stderr.startswith(f"tour: {file}: expected goals:")
