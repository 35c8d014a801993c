"""The included controllers, and how a controller is found by its name."""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import os
import re
import shlex
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from flatland.errors import FlatlandError
from flatland.foreign_texts import text_of
from flatland.scenarios.controllers.dynamic_window import DynamicWindow
from flatland.scenarios.controllers.pursuit import PurePursuit
from flatland.scenarios.controllers.random_walk import RandomWalk
from flatland.scenarios.controllers.reactive import Gap, Straight
from flatland.scenarios.interrupts import user_interrupts
from flatland.scenarios.stack_options import RosVersion, StackCommand

if TYPE_CHECKING:
    from types import ModuleType

    from flatland.geometry import Pose, Vector2
    from flatland.scenarios.task import Controller, Scan, Task
    from flatland.values import Twist

INCLUDED: Final[dict[str, type[Controller]]] = {
    "straight": Straight,
    "gap": Gap,
    "pursuit": PurePursuit,
    "dynamic_window": DynamicWindow,
    "random": RandomWalk,
}
POLICY: Final = "policy"
"""Name of the included policy, which requires the extra `onnx`."""
_POLICY_FILE: Final = ".onnx"
_COMMAND: Final = "command:"
_ROS1_FILE: Final = ".launch"
_ROS2_FILE: Final = re.compile(r"[._]launch\.(py|xml|yaml)$")
_CLIENTS: Final[dict[RosVersion, str]] = {1: "rospy", 2: "rclpy"}
# The nodes end soon after a request; all their output is shown.
_ROSLAUNCH: Final = (
    *("roslaunch", "--screen", "--skip-log-check", "--disable-title", "--no-summary"),
    *("--sigint-timeout=2", "--sigterm-timeout=1"),
)
# Of two values of an argument, the last one is taken: that of the user.
_ROS2_LAUNCH: Final = ("launch", "--noninteractive", "--show-all-subprocesses-output")
_ROS2_ARGUMENT: Final = "use_sim_time:=true"


class ControllerError(FlatlandError):
    """A controller does not exist, or cannot be imported."""

    prefix = "Flatland controller: "


class FunctionController:
    """A function `command(scan, pose, goal)` as a controller."""

    def __init__(self, function: Callable[[Scan, Pose, Vector2], Twist], task: Task) -> None:  # noqa: ARG002
        self.command = function


def find_controller(name: str, folder: str) -> Callable[[Task], Any] | StackCommand:
    """Returns the class of a controller, what creates that of a function, or what starts nodes.

    Args:
        name: Name of an included controller, `policy`, `FILE.onnx`, `FILE.py:NAME`, `MODULE:NAME`,
            `FILE.launch ARGUMENTS`, `FILE.launch.py ARGUMENTS` (or `.xml`, `.yaml`) or
            `command: PROGRAM ARGUMENTS`.
        folder: Folder that a relative path of a file starts from; empty for the current one.

    Raises:
        ControllerError: It does not exist or is not a controller.
    """
    try:
        return _find(name, folder)
    except ControllerError as error:
        if "," not in name or name.startswith(_COMMAND):
            raise
        hint = "commas separate only names without arguments; give --robot once for each controller"
        raise ControllerError(error.message, hint=hint) from error


def _find(name: str, folder: str) -> Callable[[Task], Any] | StackCommand:
    included = INCLUDED.get(name)
    if included is not None:
        return included
    stack = _stack_command(name, folder)
    if stack is not None:
        return stack
    if name == POLICY or name.endswith(_POLICY_FILE):
        return _load_policy(name, folder)
    module_name, colon, attribute = name.rpartition(":")
    if not (colon and module_name and attribute):
        raise ControllerError(
            f"{name!r} does not exist; included are {', '.join([*INCLUDED, POLICY])}, others are "
            "given as FILE.py:NAME, MODULE:NAME, FILE.onnx, 'FILE.launch ARGUMENTS', "
            "'FILE.launch.py ARGUMENTS' or 'command: PROGRAM ARGUMENTS'"
        )
    with user_interrupts() as is_interrupted:
        try:
            if module_name.endswith(".py"):
                module = _load_file(Path(folder, module_name).expanduser())
            else:
                if str(Path(folder).absolute()) not in sys.path:
                    sys.path.append(str(Path(folder).absolute()))
                module = importlib.import_module(module_name)
            found: Any = getattr(module, attribute, None)
        except ControllerError:
            raise
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt) and is_interrupted():
                raise
            raise ControllerError(
                f"{name!r}: {type(error).__name__}: {text_of(error)}, while it was imported"
            ) from error
    if isinstance(found, type) and callable(getattr(found, "command", None)):
        return found
    if callable(found) and not isinstance(found, type):
        return functools.partial(FunctionController, found)
    raise ControllerError(
        f"{name!r}: {module_name} has no function {attribute}, and no class {attribute} with a "
        "method command"
    )


def split_names(text: str, folder: str) -> list[str]:
    """Returns the controllers of a text in which commas may separate names.

    A program or a launch file with arguments is one controller, and keeps its commas; so does the
    path of an existing file.

    Args:
        text: The text, such as `gap,my.py:Mine` or `stack.launch topics:=[a,b]`.
        folder: Folder that relative paths start from; empty for the current one.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    whole = text.strip()
    has_arguments = whole.startswith(_COMMAND) or any(len(name.split()) > 1 for name in names)
    paths = [path for path in (whole, whole.rpartition(":")[0]) if "," in path]
    # Not `Path.is_file`, which raises an error if a list of names is too long for a path.
    is_file = any(os.path.isfile(Path(folder, path)) for path in paths)  # noqa: PTH113
    return [whole] if has_arguments or is_file else names


def is_stack(name: str) -> bool:
    """Returns whether a controller consists of ROS nodes."""
    return name.startswith(_COMMAND) or _version_of_file(_first_word(name)) is not None


def _first_word(name: str) -> str:
    """Returns the file of a controller with arguments, which are quoted as in a shell."""
    try:
        return next(iter(shlex.split(name)), "")
    except ValueError:
        return name.split(" ", 1)[0]


def _version_of_file(name: str) -> RosVersion | None:
    """Returns the version of ROS of a launch file, None for another file."""
    if name.endswith(_ROS1_FILE):
        return 1
    return 2 if _ROS2_FILE.search(name) else None


def _stack_command(name: str, folder: str) -> StackCommand | None:
    """Returns what starts nodes; None for the name of another controller.

    Raises:
        ControllerError: The file does not exist, the arguments are not those of a shell, or ROS is
            not installed.
    """
    if not is_stack(name):
        return None
    try:
        words = shlex.split(name.removeprefix(_COMMAND))
    except ValueError as error:
        raise ControllerError(f"{name!r}: {error}") from error
    if name.startswith(_COMMAND):
        if not words:
            raise ControllerError(f"{name!r}: expected a program after {_COMMAND!r}")
        return StackCommand(tuple(words), "", folder, _installed_version(name))
    file = Path(folder, words[0]).expanduser().absolute()
    if not file.is_file():
        raise ControllerError(f"file not found: {file}")
    version = _version_of_file(words[0]) or 1
    client = _CLIENTS[version]
    if importlib.util.find_spec(client) is None:
        raise ControllerError(
            f"{name!r}: {client} is not installed in {sys.executable}, which launch files of "
            f"ROS {version} require"
        )
    if version == 1:
        return StackCommand((*_ROSLAUNCH, str(file), *words[1:]), str(file), folder, 1)
    program = shutil.which("ros2")
    if program is None:
        raise ControllerError(f"{name!r}: the program ros2, which starts it, is not on PATH")
    command = (program, *_ROS2_LAUNCH, str(file), _ROS2_ARGUMENT, *words[1:])
    return StackCommand(command, str(file), folder, 2)


def _installed_version(name: str) -> RosVersion:
    """Returns the version of ROS that this Python is connected to.

    Raises:
        ControllerError: There is none, or it is not known which of two is meant.
    """
    found = [version for version, client in _CLIENTS.items() if importlib.util.find_spec(client)]
    if len(found) > 1:
        chosen = os.environ.get("ROS_VERSION", "")
        found = [version for version in found if str(version) == chosen]
        if not found:
            raise ControllerError(
                f"{name!r}: rospy and rclpy are installed; set ROS_VERSION to 1 or 2, not "
                f"{chosen!r}"
            )
    if not found:
        raise ControllerError(
            f"{name!r}: neither rospy nor rclpy is installed in {sys.executable}; nodes require one"
        )
    return found[0]


def controller_digest(name: str, folder: str) -> str:
    """Returns a hash of the file of a controller, empty for a controller that is not in a file.

    Raises:
        ControllerError: The controller does not exist.
    """
    found = find_controller(name, folder)
    if isinstance(found, StackCommand):
        return hashlib.sha256(Path(found.file).read_bytes()).hexdigest()[:32] if found.file else ""
    path = name if name.endswith(_POLICY_FILE) else name.rpartition(":")[0]
    if not path.endswith((".py", _POLICY_FILE)):
        return ""
    return hashlib.sha256(Path(folder, path).expanduser().read_bytes()).hexdigest()[:32]


def _load_policy(name: str, folder: str) -> Callable[[Task], Any]:
    # Imported here, since it requires optional packages.
    try:
        policies = importlib.import_module("flatland.scenarios.policies")
        file = None if name == POLICY else Path(folder, name).expanduser()
        create: Callable[[Task], Any] = policies.file_controller(file)
    except FlatlandError as error:
        raise ControllerError(f"{name!r}: {error}") from error
    return create


def _load_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise ControllerError(f"file not found: {path}")
    path = path.resolve()
    # Each file is loaded once per process.
    name = f"flatland_controller_{hashlib.sha256(bytes(path)).hexdigest()[:16]}"
    known = sys.modules.get(name)
    if known is not None:
        return known
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ControllerError(f"file cannot be loaded: {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
