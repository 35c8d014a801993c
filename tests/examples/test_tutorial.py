"""Follows docs/write_a_plugin.md: writes its files, runs its commands and compares their output.

A block after ``File `path`:`` is a file, a block after ``Add to `path`:`` is its next part. `bash`
blocks are run in one shell, in order, after the files above them have been written; a block after
`<!-- leave running -->` is run in a separate terminal until the next such block. A `text` block is
the output of the commands above it, where `...` matches any text.
"""

from __future__ import annotations

import re
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from waiting import BUILD_TIMEOUT

_BLOCK = re.compile(
    r"(?:^(?P<how>File|Add to) `(?P<path>[^`]+)`:\n\n|^(?P<background><!-- leave running -->)\n)?"
    r"^```(?P<language>\w+)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
_PACKAGE = "robot_ws/src/my_robots"  # in the home folder, created by the first commands of the page
_NOT_IN_THE_PAGE = {"README.md"}


@dataclass(frozen=True)
class Block:
    """One block of the page.

    Attributes:
        kind: `file`, `part`, `run`, `background` or `prints`.
        text: The contents.
        path: Path of a file or part.
    """

    kind: str
    text: str
    path: str = ""


def read_page(page: Path) -> list[Block]:
    """Returns the files, commands and outputs of the page."""
    blocks = []
    for match in _BLOCK.finditer(page.read_text()):
        text = match["text"]
        if match["how"]:
            kind = "file" if match["how"] == "File" else "part"
            blocks.append(Block(kind, text, match["path"]))
        elif match["language"] == "bash":
            blocks.append(Block("background" if match["background"] else "run", text))
        elif match["language"] == "text":
            blocks.append(Block("prints", text))
    return blocks


def joined(before: str, part: str) -> str:
    """Appends a part to a file, with the blank lines that PEP 8 requires."""
    first = part.split("\n", 1)[0]
    if re.match(r"(@|class |def )", first):
        return f"{before}\n\n{part}"
    return f"{before}\n{part}" if re.match(r" +(@|class |def )", first) else before + part


def assert_printed(expected: str, printed: str) -> None:
    """Compares the output of a command with the page; trailing white space is ignored."""
    lines = [line.rstrip() for line in printed.strip().splitlines()]
    pattern = re.escape(expected.strip()).replace(r"\.\.\.", ".*?")
    assert re.fullmatch(pattern, "\n".join(lines), re.DOTALL), (
        f"expected by the page:\n{expected}\nprinted:\n{printed}"
    )


@pytest.fixture(scope="module")
def blocks(checkout: Path) -> list[Block]:
    return read_page(checkout / "docs" / "write_a_plugin.md")


def test_the_page_contains_the_example_package(blocks, example):
    files: dict[str, str] = {}
    for block in blocks:
        if block.kind == "file":
            files[block.path] = block.text
        elif block.kind == "part":
            files[block.path] = joined(files[block.path], block.text)
    shipped = {
        str(path.relative_to(example)): path.read_text()
        for path in example.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert sorted(files) == sorted(set(shipped) - _NOT_IN_THE_PAGE)
    for path, text in files.items():
        assert text == shipped[path], f"{path} differs from the page"


class Shell:
    """A shell that keeps its working directory and exported variables between commands."""

    def __init__(self, environment: dict[str, str], folder: Path, run) -> None:
        self._folder = folder
        self._run_command = run
        (folder / "cwd").write_text(environment["HOME"])
        exports = [f"export {name}={shlex.quote(value)}" for name, value in environment.items()]
        (folder / "exports").write_text("\n".join(exports))

    def script(self, commands: str) -> list[str]:
        """Returns a command line that runs commands in the state left by the previous ones."""
        begin = f'. {self._folder}/exports\ncd "$(cat {self._folder}/cwd)"\n'
        end = f"pwd >{self._folder}/cwd\nexport -p >{self._folder}/exports\n"
        path = self._folder / "script"
        path.write_text(f"{begin}set -e\n{commands}{end}")
        return ["env", "-i", "bash", str(path)]

    def run(self, commands: str) -> str:
        """Runs commands and returns their output."""
        printed: str = self._run_command(
            self.script(commands), {"PATH": "/usr/bin:/bin"}, self._folder
        )
        return printed


@pytest.mark.ros
@pytest.mark.build
@pytest.mark.timeout(BUILD_TIMEOUT)
def test_the_commands_of_the_page_print_the_documented_output(
    blocks, environment, tmp_path, run_command, start
):
    for program in ("roslaunch", "catkin_make", "rospack"):
        if shutil.which(program, path=environment["PATH"]) is None:
            pytest.skip(f"{program} is not installed")
    package = Path(environment["HOME"]) / _PACKAGE
    shell = Shell(environment, tmp_path, run_command)
    background = None
    printed: str | None = None
    for block in blocks:
        path = package / block.path
        if block.kind == "file":
            path.write_text(block.text)
        elif block.kind == "part":
            path.write_text(joined(path.read_text(), block.text))
        elif block.kind == "run":
            printed = shell.run(block.text)
        elif block.kind == "background":
            if background is not None:
                background.stop()
            background = start(shell.script(f"exec {block.text}"), {"PATH": "/usr/bin:/bin"})
            printed = None
        elif printed is None:
            background.wait_for(re.escape(block.text.strip()).replace(r"\.\.\.", ".*?"))
        else:
            assert_printed(block.text, printed)
