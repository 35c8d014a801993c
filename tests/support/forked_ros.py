"""`rosservice`, `rostopic` and `rosversion` as forks of one process, which has imported them.

The programs spend most of their time on imports, and `roslaunch` runs `rosversion` twice.

Run as a program, this module is that process: it listens at the socket of its argument.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import socket
import socketserver
import sys
from pathlib import Path
from typing import Any, Final

_FUNCTIONS: Final = {
    "rosservice": ("rosservice", "rosservicemain"),
    "rostopic": ("rostopic", "rostopicmain"),
    "rosversion": ("rospkg.rosversion", "main"),
}
# Sends the command with its streams, and exits as it does.
_CLIENT: Final = """\
#!{python} -SE
import json, os, socket, sys
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
    server.connect({address!r})
    command = [os.path.basename(sys.argv[0]), *sys.argv[1:]]
    message = json.dumps([command, os.getcwd(), dict(os.environ)]).encode()
    socket.send_fds(server, [message], [0, 1, 2])
    sys.exit(int(server.recv(9) or 1))
"""
_LONGEST_MESSAGE: Final = 1 << 18  # bytes


def write_programs(folder: Path, address: Path) -> None:
    """Writes the programs for a socket to a folder, which is then the first one of `PATH`."""
    for name in _FUNCTIONS:
        (folder / name).write_text(_CLIENT.format(python=sys.executable, address=str(address)))
        (folder / name).chmod(0o755)


class _Server(socketserver.ForkingMixIn, socketserver.UnixStreamServer):
    socket_type = socket.SOCK_SEQPACKET


class _Command(socketserver.BaseRequestHandler):
    """Carries out one command, in a process of its own."""

    def handle(self) -> None:
        message, streams, _, _ = socket.recv_fds(self.request, _LONGEST_MESSAGE, 3)
        sys.argv[:], folder, environment = json.loads(message)
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        module, function = _FUNCTIONS[sys.argv[0]]
        run: Any = getattr(importlib.import_module(module), function)
        code = 0
        try:
            run()
        except SystemExit as end:
            if isinstance(end.code, str):
                print(end.code, file=sys.stderr)
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        sys.stdout.flush()
        self.request.send(str(code).encode())


if __name__ == "__main__":
    for name, _ in _FUNCTIONS.values():
        importlib.import_module(name)
    with _Server(sys.argv[1], _Command) as server, contextlib.suppress(KeyboardInterrupt):
        print("ready", flush=True)
        server.serve_forever()
