"""Names in the texts of errors and warnings: those that may be meant, and short lists of many."""

from __future__ import annotations

import functools
import heapq
from collections.abc import Iterable
from typing import Final

MOST_NAMES: Final = 5
"""Number of names that a text lists."""

_MIN_SIMILARITY: Final = 0.6
# A word that is more similar than this is a typing mistake. Otherwise, several words may be meant:
# those that are less similar than the best one by at most the margin.
_TYPO_SIMILARITY: Final = 0.85
_MARGIN: Final = 0.15
_MAX_SUGGESTIONS: Final = 4
# Names that are compared with a word, those with the longest common beginning. The simulation may
# wait for the comparison, which takes 0.03 ms for each.
_MAX_COMPARED: Final = 1000


def did_you_mean(word: str, candidates: Iterable[str], kind: str = "") -> str:
    """Returns a question with the candidates that are similar to a word.

    Args:
        word: The word that is not one of the candidates.
        candidates: The words that are accepted.
        kind: What the candidates are, such as `bodies of the model`; they are listed if none is
            similar. Empty for no list.
    """
    candidates = list(candidates)
    similar = similar_names(word, candidates)
    if similar:
        return question(similar)
    return f"{kind}: {listed(candidates)}" if kind else ""


def question(names: Iterable[str]) -> str:
    """Returns the question whether one of some names is meant; empty without names."""
    quoted = " or ".join(f'"{name}"' for name in names)
    return f"did you mean {quoted}?" if quoted else ""


def similar_names(word: str, candidates: Iterable[str]) -> list[str]:
    """Returns the candidates that are similar to a word, the most similar one first."""
    import difflib  # late, since only mistakes need it

    by_lower = {candidate.lower(): candidate for candidate in candidates}
    lower = word.lower()
    compared: Iterable[str] = by_lower
    if len(by_lower) > _MAX_COMPARED:
        compared = heapq.nlargest(
            _MAX_COMPARED, by_lower, key=functools.partial(_common_length, lower)
        )
    found = difflib.get_close_matches(lower, compared, _MAX_SUGGESTIONS, _MIN_SIMILARITY)
    if not found:
        return []
    ratios = {name: difflib.SequenceMatcher(None, name, lower).ratio() for name in sorted(found)}
    most = max(ratios.values())
    least = most - (_MARGIN if most < _TYPO_SIMILARITY else 0.0)
    similar = [name for name, ratio in ratios.items() if ratio >= least]
    return [by_lower[name] for name in sorted(similar, key=lambda name: -ratios[name])]


def _common_length(first: str, second: str) -> int:
    """Returns the length of the common beginning of two words."""
    for number, (one, other) in enumerate(zip(first, second, strict=False)):
        if one != other:
            return number
    return min(len(first), len(second))


def listed(names: Iterable[str]) -> str:
    """Returns the first names and the number of the others, `none` without names."""
    names = list(names)
    shown = ", ".join(names[:MOST_NAMES]) or "none"
    others = len(names) - MOST_NAMES
    return f"{shown} and {others} more" if others > 0 else shown
