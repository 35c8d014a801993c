"""Files and paths of other programs that are given in place of those of flatland."""

from __future__ import annotations

import re
from typing import Final

_MODEL: Final = "a model file is YAML, with bodies and footprints (docs/models.md)"
_WORLD: Final = "a world file is YAML, with layers and models (docs/worlds.md)"
_MAP: Final = "a map file is YAML, with an image or a data file of line segments (docs/worlds.md)"
_NOT_READ: Final = "which is not read here"

_XML: Final = r"\s*(?:<[?!].{0,3000}?)?"  # declaration and comments

# By the first bytes of the file, or by its text with spaces in place of line breaks.
_FILES: Final = (
    (r"#ROSBAG", f"a bag of ROS, {_NOT_READ}"),
    (r"SQLite format 3", f"a database, such as a bag of ROS 2, {_NOT_READ}"),
    (r"\x89MCAP", f"a bag of ROS 2, {_NOT_READ}"),
    (r"#VRML", f"a file of VRML, such as a world of Webots; {_WORLD}"),
    (r"%PDF", f"a PDF document; save it as an image, and name that in a map file; {_MAP}"),
    (r"PK\x03\x04|\x1f\x8b|BZh|\xfd7zXZ", "a compressed archive; extract it first"),
    (_XML + r"<robot\b[^>]{0,2000}xmlns:xacro", f"a xacro file of a robot; {_MODEL}"),
    (_XML + r"<robot\b", f"a URDF file of a robot; {_MODEL}"),
    (_XML + r"<(?:sdf|gazebo|world)\b", f"an SDF file of Gazebo; {_WORLD}, and {_MODEL}"),
    (
        _XML + r"<launch\b|(?:#!|import |from |\"\"\").{0,3000}?\bLaunchDescription\b",
        "a launch file; give the world file that its argument world_path names",
    ),
    (_XML + r"<mujoco\b", f"an MJCF file of MuJoCo; {_MODEL}"),
    (_XML + r"<svg\b", f"an SVG drawing; export it as a PNG image; {_MAP}"),
    (r"\s*<(?:!DOCTYPE html|html)", "a web page; download the file itself instead"),
    (r"\s*<(?:\?xml|\w+[\s>])", f"an XML file, {_NOT_READ}"),
    (
        r"\s*type\s+octile\b",
        f"a map of the Moving AI benchmarks; convert it to an image, with white free cells; {_MAP}",
    ),
    (
        r"(?:\s*#[^\n]*\n|\s)*(?:define\s+\w+\s+\w+\s*\(|include\s+\"[^\"]*\.inc\")",
        f"a world file of Stage; {_WORLD}",
    ),
    (r"(?:#!|import |from \w+ import )", f"a Python program, {_NOT_READ}"),
    (
        r"(?:\s*#[^\n]*\n|\s)*(?!- )[\w.+ \"-]+(?:[,;][\w.+ \"-]*){2,}(?:[\r\n]|$)",
        "a table with commas (CSV); line segments are written as x1 y1 x2 y2, with spaces, in "
        "a data file that a map file names",
    ),
)
_ESCAPED: Final = (
    "in double quotes, a backslash begins an escape sequence: separate the parts of a path by /, "
    "or use single quotes"
)
_SCHEME: Final = r"(?:^|/)(package|model|file|https?|ftp):/+(.*)"
_SUBSTITUTION: Final = r"\$\((find|dirname|arg|env|optenv|find-pkg-share|var)\b"
_VARIABLE: Final = r"\$\{?(\w+)"
_CONTROL: Final = r"[\x01-\x1f\x7f]"


def foreign_file(content: bytes) -> str:
    """Returns what a file of another program is, and what is required instead.

    Args:
        content: The content, or its first 4096 bytes.

    Returns:
        A hint, empty for a file that is not recognized.
    """
    start = content[:4096]
    for pattern, text in _FILES:
        if re.match(pattern.encode(), start, re.DOTALL):  # compiled late: only mistakes need it
            return f"this is {text}"
    return ""


def foreign_path(path: str) -> str:
    """Returns why a path with the notation of another program names no file, otherwise empty.

    Args:
        path: A file that does not exist.
    """
    if re.search(_CONTROL, path):
        return _ESCAPED
    relative = "write a path relative to the folder of the file, or an absolute one"
    scheme = re.search(_SCHEME, path)
    if scheme is not None:
        name, rest = scheme.groups()
        if name == "file":
            return f'paths have no scheme: "/{rest}"'
        if name in ("package", "model"):
            return f"{name}:// is not resolved; {relative}"
        return f"files are not downloaded, as {name}:// requires; {relative}"
    if match := re.search(_SUBSTITUTION, path):
        return f"$({match[1]} ...) is replaced in launch files only; {relative}"
    if match := re.search(_VARIABLE, path):
        return f'variables are not replaced; use $eval env("{match[1]}") .. "/...", or {relative}'
    return ""


def escape_error(why: str) -> str:
    """Returns a hint for an error of the YAML parser about an escape sequence, otherwise empty."""
    return _ESCAPED if "escape" in why or "hexdecimal" in why else ""
