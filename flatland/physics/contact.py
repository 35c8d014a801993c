"""What happens between fixtures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from flatland.geometry import DoubleArray

if TYPE_CHECKING:
    from flatland._core import _ContactColumns

ContactKind = Literal["begin", "end", "post_solve"]

_KINDS: Final[tuple[ContactKind, ContactKind, ContactKind]] = ("begin", "end", "post_solve")


@dataclass(frozen=True, slots=True, eq=False)
class ContactEvent:
    """Something that happened between two fixtures during a step, as it was at that moment.

    Attributes:
        kind: `begin`, `end` or `post_solve`.
        contact_id: Unique for as long as the two fixtures touch.
        fixture_a: Id of a fixture.
        fixture_b: Id of the other one.
        body_a: Id of the first fixture's body.
        body_b: Id of the second fixture's body.
        points: World frame [m], shape (k, 2), k from 0 to 2; none for sensors and shapes apart.
        normal: Unit vector from A to B, world frame, shape (2,); zeros without points.
        normal_impulses: Along the normal at each point [N s], shape (k,); 0 unless `post_solve`.
        tangent_impulses: Along the surface at each point [N s], shape (k,).
        is_sensor: Whether one of the fixtures is a sensor.
    """

    kind: ContactKind
    contact_id: int
    fixture_a: int
    fixture_b: int
    body_a: int
    body_b: int
    points: DoubleArray
    normal: DoubleArray
    normal_impulses: DoubleArray
    tangent_impulses: DoubleArray
    is_sensor: bool


@dataclass(frozen=True, slots=True, eq=False)
class ContactInfo:
    """Two fixtures that touch now.

    Attributes:
        contact_id: Unique for as long as the two fixtures touch.
        fixture_a: Id of a fixture.
        fixture_b: Id of the other one.
        body_a: Id of the first fixture's body.
        body_b: Id of the second fixture's body.
        points: World frame [m], shape (k, 2), k from 0 to 2; none for sensors.
        normal: Unit vector from A to B, world frame, shape (2,); zeros without points.
        is_sensor: Whether one of the fixtures is a sensor.
    """

    contact_id: int
    fixture_a: int
    fixture_b: int
    body_a: int
    body_b: int
    points: DoubleArray
    normal: DoubleArray
    is_sensor: bool


def to_events(columns: _ContactColumns) -> list[ContactEvent]:
    """Makes one event of each row that the core recorded."""
    kinds, ids, counts, points, normals, impulses, sensors = columns
    rows = zip(kinds.tolist(), ids.tolist(), counts.tolist(), sensors.tolist(), strict=True)
    return [
        ContactEvent(
            _KINDS[kind],
            contact,
            fixture_a,
            fixture_b,
            body_a,
            body_b,
            points[i, :count],
            normals[i],
            impulses[i, 0, :count],
            impulses[i, 1, :count],
            is_sensor,
        )
        for i, (kind, (contact, fixture_a, fixture_b, body_a, body_b), count, is_sensor) in (
            enumerate(rows)
        )
    ]


def to_infos(columns: _ContactColumns) -> list[ContactInfo]:
    """Describes each contact of the rows that the core gave."""
    _, ids, counts, points, normals, _, sensors = columns
    rows = zip(ids.tolist(), counts.tolist(), sensors.tolist(), strict=True)
    return [
        ContactInfo(
            contact,
            fixture_a,
            fixture_b,
            body_a,
            body_b,
            points[i, :count],
            normals[i],
            is_sensor,
        )
        for i, ((contact, fixture_a, fixture_b, body_a, body_b), count, is_sensor) in (
            enumerate(rows)
        )
    ]
