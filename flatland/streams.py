"""The standard streams of a program."""

from __future__ import annotations

import codecs
import io
import sys
from typing import Final

_BYTES_OR_ESCAPES: Final = "flatland-bytes-or-escapes"


def accept_any_text() -> None:
    """Makes the standard output and error accept any text; to be called when a program starts.

    Characters that the encoding of a stream does not have, such as those of a path in a terminal
    with Latin-1, or the bytes of a file name that is not UTF-8, are written with a backslash and
    their number instead of raising an exception. Where Python writes the bytes of such a file name
    unchanged, in the locale C, it continues to do so.
    """
    codecs.register_error(_BYTES_OR_ESCAPES, _to_bytes_or_escapes)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            keeps_bytes = stream.errors in ("surrogateescape", _BYTES_OR_ESCAPES)
            stream.reconfigure(errors=_BYTES_OR_ESCAPES if keeps_bytes else "backslashreplace")


def _to_bytes_or_escapes(error: UnicodeError) -> tuple[str | bytes, int]:
    """Handles characters that cannot be encoded, as the functions of `codecs`."""
    try:
        return codecs.lookup_error("surrogateescape")(error)
    except UnicodeError:
        return codecs.lookup_error("backslashreplace")(error)
