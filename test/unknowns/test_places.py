"""Tests of the places where parameter sets were calibrated, and whether other rocks start near them."""

import pytest

from rpf3d_core.unknowns.places import place_around, share_away

PLACE = place_around([[100.0, 200.0], [130.0, 220.0], [110.0, 240.0]])
"""A place of 30 m by 40 m, so its diagonal is 50 m."""


def test_a_place_is_the_rectangle_around_points() -> None:
    assert PLACE == (100.0, 200.0, 130.0, 240.0)


@pytest.mark.parametrize(
    ("point", "near"),
    [((110, 210), True), ((179, 220), True), ((181, 220), False), ((130 + 29, 240 + 39), True),
     ((130 + 31, 240 + 41), False), ((110, 151), True), ((110, 149), False), ((51, 220), True), ((49, 220), False)],
)  # fmt: skip
def test_near_is_a_diagonal_away_at_most(point: tuple[float, float], near: bool) -> None:
    assert share_away(PLACE, [point]) == (0.0 if near else 1.0)
    assert share_away(PLACE, [(110, 210), (110, 210), (9e6, 9e6), point]) == (0.25 if near else 0.5)
