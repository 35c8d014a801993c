"""Files that commands write."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flatland.cli.contents import counted
from flatland.extras import missing
from flatland.output_files import check_outputs, replaced

if TYPE_CHECKING:
    from flatland.node.message_recorder import MessageRecorder


def path_with(suffixes: Sequence[str]) -> Callable[[str], Path]:
    """Returns a conversion of paths with certain suffixes, such as `.bag`."""

    def path(text: str) -> Path:
        if Path(text).suffix.lower() not in suffixes:
            raise argparse.ArgumentTypeError(f"must end with {' or '.join(suffixes)}, got {text!r}")
        return Path(text)

    return path


def recording_arguments() -> argparse.ArgumentParser:
    """Returns a parser of the arguments of all commands that record messages."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument(
        "--bag",
        type=path_with((".bag",)),
        metavar="FILE",
        help="bag file (ROS 1) with all outputs and transforms; an existing file is replaced",
    )
    parser.add_argument(
        "--mcap",
        type=path_with((".mcap",)),
        metavar="FILE",
        help="MCAP file with all outputs and transforms as ROS 1 messages; an existing file is "
        "replaced",
    )
    return parser


class Recordings:
    """The files with messages that the options of a command name.

    Attributes:
        recorders: Observers of the world, by the path of their file.
    """

    def __init__(self, options: argparse.Namespace, files: ExitStack) -> None:
        """Creates the files.

        Args:
            options: Options of `recording_arguments`.
            files: Closes the files; removes them if an exception is raised.

        Raises:
            FlatlandError: A folder does not exist, or a required package is not installed.
            OSError: A file cannot be created.
        """
        self.recorders: dict[Path, MessageRecorder] = {}
        check_outputs(options.bag, options.mcap)
        for path, create in ((options.bag, _create_bag), (options.mcap, _create_mcap)):
            if path is not None:
                recorder = create(files.enter_context(replaced(path)))
                files.callback(recorder.close)
                self.recorders[path] = recorder

    def close(self) -> None:
        """Completes the files, and prints what they contain."""
        for path, recorder in self.recorders.items():
            recorder.close()
            topics = counted(len(recorder.topics), "topic")
            print(f"wrote {path}: {counted(recorder.messages, 'message')}, {topics}")


def _create_bag(path: Path) -> MessageRecorder:
    recorder: MessageRecorder = _message_recorder("bags need").record_bag(path)
    return recorder


def _create_mcap(path: Path) -> MessageRecorder:
    recorder: MessageRecorder = _message_recorder("MCAP files need").record_mcap(path)
    return recorder


def _message_recorder(need: str) -> Any:
    try:
        from flatland.ros import message_recorder
    except ImportError as error:
        raise missing("tf2_msgs", need, error) from error
    return message_recorder
