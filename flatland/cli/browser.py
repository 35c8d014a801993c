"""Opens the pages that commands show."""

from __future__ import annotations

import os
import threading


def open_page(url: str) -> None:
    """Opens a page in a browser if there is a display; returns immediately."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        threading.Thread(target=_open_browser, args=[url], daemon=True).start()


def _open_browser(url: str) -> None:
    import webbrowser  # Late, because most commands open no browser.

    webbrowser.open(url)
