"""The files and parameters that a world and its models are made from."""

from __future__ import annotations

import errno
import logging
import os
import zlib
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar, cast

from flatland.checks import plain_path, shown
from flatland.config.files import read_regular
from flatland.errors import FlatlandError, Place

if TYPE_CHECKING:
    from flatland.config.node import Node

T = TypeVar("T")

ParamLookup = Callable[[str], object]
Params = Mapping[str, object] | ParamLookup | None
"""Source of the values of `param(NAME)`: a function returns None for an unknown name."""

_LOG = logging.getLogger("flatland")
_SILENT: Final = logging.Logger("flatland.silent", logging.CRITICAL + 1)


SavedInputs = tuple[dict[str, None], dict[str, object], int, int]
"""The part of `Inputs` that a snapshot contains: files, parameters, seed and expressions."""


@dataclass(slots=True)
class FileStore:
    """What was read, so that it is not read again.

    Attributes:
        contents: Contents of files by absolute path.
        parsed: Results of `Inputs.parsed`, or its exceptions, by path and key; and those of
            `Inputs.made`.
        documents: Documents of YAML files by absolute path, and of YAML texts by the text itself,
            or the error of each. Each list can be used once, since preprocessing changes it.
        values: Values of parameters.
    """

    contents: dict[str, bytes] = field(default_factory=dict)
    parsed: dict[Hashable, object] = field(default_factory=dict)
    documents: dict[str, list[Node] | FlatlandError] = field(default_factory=dict)
    values: dict[str, object] = field(default_factory=dict)

    def copy(self) -> FileStore:
        """Returns a copy that shares the contents."""
        return FileStore(
            self.contents.copy(), self.parsed.copy(), self.documents.copy(), self.values.copy()
        )


class Inputs:
    """Reads files and parameters, and lists what was read, so that a run can be repeated.

    Attributes:
        files: Absolute paths of all files that were read as keys, in the order of the first access.
        params: Values of all parameters that were looked up; None for one that is not set.
        folders: Real paths of the folders outside which no file is read, see `real_folders`; None
            for no restriction.
        expression_count: Number of expressions (`$eval`) that were evaluated since the last
            `set_seed`.
        log: Logs what is noticed while files are read.
    """

    def __init__(
        self,
        params: Params = None,
        *,
        folders: tuple[str, ...] | None = None,
        logs: bool = True,
    ) -> None:
        """Creates an object that has read nothing.

        Args:
            params: Source of the values of parameters.
            folders: Folders outside which no file is read; None for no restriction.
            logs: Whether messages about the contents of files are logged.
        """
        self.files: dict[str, None] = {}
        self.params: dict[str, object] = {}
        self.folders = folders
        self.expression_count = 0
        self._seed = 0
        self._source = params
        self.log = _LOG if logs else _SILENT
        self._is_loading = False
        self._loaded = FileStore()  # what was read when the world file was loaded
        self._ahead: FileStore | None = None

    @property
    def is_loading(self) -> bool:
        """Whether the world file is being loaded."""
        return self._is_loading

    def copy(self) -> Inputs:
        """Returns an independent copy, which shares the contents of files."""
        made = Inputs(self._source, folders=self.folders)
        made.log = self.log
        made.restore(self.save())
        made._loaded = self._loaded.copy()
        return made

    def save(self) -> SavedInputs:
        """Returns what reading has changed, except for the contents that `loading` keeps."""
        return self.files.copy(), self.params.copy(), self._seed, self.expression_count

    def restore(self, state: SavedInputs) -> None:
        """Restores the result of `save`."""
        files, params, self._seed, self.expression_count = state
        self.files, self.params = files.copy(), params.copy()

    def set_seed(self, seed: int) -> None:
        """Sets the seed of the random numbers of expressions, and begins a new sequence."""
        self._seed, self.expression_count = seed, 0

    @contextmanager
    def loading(self) -> Iterator[None]:
        """Returns a context for loading the world file.

        In the block, files and parameters are read at most once, also by later blocks, so that a
        reset does not depend on changes of files. `folders` has no effect.
        """
        outer, self._is_loading = self._is_loading, True
        try:
            yield
        finally:
            self._is_loading = outer

    @contextmanager
    def using(self, store: FileStore) -> Iterator[None]:
        """Returns a context in which files are taken from a store, which keeps further ones.

        Also a decorator of functions, as all contexts of `contextmanager`.
        """
        outer, self._ahead = self._ahead, store
        try:
            yield
        finally:
            self._ahead = outer

    @property
    def _store(self) -> FileStore | None:
        return self._loaded if self._is_loading else self._ahead

    # -- files -----------------------------------------------------------------------------

    def exists(self, path: str) -> bool:
        """Returns whether a file can be read, now or from an earlier block of `loading`.

        Raises:
            PermissionError: The file is outside `folders`, whether it exists or not.
        """
        self._check_allowed(path)
        store = self._store
        if store is not None and _absolute(path) in store.contents:
            return True
        try:
            return Path(path).exists()
        except (OSError, ValueError):
            return False

    def read(self, path: str) -> bytes:
        """Returns the content of a regular file of at most 64 MiB.

        Raises:
            OSError: The file cannot be read, see `read_regular`, or is outside `folders`.
        """
        self.note_file(path)
        store = self._store
        if store is None:
            return read_regular(path)
        name = _absolute(path)
        if name not in store.contents:
            store.contents[name] = read_regular(path)
        return store.contents[name]

    def documents_ahead(self, name: str) -> list[Node] | None:
        """Returns the documents of a file or of a text if the store of `using` has them, once.

        Args:
            name: Path of the file, or the text.

        Raises:
            YamlError: The file or the text is invalid.
        """
        if self._ahead is None or self._is_loading:
            return None
        found = self._ahead.documents.pop(name, None)
        if isinstance(found, FlatlandError):
            raise found
        return found

    def parsed(self, path: str, key: Hashable, parse: Callable[[], T]) -> T:
        """Returns the parsed content of a file that is not a YAML file, such as an image.

        Args:
            path: The file.
            key: Everything else that the result depends on, and a name of the kind of result.
            parse: Reads the file and returns the result, which must not be changed.

        Raises:
            OSError: The file cannot be read, or is outside `folders`.
        """
        self.note_file(path)
        store = self._store
        if store is None:
            return parse()
        name = (_absolute(path), key)
        if name not in store.parsed:
            try:
                store.parsed[name] = parse()
            except (OSError, ValueError) as error:
                if self._is_loading:
                    raise
                store.parsed[name] = error
        found = store.parsed[name]
        if isinstance(found, Exception):
            raise found
        return cast("T", found)

    def made(self, source: Hashable, make: Callable[[], T]) -> T:
        """Returns what the store of `using` has for a source that is not a file.

        Args:
            source: The source.
            make: Returns the result if the store has none.
        """
        if self._ahead is None or self._is_loading or source not in self._ahead.parsed:
            return make()
        return cast("T", self._ahead.parsed[source])

    def note_file(self, path: str) -> None:
        """Adds a file to `files`.

        Raises:
            PermissionError: The file is outside `folders`.
        """
        self._check_allowed(path)
        self.files[_absolute(path)] = None

    def _check_allowed(self, path: str) -> None:
        """Checks that a file is inside `folders`; symbolic links are resolved first."""
        folders = self.folders
        # No file has a name with a null character.
        if folders is None or self._is_loading or "\0" in path:
            return
        real = os.path.realpath(path)
        if not any(os.path.commonpath((real, folder)) == folder for folder in folders):
            raise PermissionError(
                errno.EACCES, f"it is outside the folders of model_path, {', '.join(folders)}", path
            )

    def warn(self, place: Place, message: str, *values: object, hint: str = "") -> None:
        """Logs a warning about the content of a file.

        Args:
            place: Position in the file, which is appended to the message.
            message: Format of the message.
            *values: Values of the format.
            hint: What probably helps; printed by `flatland check`.
        """
        extra = {"place": place, "hint": hint}
        self.log.warning(message + "%s", *values, place.suffix, extra=extra)

    # -- parameters and random numbers -----------------------------------------------------

    def param(self, name: str) -> object:
        """Returns the value of a parameter, None if it is not set."""
        values = self._loaded.values if self._is_loading else {}
        value = values[name] if name in values else self._look_up(name)
        values[name] = value
        self.params[name] = value
        return value

    def _look_up(self, name: str) -> object:
        if isinstance(self._source, Mapping):
            return self._source.get(name)
        return None if self._source is None else self._source(name)

    def next_seed(self) -> int:
        """Returns the seed of the next expression: each one has random numbers of its own."""
        self.expression_count += 1
        return zlib.crc32(b"%d %d" % (self._seed, self.expression_count))


def _absolute(path: str) -> str:
    return str(Path(path).absolute())


def real_folders(folders: Iterable[str | os.PathLike[str]] | None) -> tuple[str, ...] | None:
    """Returns the absolute paths of some folders without symbolic links, None for None.

    Raises:
        ValueError: The argument is a single path or empty, or a path is not a folder.
    """
    if folders is None:
        return None
    if isinstance(folders, str | os.PathLike) or not isinstance(folders, Iterable):
        raise ValueError(f"model_path must be a list of folders, got {shown(folders)}")
    paths = [Path(plain_path("a folder of model_path", each)).expanduser() for each in folders]
    if not paths:
        raise ValueError("model_path must contain at least one folder")
    for path in paths:
        if not path.is_dir():
            raise ValueError(f"model_path must be a list of folders, {str(path)!r} is not a folder")
    return tuple(os.path.realpath(path) for path in paths)
