"""Contacts between fixtures, and contact events."""

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
    """A contact event between two fixtures, with the state of the contact at that moment.

    Attributes:
        kind: Kind of the event: `begin`, `end` or `post_solve`.
        contact_id: Id of the contact, the same for as long as the two fixtures touch.
        fixture_a: Id of the first fixture.
        fixture_b: Id of the second fixture.
        body_a: Id of the body of the first fixture.
        body_b: Id of the body of the second fixture.
        points: Contact points, world frame [m], shape (k, 2), k from 0 to 2. Empty for sensors and
            for shapes that no longer touch.
        normal: Unit vector from A to B, world frame, shape (2,); zero without points.
        normal_impulses: Impulse along the normal at each point [N s], shape (k,); zero unless the
            kind is `post_solve`.
        tangent_impulses: Impulse along the surface at each point [N s], shape (k,); zero unless
            the kind is `post_solve`.
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
    """A contact of two fixtures that currently touch.

    Attributes:
        contact_id: Id of the contact, the same for as long as the two fixtures touch.
        fixture_a: Id of the first fixture.
        fixture_b: Id of the second fixture.
        body_a: Id of the body of the first fixture.
        body_b: Id of the body of the second fixture.
        points: Contact points, world frame [m], shape (k, 2), k from 0 to 2; empty for sensors.
        normal: Unit vector from A to B, world frame, shape (2,); zero without points.
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
    """Converts the contact rows of the extension to contact events."""
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
    """Converts the contact rows of the extension to contacts."""
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
