"""Follows a page of the documentation: writes its files, runs its commands, compares their output.

A block after ``File `path`:`` is a file, a block after ``Add to `path`:`` is its next part. `bash`
blocks are run in one shell, in order, after the files above them have been written; a block after
`<!-- leave running -->` is run in a separate terminal until the next such block, a block after
`<!-- leave running: also -->` in addition to the previous one. A `text` block is the output of the
commands above it, where `...` matches any text.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from programs import output_of

_BLOCK = re.compile(
    r"(?:^(?P<how>File|Add to) `(?P<path>[^`]+)`:\n\n"
    r"|^(?P<background><!-- leave running(?P<also>: also)? -->)\n)?"
    r"^```(?P<language>\w+)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """One block of a page.

    Attributes:
        kind: `file`, `part`, `run`, `background`, `also` or `prints`.
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
            kind = ("also" if match["also"] else "background") if match["background"] else "run"
            blocks.append(Block(kind, text))
        elif match["language"] == "text":
            blocks.append(Block("prints", text))
    return blocks


def code_blocks(text: str, language: str) -> list[str]:
    """Returns the blocks of a language, such as `python`, in the text of a page."""
    return [match["text"] for match in _BLOCK.finditer(text) if match["language"] == language]


def joined(before: str, part: str) -> str:
    """Appends a part to a file, with the blank lines that PEP 8 requires."""
    first = part.split("\n", 1)[0]
    if re.match(r"(@|class |def )", first):
        return f"{before}\n\n{part}"
    return f"{before}\n{part}" if re.match(r" +(@|class |def )", first) else before + part


def pattern_of(text: str) -> str:
    """Returns a regular expression for the text of a block."""
    return re.escape(text.strip()).replace(r"\.\.\.", ".*?")


# What rostopic prints if it receives nothing for two seconds, as on a busy machine.
_DELAY = (
    "WARNING: no messages received and simulated time is active.",
    "Is /clock being published?",
)


def assert_printed(expected: str, printed: str) -> None:
    """Compares the output of a command with the page.

    Trailing white space and warnings of a delay are ignored.
    """
    lines = [line.rstrip() for line in printed.strip().splitlines()]
    lines = [line for line in lines if line not in _DELAY]
    assert re.fullmatch(pattern_of(expected), "\n".join(lines), re.DOTALL), (
        f"expected by the page:\n{expected}\nprinted:\n{printed}"
    )


class Shell:
    """A shell that keeps its working directory and exported variables between commands."""

    def __init__(self, environment: Mapping[str, str], folder: Path) -> None:
        self._folder = folder
        (folder / "cwd").write_text(environment["HOME"])
        exports = [f"export {name}={shlex.quote(value)}" for name, value in environment.items()]
        (folder / "exports").write_text("\n".join(exports))

    @property
    def working_directory(self) -> Path:
        """Folder in which the next command runs."""
        return Path((self._folder / "cwd").read_text().strip())

    def script(self, commands: str) -> list[str]:
        """Returns a command line that runs commands in the state left by the previous ones."""
        begin = f'. {self._folder}/exports\ncd "$(cat {self._folder}/cwd)"\n'
        end = f"pwd >{self._folder}/cwd\nexport -p >{self._folder}/exports\n"
        path = self._folder / "script"
        path.write_text(f"{begin}set -e\n{commands}{end}")
        return ["env", "-i", "bash", str(path)]

    def background_script(self, command: str) -> list[str]:
        """Returns a command line that replaces itself by a command, for a separate terminal."""
        path = self._folder / f"background{len(list(self._folder.glob('background*.sh')))}.sh"
        exports = (self._folder / "exports").read_text()
        # Variables in front of the command are part of it.
        path.write_text(
            f"{exports}\ncd {shlex.quote(str(self.working_directory))}\nexec env {command}"
        )
        return ["env", "-i", "bash", str(path)]

    def run(self, commands: str) -> str:
        """Runs commands and returns their output."""
        return output_of(self.script(commands), {"PATH": "/usr/bin:/bin"}, self._folder)


def follow(blocks: Sequence[Block], shell: Shell, start: Callable[..., Any]) -> None:
    """Follows a page.

    Args:
        blocks: The blocks of the page.
        shell: Runs the commands; files are written to its working directory.
        start: Starts a program, as `start(command, environment)`.
    """
    background: list[Any] = []
    printed: str | None = None
    for block in blocks:
        path = shell.working_directory / block.path
        if block.kind == "file":
            path.write_text(block.text)
        elif block.kind == "part":
            path.write_text(joined(path.read_text(), block.text))
        elif block.kind == "run":
            printed = shell.run(block.text)
        elif block.kind in ("background", "also"):
            if block.kind == "background":
                while background:
                    background.pop().stop()
            command = shell.background_script(block.text)
            background.append(start(command, {"PATH": "/usr/bin:/bin"}))
            printed = None
        elif printed is None:
            background[-1].wait_for_line(pattern_of(block.text))
        else:
            assert_printed(block.text, printed)
