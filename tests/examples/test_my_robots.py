"""The example package: without ROS, on ROS, and independent of flatland's own code."""

from __future__ import annotations

import sys
from textwrap import dedent

import pytest
from programs import output_of, run_program


def test_the_test_of_the_package_passes_without_ros(example, environment, tmp_path):
    """Importing a ROS module fails."""
    blocked = tmp_path / "blocked"
    blocked.mkdir()
    for module in ("rospy", "genpy", "rosgraph", "sensor_msgs", "std_srvs", "std_msgs"):
        (blocked / f"{module}.py").write_text(f"raise RuntimeError('{module} was imported')")
    environment["PYTHONPATH"] = f"{blocked}:{environment['PYTHONPATH']}"
    del environment["ROS_PACKAGE_PATH"]
    printed = output_of(
        [sys.executable, "-W", "error", "-m", "unittest", "discover", "-s", str(example / "test")],
        environment,
        tmp_path,
    )
    assert "Ran 3 tests" in printed


def test_flatland_does_not_contain_the_package(environment, tmp_path):
    code = "import flatland, importlib.util as u; print(u.find_spec('my_robots'))"
    done = run_program([sys.executable, "-c", code], env=environment, cwd=tmp_path, check=True)
    assert done.stdout.strip() == "None"


LISTEN = dedent(
    """
    import time, rospy
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import BatteryState
    from std_msgs.msg import Bool
    from std_srvs.srv import Trigger
    from geometry_msgs.msg import Twist
    from flatland.srv import DeleteModel

    rospy.init_node("listener", disable_rostime=True)
    rospy.wait_for_service("/reset_models")

    def until(topic, kind, accept):
        while True:
            message = rospy.wait_for_message(topic, kind)
            if accept(message):
                return message

    def sender(topic, kind):
        publisher = rospy.Publisher(topic, kind, queue_size=1)
        while not publisher.get_num_connections():
            time.sleep(0.01)
        return publisher

    first = rospy.wait_for_message("/battery", BatteryState)
    assert (first.voltage, first.present) == (24.0, True), first
    assert first.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    assert abs(first.capacity - 2 / 24) < 1e-6 and abs(first.current + 10 / 24) < 1e-6, first
    assert first.temperature != first.temperature
    stamp = first.header.stamp.to_nsec()
    assert stamp > 0 and stamp % 500_000_000 == 0, stamp
    energy = 2 - 10 * stamp / 1e9 / 3600
    assert abs(first.charge - energy / 24) < 1e-6, first
    assert abs(first.percentage - energy / 2) < 1e-6, first

    drive = sender("/cmd_vel", Twist)
    twist = Twist()
    twist.linear.x = 1.0
    drive.publish(twist)
    until("/battery", BatteryState, lambda m: abs(m.current + 60 / 24) < 1e-3)
    until("/odometry/ground_truth", Odometry, lambda m: m.pose.pose.position.x > 2.5)
    drive.publish(Twist())

    recharge = sender("/recharge", Bool)
    recharge.publish(True)
    full = BatteryState.POWER_SUPPLY_STATUS_FULL
    until("/battery", BatteryState, lambda m: m.power_supply_status == full)

    answer = rospy.ServiceProxy("/reset_models", Trigger)()
    assert (answer.success, answer.message) == (True, "moved: cart"), answer
    until("/odometry/ground_truth", Odometry, lambda m: m.pose.pose.position.x == 2.0)

    assert rospy.ServiceProxy("/delete_model", DeleteModel)("cart").success
    answer = rospy.ServiceProxy("/reset_models", Trigger)()
    assert (answer.success, answer.message) == (True, "moved: "), answer
    while "/battery" in dict(rospy.get_published_topics()):  # the node unregisters it later
        time.sleep(0.01)
    print("all checks passed")
    """
)


@pytest.mark.ros
def test_on_ros_the_package_is_found_on_the_package_path(example, environment, tmp_path, start):
    pytest.importorskip("rospy", reason="ROS is not installed")
    environment["ROS_PACKAGE_PATH"] += f":{example}"
    packages = output_of(
        ["rospack", "plugins", "--attrib=plugin", "flatland"], environment, tmp_path
    )
    assert f"my_robots {example}/flatland_plugins.xml" in packages.splitlines()
    world = example / "worlds" / "yard" / "world.yaml"
    server = start(
        ["roslaunch", "flatland", "server.launch", f"world_path:={world}", "show_viz:=false"],
        environment,
    )
    server.wait_for_line('loaded ".*world.yaml"')
    printed = output_of([sys.executable, "-c", LISTEN], environment, tmp_path)
    assert printed.endswith("all checks passed\n")
    assert "Traceback" not in server.output
    warnings = [line for line in server.output.splitlines() if "WARN" in line]
    # A busy machine does not hold the rate.
    assert [line for line in warnings if "cannot be held" not in line] == []
    server.stop()
    assert "killing on exit" in server.output
