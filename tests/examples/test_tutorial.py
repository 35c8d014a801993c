"""Follows docs/write_a_plugin.md: writes its files, types its commands, compares what they print.

How the page is read: a block after ``File `path`:`` is a file, one after ``Add to `path`:`` its
next part. Each `bash` block is typed in one shell, in order, after the files above it were
written; one after `<!-- leave running -->` in a terminal of its own, until the next such one. A
`text` block is what the commands above it print, with `...` for anything.
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
_PACKAGE = "robot_ws/src/my_robots"  # in the user's home, as the page's first commands make it
_NOT_IN_THE_PAGE = {"README.md"}


@dataclass(frozen=True)
class Block:
    """One block of the page.

    Attributes:
        kind: `file`, `part`, `run`, `background` or `prints`.
        text: What stands in it.
        path: Of a file or part.
    """

    kind: str
    text: str
    path: str = ""


def read_page(page: Path) -> list[Block]:
    """Reads the blocks of the page that mean something here."""
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
    """Adds a part to a file, with the empty lines that Python's style asks for."""
    first = part.split("\n", 1)[0]
    if re.match(r"(@|class |def )", first):
        return f"{before}\n\n{part}"
    return f"{before}\n{part}" if re.match(r" +(@|class |def )", first) else before + part


def assert_printed(expected: str, printed: str) -> None:
    """Compares what a command printed with what the page says; trailing blanks do not count."""
    lines = [line.rstrip() for line in printed.strip().splitlines()]
    pattern = re.escape(expected.strip()).replace(r"\.\.\.", ".*?")
    assert re.fullmatch(pattern, "\n".join(lines), re.DOTALL), (
        f"the page says\n{expected}\nbut this was printed:\n{printed}"
    )


@pytest.fixture(scope="module")
def blocks(checkout: Path) -> list[Block]:
    return read_page(checkout / "docs" / "write_a_plugin.md")


def test_the_page_holds_the_example_package(blocks, example):
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
    """A user's shell: where it is and what it exports lives on from one command to the next."""

    def __init__(self, environment: dict[str, str], folder: Path, run) -> None:
        self._folder = folder
        self._run = run
        (folder / "cwd").write_text(environment["HOME"])
        exports = [f"export {name}={shlex.quote(value)}" for name, value in environment.items()]
        (folder / "exports").write_text("\n".join(exports))

    def script(self, commands: str) -> list[str]:
        """A command line that runs commands where the last ones have led to."""
        begin = f'. {self._folder}/exports\ncd "$(cat {self._folder}/cwd)"\n'
        end = f"pwd >{self._folder}/cwd\nexport -p >{self._folder}/exports\n"
        path = self._folder / "script"
        path.write_text(f"{begin}set -e\n{commands}{end}")
        return ["env", "-i", "bash", str(path)]

    def type(self, commands: str) -> str:
        """Runs commands and returns what they printed."""
        printed: str = self._run(self.script(commands), {"PATH": "/usr/bin:/bin"}, self._folder)
        return printed


@pytest.mark.ros
@pytest.mark.build
@pytest.mark.timeout(BUILD_TIMEOUT)
def test_a_user_who_follows_the_page_gets_what_it_shows(
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
            printed = shell.type(block.text)
        elif block.kind == "background":
            if background is not None:
                background.stop()
            background = start(shell.script(f"exec {block.text}"), {"PATH": "/usr/bin:/bin"})
            printed = None
        elif printed is None:
            background.wait_for(re.escape(block.text.strip()).replace(r"\.\.\.", ".*?"))
        else:
            assert_printed(block.text, printed)
