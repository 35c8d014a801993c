"""A limit of the size of files, at which writing fails as on a full disk."""

from __future__ import annotations

import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager

REASON = "File too large"
"""The error of the operating system at the limit."""


@contextmanager
def limited_files(size: int) -> Iterator[None]:
    """Limits the files that this process writes in a block to a size [bytes].

    No worker processes must be started in the block, as they keep the limit.
    """
    before, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    writes_bytecode = not sys.dont_write_bytecode
    sys.dont_write_bytecode = True  # Python does not check that it has written all of it.
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (before, most))
        sys.dont_write_bytecode = not writes_bytecode
