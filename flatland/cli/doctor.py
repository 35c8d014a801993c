"""`flatland doctor`: what is installed, what is missing, and what installs it.

The module imports only the standard library, so that it also runs as a script, without flatland:
`python3 flatland/cli/doctor.py`.
"""

from __future__ import annotations

import dataclasses
import importlib
import importlib.machinery
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_EXAMPLES = ("flatland doctor", "flatland doctor --json")
_PYTHON = (3, 11)
_TIMEOUT = 20.0  # s, for each program that is started
_SETUP = "make setup in a clone of flatland"
_APT = "apt-get install "

# (module, what it is for); what installs it stands in flatland/requirements.py
_OPTIONAL = (
    ("matplotlib", "flatland show, World.draw"),
    ("cv2", "flatland run --video, map_to_lines.py"),
    ("gymnasium", "flatland.gym"),
    ("pettingzoo", "flatland.gym with several robots"),
    ("tqdm", "progress bar of flatland run"),
    ("argcomplete", "completion in the shell"),
    ("aiohttp", "viewer in the browser"),
)
_ROS = (
    ("rospy", "rospy", _APT + "python3-rospy", "ROS node"),
    ("roslaunch", "roslaunch", _APT + "python3-roslaunch", "ROS node"),
    ("geometry_msgs", "geometry_msgs", _APT + "python3-geometry-msgs", "ROS node"),
    ("nav_msgs", "nav_msgs", _APT + "python3-nav-msgs", "ROS node"),
    ("rosgraph_msgs", "rosgraph_msgs", _APT + "python3-rosgraph-msgs", "ROS node"),
    ("sensor_msgs", "sensor_msgs", _APT + "python3-sensor-msgs", "ROS node"),
    ("std_msgs", "std_msgs", _APT + "python3-std-msgs", "ROS node"),
    ("std_srvs", "std_srvs", _APT + "python3-std-srvs", "ROS node"),
    ("tf2_msgs", "tf2_msgs", _APT + "python3-tf2-msgs", "ROS node"),
    ("tf2_ros", "tf2_ros", _APT + "python3-tf2-ros", "ROS node"),
    ("visualization_msgs", "visualization_msgs", _APT + "python3-visualization-msgs", "ROS node"),
    ("flatland.msg", "messages of flatland", _SETUP, "ROS node"),
    ("rosbag", "rosbag", _APT + "python3-rosbag", "flatland run --bag"),
    ("mcap_ros1", "mcap-ros1-support", 'pip install "flatland-sim[mcap]"', "MCAP files"),
    ("PyQt5", "PyQt5", _APT + "python3-pyqt5", "Qt viewer"),
    ("rviz", "RViz for Python", _APT + "python3-rviz", "Qt viewer"),
)
_PROGRAMS = (
    ("roslaunch", _APT + "python3-roslaunch"),
    ("rosrun", _APT + "rosbash"),
    ("rospack", _APT + "rospack-tools"),
)
_RESULT = "flatland doctor: "
_IMPORT_CODE = f"""
import importlib, json, sys
for name in sys.argv[1:]:
    try:
        result = [name, True, str(getattr(importlib.import_module(name), "__version__", ""))]
    except Exception as error:
        result = [name, False, f"{{type(error).__name__}}: {{error}}"]
    print("{_RESULT}" + json.dumps(result), flush=True)
"""
_DISPLAY_CODE = """
import sys
from PyQt5.QtGui import QGuiApplication, QOffscreenSurface, QOpenGLContext
app = QGuiApplication(sys.argv[:1])
size = app.primaryScreen().size()
print(f"{size.width()} x {size.height()}", flush=True)
context, surface = QOpenGLContext(), QOffscreenSurface()
surface.create()
if context.create() and context.makeCurrent(surface):
    version = context.format().version()
    try:
        gl = context.versionFunctions()
        gl.initializeOpenGLFunctions()
        renderer = f", {gl.glGetString(0x1F01)}"
    except Exception:
        renderer = ""
    print(f"{version[0]}.{version[1]}{renderer}", flush=True)
"""


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check.

    Attributes:
        section: Group of checks.
        name: What was checked.
        status: `ok`; `missing`, which is required; `absent`, which is optional; or `info`.
        detail: Version, path or reason.
        remedy: What installs or repairs it, empty if that is not necessary.
    """

    section: str
    name: str
    status: str
    detail: str
    remedy: str = ""


def add(commands: Any) -> None:
    """Adds the command."""
    from flatland.cli.arguments import add_command

    parser = add_command(
        commands,
        "doctor",
        summary="report what is installed and what is missing",
        description="Checks Python, the extension, the libraries, ROS, the display and OpenGL, and "
        "prints the command that installs what is missing. The exit code is 1 if something is "
        "missing that the simulation requires; everything else is optional.",
        examples=_EXAMPLES,
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=lambda options: report(as_json=options.json))


def report(*, as_json: bool = False) -> int:
    """Prints all findings.

    Args:
        as_json: Whether to print JSON instead of a list.

    Returns:
        1 if something required is missing, otherwise 0.
    """
    findings = []
    section = ""
    for finding in check_all():
        findings.append(finding)
        if as_json:
            continue
        if finding.section != section:
            print(f"{'' if not section else chr(10)}{finding.section}")
            section = finding.section
        print(f"  {finding.status:8} {finding.name}: {finding.detail}", flush=True)
        if finding.remedy:
            print(f"           -> {finding.remedy}", flush=True)
    missing = [finding.name for finding in findings if finding.status == "missing"]
    absent = [finding.name for finding in findings if finding.status == "absent"]
    if as_json:
        contents = {
            "ok": not missing,
            "findings": [dataclasses.asdict(finding) for finding in findings],
        }
        print(json.dumps(contents, indent=2))
    else:
        print()
        if missing:
            print(f"required and missing: {', '.join(missing)}")
        elif absent:
            print(f"ready; optional and missing: {', '.join(absent)}")
        else:
            print("ready")
    return 1 if missing else 0


def check_all() -> Iterator[Finding]:
    """Yields the results of all checks."""
    requirements = _load("requirements")
    way = requirements.installation()
    yield from _check_python(way)
    required = [(module, "") for module in requirements.REQUIRED]
    yield from _check_modules("simulation", _rows(requirements, required), required=True)
    yield _check_extension(requirements.install_command("flatland._core"))
    yield from _check_modules("tools", _rows(requirements, _OPTIONAL))
    if way == requirements.WHEEL:
        detail = "not required by a wheel; the ROS node and the Qt viewer need Debian and ROS"
        yield Finding("ROS", "ROS", "info", detail)
        return
    yield from _check_modules("ROS", _ROS)
    yield from _check_programs()
    yield _check_master()
    yield _check_own_address()
    yield from _check_display()


def _load(name: str) -> Any:
    """Returns a module of flatland that imports only the standard library.

    Args:
        name: Name of the module, such as `requirements`; loaded also if flatland cannot be
            imported.
    """
    path = Path(__file__).parents[1] / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"_flatland_{name}", path)
    assert spec is not None  # noqa: S101 - the file has the ending of a module
    assert spec.loader is not None  # noqa: S101
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # for its dataclasses
    spec.loader.exec_module(module)
    return module


def _rows(requirements: Any, modules: Sequence[tuple[str, str]]) -> list[tuple[str, str, str, str]]:
    """Adds the names of the packages and what installs them."""
    return [
        (module, requirements.PACKAGES[module].name, requirements.install_command(module), purpose)
        for module, purpose in modules
    ]


# -- Python --------------------------------------------------------------------------------


def _check_python(way: str) -> Iterator[Finding]:
    version = ".".join(map(str, sys.version_info[:3])) + f" ({sys.executable})"
    if sys.version_info >= _PYTHON:
        yield Finding("Python", "version", "ok", version)
    else:
        remedy = "Python 3.11 or later is required: " + _APT + "python3"
        yield Finding("Python", "version", "missing", version, remedy)
    in_venv = sys.prefix != sys.base_prefix
    yield Finding(
        "Python", "virtual environment", "info", sys.prefix if in_venv else "none is active"
    )
    yield Finding("Python", "installation", "info", way)
    spec = _find_spec("flatland")
    folder = str(Path(spec.origin).parent) if spec and spec.origin else ""
    remedy = f"{_SETUP}, then . ./setup.bash"
    yield _found("Python", "flatland", folder, "missing", "not importable", remedy)
    reason = "not on PATH; python3 -m flatland is the same"
    remedy = ". ./setup.bash, or activate the virtual environment"
    program = shutil.which("flatland")
    yield _found("Python", "command flatland", program, "absent", reason, remedy)


def _found(
    section: str, name: str, detail: str | None, status: str, reason: str, remedy: str
) -> Finding:
    """Returns the result of a check for something that is there if there is a detail about it.

    Args:
        section: See `Finding`.
        name: See `Finding`.
        detail: Version or path, None or empty if it is not there.
        status: Status if it is not there.
        reason: Detail if it is not there.
        remedy: What installs it.
    """
    if detail:
        return Finding(section, name, "ok", detail)
    return Finding(section, name, status, reason, remedy)


def _find_spec(module: str) -> Any:
    """Returns the spec of a module without importing flatland, which may be impossible."""
    if module.startswith("flatland."):
        parent = _find_spec("flatland")
        if parent is None or not parent.submodule_search_locations:
            return None
        return importlib.machinery.PathFinder.find_spec(
            module, list(parent.submodule_search_locations)
        )
    try:
        return importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None


def _check_modules(
    section: str, modules: Sequence[tuple[str, str, str, str]], *, required: bool = False
) -> Iterator[Finding]:
    failed = "missing" if required else "absent"
    results = _import([module for module, *_ in modules if _find_spec(module) is not None])
    for module, name, remedy, purpose in modules:
        purpose = f" (for: {purpose})" if purpose else ""
        if module not in results:
            yield Finding(section, name, failed, f"not installed{purpose}", remedy)
            continue
        works, text = results[module]
        if works:
            yield Finding(section, name, "ok", f"{text or 'installed'}{purpose}")
        else:
            cause, help_for_cause = _load("requirements").failure(module, text)
            yield Finding(section, name, failed, f"{cause}{purpose}", help_for_cause or remedy)


def _import(modules: Sequence[str]) -> dict[str, tuple[bool, str]]:
    """Imports modules in another process, since an import may crash or block.

    Returns:
        For each module, whether its import works, and its version or the error.
    """
    results: dict[str, tuple[bool, str]] = {}
    rest = list(modules)
    while rest:
        done = _run_python(_IMPORT_CODE, *rest)
        for line in done.stdout.splitlines():
            if line.startswith(_RESULT):
                module, works, text = json.loads(line.removeprefix(_RESULT))
                results[module] = (works, text)
        rest = [module for module in rest if module not in results]
        if rest:  # the first one ended the process
            reason = _last_line(done.stderr) or f"exit code {done.returncode}"
            results[rest.pop(0)] = (False, reason)
    return results


def _check_extension(remedy: str) -> Finding:
    name = "extension and Box2D"
    spec = _find_spec("flatland._core")
    if spec is None:
        detail = "flatland._core is not built for this Python"
        return Finding("simulation", name, "missing", detail, remedy)
    done = _run_python("from flatland.physics import BOX2D_VERSION; print(BOX2D_VERSION)")
    if done.returncode:
        detail = f"import fails: {_last_line(done.stderr)}"
        return Finding("simulation", name, "missing", detail, f"{_APT}libbox2d2, {remedy}")
    return Finding("simulation", name, "ok", f"Box2D {_last_line(done.stdout)} ({spec.origin})")


# -- ROS -----------------------------------------------------------------------------------


def _check_programs() -> Iterator[Finding]:
    for program, remedy in _PROGRAMS:
        yield _found("ROS", program, shutil.which(program), "absent", "not on PATH", remedy)
    if shutil.which("rospack"):
        done = _run(["rospack", "find", "flatland"])
        folder = "" if done.returncode else _last_line(done.stdout)
        reason = "not found in ROS_PACKAGE_PATH"
        remedy = ". ./setup.bash, or the setup.bash of the catkin workspace"
        yield _found("ROS", "ROS package flatland", folder, "absent", reason, remedy)


def _check_master() -> Finding:
    addresses = _load("ros_addresses")
    uri = os.environ.get("ROS_MASTER_URI", "")
    name = "ROS master"
    if not uri:
        return Finding("ROS", name, "info", "ROS_MASTER_URI is not set")
    try:
        host, port = addresses.master_address(uri)
    except ValueError as error:
        return Finding("ROS", name, "info", str(error), "set ROS_MASTER_URI")
    problem = addresses.connection_problem(host, port)
    if problem:
        detail = f"not running at {uri} ({problem}); roslaunch starts one"
        return Finding("ROS", name, "info", detail)
    return Finding("ROS", name, "info", f"running at {uri}")


def _check_own_address() -> Finding:
    """Checks whether other nodes can connect to a node of this machine."""
    addresses = _load("ros_addresses")
    name = "address of nodes"
    host, variable = addresses.own_host()
    source = f"from {variable}" if variable else "the name of this machine"
    detail = f'"{host}", {source}'
    problem = addresses.own_address_problem()
    try:
        master, _ = addresses.master_address(os.environ.get("ROS_MASTER_URI", ""))
    except ValueError:
        master = "localhost"
    if not problem and addresses.is_only_local(host, master):
        problem = f"only programs on this machine can use it, but the master is on {master}"
    if not problem:
        return Finding("ROS", name, "ok", detail)
    remedy = addresses.remedy(variable)
    return Finding("ROS", name, "absent", f"no program can connect to {detail}: {problem}", remedy)


# -- display -------------------------------------------------------------------------------


def _check_display() -> Iterator[Finding]:
    variables = [name for name in ("DISPLAY", "WAYLAND_DISPLAY") if os.environ.get(name)]
    remedy = "use the viewer in the browser: web:=true show_viz:=false, or flatland view"
    if not variables:
        detail = "DISPLAY is not set (for: Qt viewer and RViz)"
        yield Finding("display", "display", "absent", detail, remedy)
        return
    where = ", ".join(f"{name}={os.environ[name]}" for name in variables)
    if _find_spec("PyQt5") is None:
        yield Finding("display", "display", "info", f"{where}; not tested without PyQt5")
        return
    done = _run_python(_DISPLAY_CODE)
    lines = done.stdout.split("\n") if done.stdout else []
    if not lines:
        reason = _last_line(done.stderr) or f"exit code {done.returncode}"
        yield Finding("display", "display", "absent", f"{where}: {reason}", remedy)
        return
    yield Finding("display", "display", "ok", f"{where}, {lines[0]} pixels")
    version = lines[1] if len(lines) > 1 else ""
    reason = "no context can be created (for: Qt viewer and RViz)"
    yield _found("display", "OpenGL", version, "absent", reason, _APT + "libgl1-mesa-dri")


# -- programs ------------------------------------------------------------------------------


def _run_python(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    # -P: modules of the current folder and of the folder of this file do not hide others.
    environment = dict(os.environ)
    spec = _find_spec("flatland")
    if spec is not None and spec.origin:
        root = str(Path(spec.origin).parent.parent)
        paths = [path for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]
        environment["PYTHONPATH"] = os.pathsep.join([*paths, root])
    return _run([sys.executable, "-P", "-c", code, *arguments], environment)


def _run(
    command: list[str], environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(  # noqa: S603
            command,
            capture_output=True,
            text=True,
            errors="replace",
            stdin=subprocess.DEVNULL,
            timeout=_TIMEOUT,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "", f"no answer within {_TIMEOUT:g} s")
    except OSError as error:
        return subprocess.CompletedProcess(command, 1, "", str(error))


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1] if lines else ""


if __name__ == "__main__":
    sys.path.append(str(Path(__file__).resolve().parents[2]))
    sys.exit(report(as_json="--json" in sys.argv[1:]))
