"""The packages that flatland requires or can use, what installs them, and the check at its import.

The module imports only the standard library: `flatland doctor` loads it without flatland.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final


@dataclass(frozen=True, slots=True)
class Package:
    """A package and what installs it.

    Attributes:
        name: Its name.
        debian: Packages of Debian, empty if there are none.
        pip: Packages for pip, empty if there are none.
        extra: The extra of flatland-sim that contains it, empty if it is required or there is none.
    """

    name: str
    debian: str = ""
    pip: str = ""
    extra: str = ""


PACKAGES: Final = {
    "numpy": Package("numpy", "python3-numpy", "numpy"),
    "yaml": Package("PyYAML", "python3-yaml", "PyYAML"),
    "lupa": Package("lupa", "python3-lupa", "lupa"),
    "PIL": Package("Pillow", "python3-pil", "Pillow"),
    "tqdm": Package("tqdm", "python3-tqdm", "tqdm"),
    "argcomplete": Package("argcomplete", "python3-argcomplete", "argcomplete"),
    "aiohttp": Package("aiohttp", "python3-aiohttp", "aiohttp"),
    "matplotlib": Package("matplotlib", "python3-matplotlib", "matplotlib", "draw"),
    "cv2": Package("OpenCV", "python3-opencv", "opencv-python-headless", "opencv"),
    "gymnasium": Package("Gymnasium", "", "gymnasium", "gym"),
    "pettingzoo": Package("PettingZoo", "", "pettingzoo", "gym"),
    "onnxruntime": Package("ONNX Runtime", "", "onnxruntime", "onnx"),
    "stable_baselines3": Package("stable-baselines3", "", "stable-baselines3", "learning"),
    "pyarrow": Package("pyarrow", "", "pyarrow", "ray"),
    "ray": Package("Ray", "", "ray", "ray"),
    "mcap_ros1": Package("mcap-ros1-support", "", "mcap mcap-ros1-support", "mcap"),
    "rosbag": Package("rosbag", "python3-rosbag"),
    "tf2_msgs": Package(
        "the messages of ROS", "python3-tf2-msgs python3-nav-msgs python3-sensor-msgs"
    ),
}
"""By the name of the module."""

REQUIRED: Final = ("numpy", "yaml", "lupa", "PIL")

_ABI_VERSION: Final = 2
"""The version of numpy with which modules that were built for earlier ones cannot be imported."""
# What numpy and modules that were built for another version of it raise.
_OTHER_ABI: Final = re.compile(
    r"numpy\.(core|_core)\.\w+ failed to import|_ARRAY_API not found|_UFUNC_API not found"
    r"|binary incompatibility|compiled (using|against).*(NumPy|ABI|API)",
    re.IGNORECASE,
)
DEBIAN: Final = "Debian and ROS"
CATKIN: Final = "catkin workspace"
WHEEL: Final = "wheel"
_BUILDS: Final = {
    DEBIAN: "make setup in the clone of flatland",
    CATKIN: "catkin_make in the workspace",
    WHEEL: "pip install --force-reinstall of the wheel or of the clone",
}


def installation() -> str:
    """Returns the way in which flatland was installed: `DEBIAN`, `CATKIN` or `WHEEL`.

    A clone counts as Debian, as does an environment that finds the packages of ROS.
    """
    spec = importlib.util.find_spec("flatland")
    package = Path(spec.origin).parent if spec and spec.origin else Path(__file__).parent
    if any((space / ".catkin").is_file() for space in package.parents[3:4]):
        return CATKIN
    is_clone = (package.parent / "pyproject.toml").is_file()
    return DEBIAN if is_clone or importlib.util.find_spec("rospy") is not None else WHEEL


def install_command(module: str) -> str:
    """Returns the command that installs a module of `PACKAGES` or the extension."""
    way = installation()
    if module == "flatland._core":
        return _BUILDS[way]
    package = PACKAGES[module]
    if package.debian and (way != WHEEL or not package.pip):
        return f"apt-get install {package.debian}"
    # Without a wheel, pip does not know flatland and its extras.
    if package.extra and way != CATKIN:
        return f'pip install "flatland-sim[{package.extra}]"'
    return f"pip install {package.pip}"


def failure(module: str, reason: str) -> tuple[str, str]:
    """Returns why a module cannot be imported, and the command that helps.

    Args:
        module: Name of the module; its package need not be one of `PACKAGES`.
        reason: Text of the exception that its import raised.

    Returns:
        The cause, such as `not installed`, and the command; empty for an unknown package.
    """
    package = module.partition(".")[0]
    folder = _folder_of(package)
    if not folder:
        return "not installed", install_command(package) if package in PACKAGES else ""
    if _OTHER_ABI.search(reason) and package != "numpy":
        version = importlib.metadata.version("numpy")
        if int(version.partition(".")[0]) >= _ABI_VERSION:
            remedy = f'pip install "numpy<{_ABI_VERSION}"'
        else:
            remedy = f"pip install --force-reinstall {package}"
        return (
            f"installed in {folder}, but its binary interface does not fit numpy {version} in "
            f"{_folder_of('numpy')}",
            remedy,
        )
    return f"installed in {folder}, but its import fails: {reason}", _reinstall_command(package)


def _folder_of(package: str) -> str:
    """Returns the folder that contains an installed package, empty for none."""
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return ""
    if spec is None:
        return ""
    places = [spec.origin] if spec.origin else list(spec.submodule_search_locations or [""])
    path = Path(places[0])
    return str(path.parent.parent if path.name == "__init__.py" else path.parent)


def _reinstall_command(package: str) -> str:
    """Returns the command that installs a package again, empty for an unknown one."""
    if package not in PACKAGES:
        return ""
    command = install_command(package)
    option = "--reinstall" if command.startswith("apt-get") else "--force-reinstall"
    return command.replace(" install ", f" install {option} ", 1)


def check_requirements() -> None:
    """Checks that the required modules exist.

    Raises:
        ImportError: Some are missing; the text names the command that installs them.
    """
    names = (*REQUIRED, "flatland._core")
    missing = [name for name in names if importlib.util.find_spec(name) is None]
    if not missing:
        return
    folder = Path(__file__).parent
    hidden = _hidden_package(folder)
    if missing == ["flatland._core"] and hidden is not None:
        raise ImportError(
            f"{folder} has no extension (flatland._core) and hides the installed {hidden}: run "
            "Python in another folder or as python -P, or run make setup in this one",
            name=missing[0],
        )
    remedies = "; ".join(f"{name}: {install_command(name)}" for name in missing)
    raise ImportError(
        f"flatland requires modules that are not installed ({remedies}); for details, run "
        f"python3 {folder / 'cli' / 'doctor.py'}",
        name=missing[0],
    )


def _hidden_package(folder: Path) -> Path | None:
    """Returns a package later on the search path that has its extension, None if there is none."""
    for entry in sys.path:
        package = Path(entry, folder.name)
        if package.resolve() != folder.resolve() and any(package.glob("_core.*so")):
            return package
    return None
