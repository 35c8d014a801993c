"""Lists of seeds as they are written in scenario files and on the command line."""

from __future__ import annotations

import re
from typing import Final

MAX_RUNS: Final = 1_000_000
_MAX_SEED: Final = 2**63 - 1


def parse_seeds(text: str) -> tuple[int, ...]:
    """Returns the seeds of a list of numbers and ranges, each seed once.

    Args:
        text: Numbers and ranges FIRST:END or FIRST:END:STEP without END, separated by commas, as
            in `0:100` or `1,2,10:20`.

    Raises:
        ValueError: The text is invalid, or there are no seeds or too many.
    """
    seeds: dict[int, None] = {}
    for part in text.split(","):
        if not re.fullmatch(r"\s*[0-9]+(:[0-9]+(:[0-9]+)?)?\s*", part):
            raise ValueError(
                f"must be numbers and ranges of seeds, as in 0:100 or 1,2,10:20, got {text!r}"
            )
        numbers = [int(number) for number in part.split(":")]
        if len(numbers) == 3 and numbers[2] == 0:
            raise ValueError(f"the step of a range of seeds must be at least 1, got {text!r}")
        if max(numbers) > _MAX_SEED:
            raise ValueError(f"seeds must be at most {_MAX_SEED}, got {text!r}")
        found = range(numbers[0], numbers[0] + 1) if len(numbers) == 1 else range(*numbers)
        if len(found) > MAX_RUNS:
            raise ValueError(f"there must be at most {MAX_RUNS} seeds, got {text!r}")
        seeds.update(dict.fromkeys(found))
    if not seeds:
        raise ValueError(f"there are no seeds in {text!r}; the end of a range is excluded")
    return tuple(seeds)
