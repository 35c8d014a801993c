"""Messages of packages that are not part of Debian: `people_msgs` and `ackermann_msgs`.

The packages are generated from their definitions, so that the node and this process exchange real
messages.
"""

from __future__ import annotations

import importlib
import math
import os
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from programs import run_program

from flatland.msg import PeopleStates
from flatland.srv import GetModelStates

DEFINITIONS = {
    "people_msgs": {
        "Person": "string name\ngeometry_msgs/Point position\ngeometry_msgs/Point velocity\n"
        "float64 reliability\nstring[] tagnames\nstring[] tags\n",
        "People": "std_msgs/Header header\npeople_msgs/Person[] people\n",
    },
    "ackermann_msgs": {
        "AckermannDrive": "float32 steering_angle\nfloat32 steering_angle_velocity\n"
        "float32 speed\nfloat32 acceleration\nfloat32 jerk\n",
        "AckermannDriveStamped": "Header header\nAckermannDrive drive\n",
    },
}
PEOPLE = (
    "[{name: people, type: Pedestrians, groups: [{name: a, count: 3, area: [-4, 1, 4, 4],"
    " waypoints: [{at: [4, 3]}, {at: [-4, 3]}]}]}]"
)
CAR = """
bodies: [{name: base, footprints: [{type: circle, radius: 0.2, density: 1}]}]
plugins:
  - {type: AckermannDrive, name: drive, body: base, wheelbase: 1, max_steer_angle: 0.5,
     command: ackermann}
"""


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the generated packages, from which this process imports, too."""
    folder = tmp_path_factory.mktemp("packages")
    for package, definitions in DEFINITIONS.items():
        source = folder / "share" / package
        source.mkdir(parents=True)
        output = folder / package / "msg"
        for name, text in definitions.items():
            (source / f"{name}.msg").write_text(text)
        files = [str(source / f"{name}.msg") for name in definitions]
        include = [f"-I{package}:{source}"]
        for other in ("std_msgs", "geometry_msgs"):
            include.append(f"-I{other}:/usr/share/{other}/msg")
        generate = ["/usr/bin/python3", "-E", "/usr/lib/genpy/genmsg_py.py"]
        run_program([*generate, "-p", package, "-o", output, *include, *files], check=True)
        (output / "__init__.py").write_text("".join(f"from ._{n} import *\n" for n in definitions))
        (folder / package / "__init__.py").touch()
    sys.path.append(str(folder))
    importlib.invalidate_caches()
    yield folder
    sys.path.remove(str(folder))
    for name in [name for name in sys.modules if name.partition(".")[0] in DEFINITIONS]:
        del sys.modules[name]


@pytest.fixture(scope="module", autouse=True)
def server(packages: Path, module_launcher: Any, write_world: Callable[..., Path]) -> Any:
    """A server that finds the packages, in lockstep."""
    known = module_launcher.environment.get("PYTHONPATH", os.environ.get("PYTHONPATH", ""))
    path = f"{known}:{packages}" if known else str(packages)
    module_launcher.environment = {**module_launcher.environment, "PYTHONPATH": path}
    models = "[{name: car, model: car.model.yaml, pose: [0, -2, 0]}]"
    world = write_world(models=models, plugins=PEOPLE, car=CAR)
    return module_launcher.server(world, lockstep=True, seed=1, show_viz=False)


def test_tracked_people_are_those_of_the_states(ros: Any) -> None:
    messages = importlib.import_module("people_msgs.msg")
    tracked = ros.topic("/people/tracked", messages.People)
    states = ros.topic("/people/states", PeopleStates)
    ros.wait_until_ready("/people/tracked", "/people/states")
    ros.step(1.0)
    expected = states.next()
    message = tracked.until(lambda people: people.header.stamp == expected.header.stamp)
    assert message.header.frame_id == "map"
    assert [person.name for person in message.people] == ["a_0", "a_1", "a_2"]
    moving = 0
    for person, pose, twist in zip(message.people, expected.pose, expected.twist, strict=True):
        assert (person.position.x, person.position.y) == (pose.x, pose.y)
        assert (person.velocity.x, person.velocity.y) == (twist.linear.x, twist.linear.y)
        assert person.reliability == 1.0
        assert (person.tagnames, person.tags) == (["group"], ["a"])
        moving += math.hypot(person.velocity.x, person.velocity.y) > 0.0
    assert moving


def test_a_car_is_driven_within_the_limits_of_a_message(ros: Any) -> None:
    messages = importlib.import_module("ackermann_msgs.msg")
    command = messages.AckermannDriveStamped()
    command.drive.speed = 1.0
    command.drive.acceleration = 0.5
    command.drive.steering_angle = 0.3
    ros.publisher("/ackermann_cmd", messages.AckermannDriveStamped).publish(command)
    twists = []
    while len(twists) < 6:
        ros.step(0.1)
        answer = ros.call("/get_model_states", GetModelStates, ["car"])
        assert answer.success, answer.message
        [twist] = answer.states.twist
        if twist.linear.x != 0.0:
            twists.append(twist)
    speeds = [math.hypot(twist.linear.x, twist.linear.y) for twist in twists]
    gains = [later - earlier for earlier, later in pairwise(speeds)]
    assert gains == pytest.approx([0.05] * 5, abs=1e-5)
    for twist, speed in zip(twists, speeds, strict=True):  # on a circle of radius 1 / tan(0.3)
        assert twist.angular.z == pytest.approx(speed * math.tan(0.3), rel=1e-4)
