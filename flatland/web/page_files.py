"""The files of the page, read once, and compressed when they are first requested."""

from __future__ import annotations

import functools
import gzip
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_TYPES: Final = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".webmanifest": "application/manifest+json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".ico": "image/x-icon",
}
_COMPRESSED: Final = frozenset({".html", ".css", ".js", ".json", ".webmanifest", ".svg"})
_INDEX: Final = "index.html"
_LINK: Final = re.compile(r'(?<= href=")[\w./-]+(?=")|(?<= src=")[\w./-]+(?=")')


@dataclass(frozen=True)
class PageFile:
    """A file of the page.

    Attributes:
        suffix: Suffix of the name.
        content: The file.
    """

    suffix: str
    content: bytes

    @property
    def kind(self) -> str:
        """Value of the header `Content-Type`."""
        return _TYPES[self.suffix]

    @functools.cached_property
    def compressed(self) -> bytes | None:
        """The file, compressed by gzip; None for a format that is already compressed."""
        # Without the time, which would make the file differ from start to start.
        return gzip.compress(self.content, mtime=0) if self.suffix in _COMPRESSED else None

    @functools.cached_property
    def tag(self) -> str:
        """Hash of the content."""
        return hashlib.sha256(self.content).hexdigest()[:32]


class PageFiles:
    """The files of a folder, as they were when this object was created.

    All files except the start page are in a folder whose name changes with any of them. Browsers
    can therefore keep them without asking again, and the relative imports of modules remain valid.

    Attributes:
        index: The start page, whose links contain the folder.
        prefix: Path of the folder, with a slash at the end.
    """

    def __init__(self, folder: Path) -> None:
        """Reads the files of known types of a folder, and those of its subfolders."""
        contents = {
            path.relative_to(folder).as_posix(): path.read_bytes()
            for path in sorted(folder.rglob("*"))
            if path.suffix in _TYPES and path.is_file()
        }
        version = hashlib.sha256()
        for name, content in contents.items():
            version.update(f"{name}\n{len(content)}\n".encode() + content)
        self.prefix = f"assets/{version.hexdigest()[:16]}/"

        def versioned(link: re.Match[str]) -> str:
            return self.prefix + link[0] if link[0] in contents else link[0]

        text = _LINK.sub(versioned, contents.pop(_INDEX).decode())
        self.index = PageFile(".html", text.encode())
        self._assets = {
            self.prefix + name: PageFile(Path(name).suffix, content)
            for name, content in contents.items()
        }

    def asset(self, path: str) -> PageFile | None:
        """Returns the file with a path that begins with `prefix`, None if it does not exist."""
        return self._assets.get(path)
