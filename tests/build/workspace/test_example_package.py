"""The plugins of the example package, built in the same workspace as flatland."""

from __future__ import annotations

from pathlib import Path

import pytest
from waiting import BUILD_TIMEOUT

# The first test builds the workspace.
pytestmark = pytest.mark.timeout(BUILD_TIMEOUT)

DRIVE_THROUGH_THE_GATE = """
import rospkg, flatland
yard = rospkg.RosPack().get_path("my_robots") + "/worlds/yard/world.yaml"
with flatland.World.from_yaml(yard, seed=1) as world:
    battery = world.output("/battery")
    world.command("/cmd_vel").set(flatland.Twist(linear_x=1.0))
    world.step(1200)
    assert world.model("cart").pose[0] > 7.9, world.model("cart").pose
    assert abs(battery.latest.energy - (2 - 60 * 6 / 3600)) < 1e-6, battery.latest
    [reset] = world.plugins
    assert reset.reset() == ["cart"]
import my_robots.battery, my_robots.battery_ros
from flatland.ros.adapters import find_adapter
print(find_adapter(my_robots.battery.BatteryReading).message_type._type)
print(my_robots.battery.__file__)
"""


def test_rospack_finds_the_manifest(space, checkout):
    packages = space.run("rospack", "plugins", "--attrib=plugin", "flatland").splitlines()
    found = dict(line.split(" ", 1) for line in packages)
    share = space.folder / "share" / "my_robots"
    folder = checkout / "examples" / "my_robots" if space.name == "devel" else share
    assert Path(found["my_robots"]).resolve() == folder / "flatland_plugins.xml"


def test_plugins_work_in_the_python_of_the_system(space, checkout):
    printed = space.run("/usr/bin/python3", "-W", "error", "-c", DRIVE_THROUGH_THE_GATE)
    message, module = printed.splitlines()
    assert message == "sensor_msgs/BatteryState"
    if space.name == "devel":
        # The sources, so that edits take effect without a build.
        assert (
            Path(module).resolve().parent
            == checkout / "examples" / "my_robots" / "src" / "my_robots"
        )
    else:
        packages = space.folder / "lib" / "python3" / "dist-packages"
        assert Path(module).parent == packages / "my_robots"
