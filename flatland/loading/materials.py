"""Colours, materials and classes in the entries of layers, models, bodies and footprints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flatland.physics import Material

if TYPE_CHECKING:
    from flatland.config.convert import Color
    from flatland.config.reader import YamlReader

SHARE_TOLERANCE = 1e-9  # by which the sum of the shares may exceed 1


def read_material(reader: YamlReader) -> Material | None:
    """Reads the optional entry `material` of a layer or a footprint.

    Args:
        reader: Reader of the layer or footprint.

    Returns:
        The material, None if the entry is missing.

    Raises:
        YamlError: The entry is not a map, a share is not from 0 to 1, `transmission` + `specular`
            is above 1, or a key is unknown.
    """
    entry = reader.optional_subnode("material", "map")
    if entry.is_null:
        return None
    default = Material()
    reflectance, transmission, specular = (
        entry.get(key, "float", value, minimum=0, maximum=1)
        for key, value in default._asdict().items()
    )
    entry.ensure_accessed_all()
    if transmission + specular > 1 + SHARE_TOLERANCE:
        entry.report(
            entry.invalid(
                "specular",
                f"transmission + specular must be at most 1, got {transmission:g} + {specular:g}",
            )
        )
        return None  # only if errors are collected
    return Material(reflectance, transmission, specular)


def read_class(reader: YamlReader, default: str) -> str:
    """Reads the optional entry `class` of a layer, a model or a body: a label for perception.

    Raises:
        YamlError: The value is not a string, or is empty.
    """
    name: str = reader.get("class", "string", default)
    if not name and "class" in reader:
        reader.report(reader.invalid("class", "must not be empty"))
    return name


def read_color(reader: YamlReader, default: Color) -> Color:
    """Reads the optional entry `color` of a layer, a body or a joint.

    Raises:
        YamlError: The value is not a list of four finite numbers.
    """
    color: Color = reader.get("color", "color", default, finite=True)
    if not all(0 <= part <= 1 for part in color):
        shown = ", ".join(f"{part:g}" for part in color)
        reader.warn("color", f"[{shown}], but each of [r, g, b, a] is from 0 to 1")
    return color
