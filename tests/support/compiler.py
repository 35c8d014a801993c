"""C++ programs of the tests, compiled with a cache of what earlier runs have compiled.

A compilation with the same input takes its result from the cache of the user, also in another
clone. ccache hashes the preprocessed source, the options and the compiler, and serves concurrent
runs. Without ccache, nothing is reused.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from programs import run_program
from waiting import BUILD_TIMEOUT

_COMPILERS: Final = "/usr/lib/ccache"  # of Debian: programs of the names of the compilers


def compile_program(
    program: Path, sources: Sequence[Path], flags: Sequence[str], libraries: Sequence[str] = ()
) -> Path:
    """Compiles and links a program.

    Args:
        program: The program. Object files are placed beside it.
        sources: Source files.
        flags: Options of the compiler.
        libraries: Options of the linker.

    Returns:
        The program.
    """
    environment = {
        **os.environ,
        "PATH": f"{_COMPILERS}:{os.environ['PATH']}",
        # Another folder in each run; paths below it are relative in the cache.
        "CCACHE_BASEDIR": str(program.parent),
        "CCACHE_NOHASHDIR": "1",
    }
    compiler = shutil.which(os.environ.get("CXX", "c++"), path=environment["PATH"])
    assert compiler is not None, "the build of flatland requires a C++ compiler"
    objects = []
    for source in sources:
        objects.append(program.with_name(f"{source.stem}.o"))
        command = [compiler, *flags, "-c", source, "-o", objects[-1]]
        run_program(command, check=True, silence=BUILD_TIMEOUT, env=environment)
    link = [compiler, *flags, *objects, *libraries, "-o", program]
    run_program(link, check=True, silence=BUILD_TIMEOUT)
    return program
