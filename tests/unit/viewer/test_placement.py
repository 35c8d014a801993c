"""Placing a model with two clicks: the first sets its position, the second its heading."""

from __future__ import annotations

import math

import pytest

from flatland.viewer.placement import Placement, Stage


def test_two_clicks_set_position_and_heading() -> None:
    placement = Placement()
    placement.move(5, 5)
    assert (placement.stage, placement.pose) == (Stage.POSITION, (5, 5, 0))
    placement.click(1, 2)
    assert (placement.stage, placement.pose) == (Stage.HEADING, (1, 2, 0))
    placement.move(1, 9)
    assert placement.pose == (1, 2, math.pi / 2)
    placement.click(0, 1)
    assert placement.stage is Stage.DONE
    assert placement.pose == pytest.approx((1, 2, -3 * math.pi / 4))


def test_two_clicks_at_one_point_keep_the_heading() -> None:
    placement = Placement()
    placement.click(1, 2)
    placement.click(1, 2)
    assert (placement.stage, placement.pose) == (Stage.DONE, (1, 2, 0))


def test_moves_after_the_second_click_are_ignored() -> None:
    placement = Placement()
    placement.click(1, 2)
    placement.click(1, 3)
    placement.move(7, 7)
    assert placement.pose == (1, 2, math.pi / 2)
