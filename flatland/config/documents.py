"""Loading of YAML files into trees of nodes with line numbers.

Scalars stay text; their type is determined when a parameter is read. An alias is the same node as
its anchor. A merge key (`<<`) is an ordinary key, as in yaml-cpp, so that every entry of a map is
written in that map.
"""

from __future__ import annotations

from typing import Final

from flatland.config.composer import Composer, end_position, malformed
from flatland.config.files import foreign_kind
from flatland.config.foreign_files import foreign_file
from flatland.config.hints import similar_file
from flatland.config.inputs import Inputs
from flatland.config.node import Node, Source
from flatland.errors import Place, UnreadableFileError, YamlError

TEXT_NAME: Final = "<text>"
"""Name of a YAML text in error messages, and `Model.path` of its model."""


def is_yaml_text(yaml_path: str) -> bool:
    """Returns whether an argument is YAML text: text begins with a line break or with `{`."""
    return yaml_path[:1] in ("\n", "\r", "{") and yaml_path != ""


def load_documents(path: str, inputs: Inputs) -> list[Node]:
    """Loads all documents of a file.

    Args:
        path: The file, encoded in UTF-8, or in UTF-16 with a byte order mark.
        inputs: Reads the file.

    Returns:
        The root of each document; an empty list for a file that contains only comments.

    Raises:
        UnreadableFileError: The file does not exist, cannot be read, or is an image or a data file.
        YamlError: The file is not valid YAML.
    """
    ahead = inputs.documents_ahead(path)
    if ahead is not None:
        inputs.note_file(path)
        return ahead
    source = Source.of_file(path)
    content = _read(path, inputs)
    try:
        return parse_documents(_decode(content, source), source, inputs)
    except YamlError as error:
        kind = foreign_kind(content)
        if kind is None:
            error.hint = foreign_file(content) or error.hint
            raise
        name = {"image": "an image", "data": "a data file of line segments"}[kind]
        hint = f"this is {name}; a YAML file is expected here"
        raise UnreadableFileError(error.message, place=error.place, hint=hint) from error


def parse_documents(text: str, source: Source, inputs: Inputs) -> list[Node]:
    """Parses all documents of a text.

    Characters that YAML does not allow, and the surrogates that represent undecodable bytes, are
    accepted in comments only. If a key occurs several times in a map, its first value is used.

    Args:
        text: The text.
        source: Origin of the text.
        inputs: Logs warnings.

    Raises:
        YamlError: The text is not valid YAML.
    """
    return Composer(text.removeprefix("\ufeff"), source, inputs).compose()


def _read(path: str, inputs: Inputs) -> bytes:
    try:
        return inputs.read(path)
    except (FileNotFoundError, NotADirectoryError):
        raise UnreadableFileError(
            f'File does not exist, path="{path}"', place=Place(path), hint=similar_file(path)
        ) from None
    except OSError as error:
        raise UnreadableFileError(
            f'Failed to read file, path="{path}", {error.strerror}', place=Place(path)
        ) from error


def _decode(content: bytes, source: Source) -> str:
    if content[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-8", "surrogateescape")
    try:
        return content.decode("utf-16")
    except UnicodeDecodeError as error:
        line, column = end_position(content[: error.start].decode("utf-16", "replace"))
        why = f"byte 0x{content[error.start]:02x} is not valid UTF-16"
        raise malformed(source, line, column, why) from error
