"""Texts of foreign code and files.

Plugins and controllers raise exceptions of any type with texts of any length, and files have names
of any bytes. Such a text is cleaned once, where it becomes part of a row, an error or a log line.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final

MAX_TEXT: Final = 4000
"""Characters of a text that are kept."""

# Control characters, of which texts may contain the last two, and halves of surrogate pairs, which
# also stand for the bytes of file names that are not UTF-8.
_INVALID_IN_NAMES: Final = re.compile("[\x00-\x1f\x7f-\x9f\ud800-\udfff]")
_INVALID: Final = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")


def clean_text(text: str) -> str:
    """Returns a text without characters that cannot be encoded or control a terminal.

    These are replaced by their escape sequences. Of long texts, the start is kept.
    """
    return _shortened(text, _INVALID, MAX_TEXT)


def clean_name(name: str) -> str:
    """Returns a name as `clean_text` does, in one line."""
    return _shortened(name, _INVALID_IN_NAMES, MAX_TEXT)


def _shortened(text: str, invalid: re.Pattern[str], most: int) -> str:
    rest = len(text) - most
    more = f"... ({rest} more characters)" if rest > 0 else ""
    return invalid.sub(_escaped, text[:most]) + more


def _escaped(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode("ascii")


def text_of(value: object, convert: Callable[[Any], str] = str) -> str:
    """Returns the clean text of a foreign object, also if the conversion raises.

    Args:
        value: The object.
        convert: Returns its text.
    """
    try:
        text = convert(value)
        return _shortened(text, _INVALID, MAX_TEXT // 2)  # There is more text around it.
    except BaseException as error:
        return f"<{type(value).__name__} whose text raises {type(error).__name__}>"
