"""Loads hostile files under limits of memory and time; runs in a process of its own.

Standard input is a list of cases in JSON, each with `name`, `kind` (`world`, or `model` to spawn)
and `path`; each result is a line of JSON on standard output.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import resource
import signal
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np

import flatland

_HEADROOM = 2**30  # bytes of address space beyond that at the start
_CPU_TIME = 30.0  # s of processor time of a case until the process is ended
_NOBODY = 65534
_PR_SET_DUMPABLE = 4


def status(key: str) -> int:
    """Returns a value of /proc/self/status [MiB]."""
    found = re.search(rf"^{key}:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.M)
    assert found
    return int(found[1]) // 1024


def contents(world: flatland.World) -> list[Any]:
    """Returns what a failed request must not change."""
    return [
        [model.name for model in world.models],
        str(world.physics.object_counts()),
        sorted(world.ports.outputs),
        sorted(world.ports.commands),
        threading.active_count(),
        len(list(Path("/proc/self/fd").iterdir())),
    ]


def run(case: dict[str, str], world: flatland.World) -> dict[str, Any]:
    """Loads or spawns the file of a case and returns the error and the costs."""
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    before, memory = contents(world), status("VmRSS")
    signal.setitimer(signal.ITIMER_PROF, _CPU_TIME)
    result: dict[str, Any] = {"name": case["name"], "class": "", "text": ""}
    try:
        if case["kind"] == "world":
            flatland.World.from_yaml(case["path"], seed=1).close()
        else:
            world.spawn_model(case["path"], "new", "new")
            world.delete_model("new")
    except Exception as error:
        result |= {"class": type(error).__name__, "text": str(error)}
    signal.setitimer(signal.ITIMER_PROF, 0)
    result["memory"] = status("VmHWM") - memory
    result["unchanged"] = contents(world) == before
    return result


def main() -> None:
    """Runs all cases."""
    task = json.load(sys.stdin)
    np.linalg.norm(np.eye(2))  # Libraries are loaded before the limits are set.
    with flatland.World.from_yaml(task["world"], seed=1) as world:
        if os.getuid() == 0:
            os.setgroups([])
            os.setgid(_NOBODY)
            os.setuid(_NOBODY)
            # Otherwise a process that has changed its user cannot read its own /proc.
            ctypes.CDLL(None).prctl(_PR_SET_DUMPABLE, 1, 0, 0, 0)
        limit = status("VmSize") * 2**20 + _HEADROOM
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        for case in task["cases"]:
            print(json.dumps(run(case, world)), flush=True)
        world.step(2)


if __name__ == "__main__":
    main()
