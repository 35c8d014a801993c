"""`flatland doctor`, with things that are really missing."""

from __future__ import annotations

import json
import shutil
import sys
import venv
from pathlib import Path
from typing import Any

import pytest
from flatland_command import main
from programs import run_program
from waiting import TIMEOUT

from flatland import requirements
from flatland.cli import doctor


@pytest.fixture(scope="module")
def bare_python(tmp_path_factory: pytest.TempPathFactory) -> str:
    """An interpreter without any packages."""
    folder = tmp_path_factory.mktemp("venv")
    venv.create(folder, system_site_packages=False, with_pip=False)
    return str(folder / "bin" / "python")


def clean_environment(**variables: str) -> dict[str, str]:
    return {"PATH": "/nowhere", "HOME": "/nowhere", **variables}


def findings(text: str) -> dict[str, dict[str, Any]]:
    return {finding["name"]: finding for finding in json.loads(text)["findings"]}


def test_a_complete_installation(checkout, monkeypatch, capsys):
    monkeypatch.chdir(checkout)
    monkeypatch.setattr(doctor, "_TIMEOUT", TIMEOUT)  # a busy machine may need more than usual
    code = main("doctor", "--json")
    printed = capsys.readouterr().out
    found = findings(printed)
    assert code == 0, printed
    for name in ("version", "flatland", "numpy", "PyYAML", "lupa", "extension and Box2D"):
        assert found[name]["status"] == "ok"
        assert found[name]["remedy"] == ""
    assert found["extension and Box2D"]["detail"].startswith("Box2D 2.")
    assert json.loads(printed)["ok"]


def test_without_any_package_everything_has_a_remedy(bare_python, checkout, tmp_path):
    script = checkout / "flatland" / "cli" / "doctor.py"
    done = run_program([bare_python, script], env=clean_environment(), cwd=tmp_path)
    assert (done.returncode, done.stderr) == (1, "")
    lines = done.stdout.splitlines()
    assert "  missing  numpy: not installed" in lines
    assert lines[lines.index("  missing  numpy: not installed") + 1] == (
        "           -> apt-get install python3-numpy"
    )
    for start in (
        "absent   rospy: not installed",
        "absent   command flatland: not on PATH",
        "absent   display: DISPLAY is not set",
        "info     ROS master: ROS_MASTER_URI is not set",
    ):
        assert any(line.startswith(f"  {start}") for line in lines), start
    assert lines[-1].startswith("required and missing: numpy, PyYAML, lupa")


def test_importing_flatland_without_its_requirements_names_the_doctor(
    bare_python, checkout, tmp_path
):
    done = run_program(
        [bare_python, "-m", "flatland", "doctor"],
        env=clean_environment(PYTHONPATH=str(checkout)),
        cwd=tmp_path,
    )
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert "numpy: apt-get install python3-numpy" in last
    assert last.endswith(f"python3 {checkout / 'flatland' / 'cli' / 'doctor.py'}")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("raise RuntimeError('broken')", "import fails: RuntimeError: broken"),
        ("import os; os.abort()", "import fails: "),
        ("raise SystemExit(3)", "import fails: "),
    ],
)
def test_a_module_that_cannot_be_imported(tmp_path, monkeypatch, text, reason):
    (tmp_path / "broken_module.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(str(tmp_path))
    modules = [("broken_module", "broken", "repair it", ""), ("json", "json", "", "")]
    broken, fine = doctor._check_modules("tools", modules, required=True)
    assert (broken.status, broken.remedy) == ("missing", "repair it")
    assert broken.detail.startswith(f"installed in {tmp_path}, but its {reason}")
    assert fine.status == "ok"


def test_a_module_that_does_not_fit_numpy_names_the_cause(tmp_path, monkeypatch):
    (tmp_path / "cv2.py").write_text("raise AttributeError('_ARRAY_API not found')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "cv2", raising=False)
    monkeypatch.setattr("importlib.metadata.version", lambda _name: "2.4.6")
    (found,) = doctor._check_modules("tools", [("cv2", "OpenCV", "apt-get install x", "videos")])
    assert found.detail.startswith(
        f"installed in {tmp_path}, but its binary interface does not fit numpy 2.4.6 in /"
    )
    assert (found.status, found.remedy) == ("absent", 'pip install "numpy<2"')


def test_a_program_that_does_not_end_is_stopped(monkeypatch):
    monkeypatch.setattr(doctor, "_TIMEOUT", 0.2)
    done = doctor._run_python("import time; time.sleep(1000)")
    assert done.returncode == 1
    assert done.stderr == "no answer within 0.2 s"


def test_a_display_that_does_not_answer(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":987")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.delenv("QT_QPA_PLATFORM", raising=False)
    (display,) = doctor._check_display()
    assert (display.name, display.status) == ("display", "absent")
    assert ":987" in display.detail
    assert display.remedy


def test_the_ros_master(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    assert doctor._check_master().detail.startswith("not running at http://localhost:1 (")
    for uri in ("http://localhost:notaport", "http://localhost", "localhost:11311"):
        monkeypatch.setenv("ROS_MASTER_URI", uri)
        found = doctor._check_master()
        assert (found.status, found.remedy) == ("info", "set ROS_MASTER_URI")
        assert found.detail.startswith(f'invalid master URI "{uri}": ')


def test_an_address_that_no_node_can_be_reached_at(monkeypatch):
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)
    monkeypatch.delenv("ROS_MASTER_URI", raising=False)
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    assert doctor._check_own_address().status == "ok"
    monkeypatch.setenv("ROS_MASTER_URI", "http://192.0.2.1:11311")
    found = doctor._check_own_address()
    assert found.status == "absent"
    assert "the master is on 192.0.2.1" in found.detail
    monkeypatch.setenv("ROS_IP", "no-such-host.invalid")
    found = doctor._check_own_address()
    assert found.status == "absent"
    assert found.detail.startswith(
        'no program can connect to "no-such-host.invalid", from ROS_IP: '
    )
    assert "ROS_IP" in found.remedy


def test_packages_are_those_of_the_list(checkout: Path):
    """Each Debian package of a remedy is in packages-apt.txt, so that `make setup` installs it."""
    listed = {line.split()[1] for line in (checkout / "packages-apt.txt").read_text().splitlines()}
    remedies = [(name, remedy) for _, name, remedy, _ in doctor._ROS]
    remedies += [(package.name, package.debian) for package in requirements.PACKAGES.values()]
    for name, remedy in remedies:
        for word in remedy.replace(",", "").split():
            if word.startswith("python3-"):
                assert word in listed, name


def test_a_wheel_needs_no_ros(tmp_path: Path) -> None:
    package = tmp_path / "lib" / "flatland"
    (package / "cli").mkdir(parents=True)
    for name in ("requirements.py", "cli/doctor.py"):
        shutil.copy(Path(doctor.__file__).parents[1] / name, package / name)
    (package / "__init__.py").write_text("raise ImportError('not imported')")
    done = run_program(
        [sys.executable, "-I", "-S", package / "cli" / "doctor.py", "--json"],
        env=clean_environment(),
        cwd=tmp_path,
    )
    assert done.returncode == 1
    found = findings(done.stdout)
    assert found["installation"]["detail"] == requirements.WHEEL
    assert found["numpy"]["remedy"] == "pip install numpy"
    assert found["matplotlib"]["remedy"] == 'pip install "flatland-sim[draw]"'
    assert found["extension and Box2D"]["remedy"].startswith("pip install --force-reinstall")
    assert found["ROS"]["status"] == "info"
    assert "rospy" not in found
