"""Checks that the pages of a site load nothing from other hosts, and that all local files exist.

Links that a reader follows may lead to other hosts.

Usage: check_site.py FOLDER
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes whose target a browser loads with the page. Of `link`, only some kinds are loaded.
_LOADED = {
    "audio": ("src",),
    "embed": ("src",),
    "iframe": ("src",),
    "img": ("src", "srcset"),
    "link": ("href",),
    "object": ("data",),
    "script": ("src",),
    "source": ("src", "srcset"),
    "video": ("src", "poster"),
}
_NOT_LOADED = {"canonical", "index", "next", "prev", "search"}  # kinds of `link`
_STYLE_TARGET = re.compile(r"""(?:url\(|@import)\s*["']?([^"')\s]+)""")


class _Page(HTMLParser):
    """Collects the targets of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value for name, value in attrs if value}
        if tag == "link" and values.get("rel", "") in _NOT_LOADED:
            return
        self.loaded += [values[name] for name in _LOADED.get(tag, ()) if name in values]
        if tag == "a" and "href" in values:
            self.linked.append(values["href"])


def problems(folder: Path) -> Iterator[str]:
    """Yields a message for each target that is on another host or does not exist."""
    for path in sorted(folder.rglob("*.html")):
        page = _Page()
        page.feed(path.read_text(encoding="utf-8"))
        for target in page.loaded:
            if _is_remote(target):
                yield f"{path}: loads {target}"
        for target in page.loaded + page.linked:
            if not _exists(path, target):
                yield f"{path}: {target}: no such file"
    for path in sorted(folder.rglob("*.css")):
        for target in _STYLE_TARGET.findall(path.read_text(encoding="utf-8")):
            if _is_remote(target):
                yield f"{path}: loads {target}"


def _is_remote(target: str) -> bool:
    return bool(urlsplit(target).netloc)


def _exists(page: Path, target: str) -> bool:
    parts = urlsplit(target)
    if parts.scheme or parts.netloc or not parts.path:
        return True
    return (page.parent / unquote(parts.path)).exists()


def main(arguments: list[str]) -> int:
    """Prints all problems and returns the exit code."""
    folder = Path(arguments[0])
    found = list(problems(folder))
    pages = len(list(folder.rglob("*.html")))
    print("\n".join(found) if found else f"{pages} pages in {folder}, nothing from other hosts")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
