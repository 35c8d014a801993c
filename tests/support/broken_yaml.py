"""Generates broken YAML files from tables of keys, with the errors that the specification requires.

A section is a map in a valid file. From each of its keys follow files in which that key is missing,
misspelled, empty, or has a value of a wrong type or range.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

# Per limit: the requirement in words, which states all of it, and a number that violates it with
# its form in errors.
NUMBER_LIMITS = {
    "finite": ("must be finite", ".inf", "inf"),
    "finite, >= 0": ("must be finite and not negative", "-1", "-1.0"),
    ">= 0": ("must not be negative or NaN", ".nan", "nan"),
    "finite, >= 1e-06": ("must be finite and at least 1e-06", "0", "0.0"),
    "0 to 1e8": ("must be from 0 to 100000000", "1e9", "1000000000.0"),
    "0 to 1": ("must be from 0 to 1", "1.1", "1.1"),
    "1 to 1000": ("must be from 1 to 1000", "1001", "1001"),
    "coordinate": ("must be finite and from -100000000 to 100000000", "1e308", "1e+308"),
}
# A value of another type. tests/unit/config/test_reader.py tests the conversions.
_SCALARS = {"string": "[a]", "float": "0,5", "int": "1.5", "bool": "maybe", "vector": "[1]"}
_SIZES = {
    "pose": 3,
    "color": 4,
    "3 floats": 3,
    "4 floats": 4,
    "9 floats": 9,
    "36 floats": 36,
    "2 floats": 2,
}


@dataclass(frozen=True)
class Key:
    """A key of a map.

    Attributes:
        name: The key.
        value: A valid value.
        kind: Kind of the value: a scalar, `list`, `map`, `names`, `string or strings`, `pose`,
            `color` or `N floats`.
        required: Whether the key must be there.
        limit: Key of `NUMBER_LIMITS` for numbers, empty for none.
        location: Location in errors, if it is not that of the section.
        error_class: Class of errors about the key, if it is not that of the section.
        is_independent: Whether the other keys of the section are valid without this one.
    """

    name: str
    value: str
    kind: str = "string"
    required: bool = False
    limit: str = ""
    location: str | None = None
    error_class: str | None = None
    is_independent: bool = True


@dataclass(frozen=True)
class Section:
    """A map in a file.

    Attributes:
        title: Name in the ids of tests.
        before: The lines before the map.
        keys: The keys of the map, one line each.
        lead: Number of lines of the map before these keys.
        indent: Number of spaces before the keys.
        is_item: Whether the map is an item of a list.
        after: The lines after the map.
        location: Location of the keys in errors, without brackets.
        label: Name of the map in errors about unknown keys, empty at file level.
        label_location: Location of the map itself.
        prefix: Start of all error texts.
        unknown_keys: Whether unknown keys are errors.
        error_class: Class of the errors.
    """

    title: str
    before: str
    keys: tuple[Key, ...]
    lead: int = 0
    indent: int = 0
    is_item: bool = False
    after: str = ""
    location: str = ""
    label: str = ""
    label_location: str = ""
    prefix: str = "Flatland YAML: "
    unknown_keys: bool = True
    error_class: str = "YamlError"

    def text(self, lines: dict[str, str | None] | None = None) -> str:
        """Returns the file, with other lines, or none, for some keys."""
        replaced = lines or {}
        rows = [replaced.get(key.name, f"{key.name}: {key.value}") for key in self.keys]
        body = [" " * self.indent + row for row in rows if row is not None]
        if self.is_item:
            body[0] = body[0][: self.indent - 2] + "- " + body[0][self.indent :]
        return self.before + "".join(f"{row}\n" for row in body) + self.after

    @property
    def first_key_line(self) -> int:
        """Number of the line of the first key."""
        return self.before.count("\n") + 1


@dataclass(frozen=True)
class Case:
    """A broken file and its error.

    Attributes:
        name: Name in the id of the test.
        text: The file.
        error_class: Class of the error.
        message: Text of the error, without the place at its end.
        line: Line of the place.
        hint: The hint; None for any.
    """

    name: str
    text: str
    error_class: str
    message: str
    line: int
    hint: str | None = None


def cases(section: Section) -> Iterator[Case]:
    """Yields the broken files of a section."""
    for index, key in enumerate(section.keys):
        map_line = section.first_key_line - section.lead
        line = section.first_key_line + index
        location = section.location if key.location is None else key.location
        error_class = key.error_class or section.error_class
        prefix = section.prefix if error_class == section.error_class else "Flatland YAML: "
        where = f" (in {location})" if location else ""
        name = f"{section.title}.{key.name}"
        typo = key.name + key.name[-1]
        if key.required:
            missing = f'{prefix}Entry "{key.name}" does not exist{where}'
            if len(section.keys) > 1:
                text = section.text({key.name: None})
                yield Case(f"{name} missing", text, error_class, missing, map_line)
            hint = f'"{typo}" in line {line} may be a misspelling of "{key.name}"'
            text = section.text({key.name: f"{typo}: {key.value}"})
            yield Case(f"{name} misspelled", text, error_class, missing, map_line, hint)
        elif section.unknown_keys and key.is_independent:
            label = f"{section.label} " if section.label else ""
            inside = f" (in {section.label_location})" if section.label_location else ""
            message = f'Entry {label}contains unrecognized entry(s) {{"{typo}"}}{inside}'
            text = section.text({key.name: f"{typo}: {key.value}"})
            yield Case(
                f"{name} misspelled",
                text,
                section.error_class,
                section.prefix + message,
                line,
                f'did you mean "{key.name}"?',
            )
        for value, message in _wrong_values(key, location):
            text = section.text({key.name: f"{key.name}: {value}"})
            yield Case(f"{name}={value}", text, error_class, prefix + message, line)


def _wrong_values(key: Key, location: str) -> Iterator[tuple[str, str]]:
    """Yields wrong values of a key and the error texts."""
    where = f" (in {location})" if location else ""
    inside = f' (in {location} "{key.name}")' if location else f' (in "{key.name}")'
    size = _SIZES.get(key.kind)
    if key.kind in _SCALARS:
        yield _SCALARS[key.kind], f'Error converting entry "{key.name}" to {key.kind}{where}'
    elif key.kind == "string or strings":
        yield "{a: 1}", f'Error converting entry "{key.name}" to string{where}'
        yield "[]", f'Entry "{key.name}" must have size >= 1{where}'
    elif key.kind == "map":
        yield "[1]", f'Entry "{key.name}" must be a map{where}'
    else:
        yield "text", f'Entry "{key.name}" must be a list{where}'
    if key.kind == "names":
        yield "[[a]]", f"Error converting entry index=0 to string{inside}"
    if size:
        yield (
            f"[{', '.join(['0'] * (size + 1))}]",
            (f'Entry "{key.name}" must have size of exactly {size}{where}'),
        )
    if key.limit:
        words, written, shown = NUMBER_LIMITS[key.limit]
        value, got = written, shown
        if size or key.kind == "vector":
            rest = (size or 2) - 1
            value = f"[{', '.join([written] + ['0'] * rest)}]"
            got = f"[{', '.join([shown] + ['0.0'] * rest)}]"
        yield value, f'Invalid "{key.name}", {words}, got {got}{where}'
