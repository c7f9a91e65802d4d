"""Tests of the drawn and recorded series of a price list; words replace values that a log axis cannot show."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes.price_lists import STEPS, price_list

from rpf3d_core.accuracy.price_list import EVENTS, Priced
from rpf3d_core.accuracy.series import series_of, word_of
from rpf3d_core.recordings.cost import places_of
from rpf3d_core.results.plots.cost import write_cost
from rpf3d_core.results.series import LEAST


def a_line(setting: dict, error: float = 0.1) -> Priced:
    return Priced(setting, error, 1.0, {"seconds_per_1000_rocks_compiled": 0.1})


def test_an_error_too_small_to_be_drawn_is_said_in_words() -> None:
    series = {one.name: one for one in series_of(price_list(numerical=[
        Priced(EVENTS, 0.0, 0.01, {}), a_line(STEPS, 3e-6), a_line({**STEPS, "dt": 1e-2}, LEAST)
    ]))}  # fmt: skip
    assert (series["events"].errors, series["events"].words) == ([LEAST], ["events: 0"])
    steps = series["steps, threshold 0.05 m"]
    assert (steps.errors, steps.words) == ([LEAST, LEAST], ["0.001 s: 3e-06", "0.01 s"])


def test_series_have_colours_of_their_own_and_the_price_of_what_is_compiled() -> None:
    settings = [
        *({**STEPS, "threshold": size, "squared": squared} for size in (0.5, 0.05, 0.1) for squared in (False, True)),
        *({"method": "raster", "cell": cell, "dt": 1e-3} for cell in (8.0, 2.0)),
    ]
    series = series_of(price_list(numerical=[Priced(EVENTS, 0.0, 0.01, {}), *map(a_line, settings)]))
    assert len({one.colour for one in series}) == len(series) == len({one.name for one in series}) == 11
    for one in series:
        assert one.compiled == ([0.1] if "threshold" in one.name else None), one.name
    assert series[-1].kind == "statistical" and series[-1].seconds == pytest.approx([1e-3, 4e-3, 16e-3])
    assert len(series[-2].seconds) == 2, "the terrain as it is has no error that could be drawn"
    assert word_of({"part": 1, "triangles": 8}) == "all"


def test_a_recorded_series_lies_lower_the_smaller_its_errors_are() -> None:
    rocks = series_of(price_list(numerical=[a_line(STEPS)]))[-1]
    places = places_of(rocks)
    np.testing.assert_allclose(10 ** places[:, 0], rocks.seconds)
    np.testing.assert_allclose(10 ** -places[:, 1], rocks.errors)
    assert (np.diff(places[:, 1]) > 0.0).all(), "the viewer's y points down"


def test_a_picture_is_drawn_of_a_list_without_fewer_triangles(tmp_path: Path) -> None:
    whole = [Priced({"part": 1, "triangles": 8}, 0.0, 0.01, {})]
    series = series_of(price_list(geometric=whole, numerical=[a_line(STEPS)]))
    write_cost(tmp_path / "cost.png", "a.yaml", series, 0.05, 0.3)
    assert (tmp_path / "cost.png").read_bytes().startswith(b"\x89PNG")


def test_a_series_without_points_is_left_out() -> None:
    prices = price_list(numerical=[a_line(EVENTS)])
    assert "fewer triangles" in [one.name for one in series_of(prices)]
    full_terrain_only = replace(prices, geometric=prices.geometric[:1])
    assert "fewer triangles" not in [one.name for one in series_of(full_terrain_only)]
