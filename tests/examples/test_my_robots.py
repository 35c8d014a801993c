"""The example package: without ROS, and independent of flatland's own code.

`test_tutorial.py` runs it on ROS.
"""

from __future__ import annotations

import sys

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
