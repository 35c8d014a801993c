"""Defaults and accepted values that are needed before the modules that use them are imported."""

from __future__ import annotations

from typing import Final, Literal, get_args

MAX_LAG: Final = 0.1
"""Default of the maximum lag that a loop catches up on [s]."""

DEFAULT_RESOLUTION: Final = 0.05
"""Default of the size of a cell of a map [m]."""

WEB_HOST: Final = "127.0.0.1"
"""Default of the address that the viewer for the browser listens on."""
WEB_PORT: Final = 8000
"""Default of its port."""
WEB_MIN_TOKEN: Final = 16
"""Smallest number of characters of a token of that viewer."""

IfBlocked = Literal["allow", "warn", "refuse", "nearest"]
"""What happens to a model that is placed at a pose that is not free."""
IF_BLOCKED: Final[tuple[IfBlocked, ...]] = get_args(IfBlocked)
