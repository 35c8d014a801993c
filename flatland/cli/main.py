"""Entry point of the command `flatland`: its parser, errors and exit codes."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence

import flatland
from flatland.cli import check, doctor, info, new, replay, run, show, test, view
from flatland.errors import FlatlandError
from flatland.output_files import named_errors
from flatland.streams import accept_any_text

_BROKEN_PIPE = 128 + signal.SIGPIPE  # exit code in a shell of a program ended by SIGPIPE
_INTERRUPTED = 128 + signal.SIGINT
_EPILOG = """
flatland COMMAND --help describes a command.

examples:
  flatland check worlds/office/world.yaml
  flatland run worlds/office/world.yaml --duration 60
  flatland view worlds/office/world.yaml
  flatland new world arena
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command.

    Args:
        arguments: Arguments without the name of the command; None for the arguments of the
            process.

    Returns:
        The exit code: 0 for success, 1 for an error of a file or of the system, which is printed,
        or for errors that `flatland check` or `flatland doctor` found; 130 after Ctrl-C, or 141
        if the reader closed the output, as in `flatland check world.yaml | head -1`.

    Raises:
        SystemExit: The arguments are invalid (code 2), or request the help or version (code 0).
    """
    accept_any_text()
    try:
        return _run(arguments)
    except KeyboardInterrupt:
        print("flatland: interrupted", file=sys.stderr)
        return _INTERRUPTED
    except BrokenPipeError:
        # The interpreter flushes the buffers at its end; redirect them, as they have no reader.
        null_device = os.open(os.devnull, os.O_WRONLY)
        for stream in (sys.stdout, sys.stderr):
            os.dup2(null_device, stream.fileno())
        os.close(null_device)
        return _BROKEN_PIPE


def _run(arguments: Sequence[str] | None) -> int:
    try:
        try:
            parser = make_parser()
            _complete(parser)
            options = parser.parse_args(arguments)
            code: int = options.run(options)
        finally:
            # Flush here: an error at the end of the interpreter is printed with a traceback.
            with named_errors("standard output"):
                print(end="", flush=True)
    except BrokenPipeError:
        raise
    except FlatlandError as error:
        print(f"flatland: {error.text_with_hint}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"flatland: {error}", file=sys.stderr)
        return 1
    return code


def make_parser() -> argparse.ArgumentParser:
    """Returns the parser of all commands."""
    parser = argparse.ArgumentParser(
        prog="flatland",
        description="Checks, draws, describes, runs and shows worlds without ROS; creates them.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"flatland {flatland.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in (check, info, show, run, view, replay, test, new, doctor):
        module.add(commands)
    return parser


def _complete(parser: argparse.ArgumentParser) -> None:
    """Prints completions and ends the process, if the shell requests completions."""
    if "_ARGCOMPLETE" not in os.environ:
        return
    try:
        import argcomplete
    except ImportError:
        return
    argcomplete.autocomplete(parser)
