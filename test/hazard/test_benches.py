"""Tests that the bench table agrees with the maps, with correct intervals also for 0 and all rocks."""

import json

import numpy as np
import pytest
from flights.flights_on_a_floor import floor
from hazards.hazard_layers import laid_out, lines_of_rocks, maps_of

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.benches import (
    AREA,
    SHOWN,
    TEXT_HEADER,
    ZONE,
    Bench,
    bench_table,
    benches_section,
    left_out,
    notes_on_unknown,
    text_rows,
    with_predictive,
)
from rpf3d_core.hazard.maps import FEWEST_ROCKS


@pytest.fixture(scope="module")
def points():
    return lines_of_rocks(floor())


@pytest.fixture(scope="module")
def maps(points):
    x = points.plan[:, 0]
    few = points.rock < FEWEST_ROCKS - 1
    return maps_of(floor(), points, 2.0, [("east", x > 5.0), ("nowhere", x > 1e6), ("few", few)])


@pytest.fixture(scope="module")
def table(maps):
    return bench_table(floor(), maps)


def bench(name, rocks, flown=1000):
    share = {"rocks": rocks, "share": rocks / flown, "interval_95": list(wilson_interval(rocks, flown))}
    return Bench(ZONE, name, share, share, share, None)


def test_there_is_a_row_for_each_zone_and_area_in_their_order(table):
    assert [(row.kind, row.name) for row in table] == [
        (ZONE, "bench_1"), (ZONE, "floor"), (AREA, "east"), (AREA, "nowhere"), (AREA, "few"),
    ]  # fmt: skip


def test_reached_and_stopped_are_of_all_rocks_and_retained_of_those_that_came(table, maps, points):
    row = next(row for row in table if row.name == "east")
    east = points.plan[:, 0] > 5.0
    reached, stopped = len(set(points.rock[east])), int((east & points.last).sum())
    assert 0 < stopped < reached < maps.flown
    assert row.reached == {
        "rocks": reached, "share": reached / maps.flown, "interval_95": list(wilson_interval(reached, maps.flown)),
    }  # fmt: skip
    assert row.stopped["share"] == stopped / maps.flown
    assert row.retained["rocks"] == stopped and row.retained["share"] == stopped / reached
    assert row.retained["interval_95"] == list(wilson_interval(stopped, reached))


def test_wilson_intervals_are_the_published_ones():
    # Newcombe 1998, Stat. Med. 17:857-872, table I: 81/263, 15/148, 0/20, 1/29.
    for count, total, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611),
                                    (1, 29, 0.0061, 0.1718)):  # fmt: skip
        np.testing.assert_allclose(wilson_interval(count, total), (low, high), atol=5e-5)


def test_nothing_is_told_of_what_no_rock_came_to(table):
    row = next(row for row in table if row.name == "nowhere")
    assert row.reached["rocks"] == 0 and row.reached["interval_95"][0] == 0.0 < row.reached["interval_95"][1]
    assert row.retained["share"] is None and row.energy_p95 is None


def test_p95_energy_needs_twenty_rocks(table, maps):
    rows = {row.name: row for row in table}
    assert rows["few"].reached["rocks"] == FEWEST_ROCKS - 1 and rows["few"].energy_p95 is None
    assert rows["east"].energy_p95 == laid_out(maps.areas).energy.p95[0]


def test_the_section_of_the_summary_holds_zones_and_areas_apart_and_is_json(table):
    section = json.loads(json.dumps(benches_section(table), allow_nan=False))
    assert list(section["zones"]) == ["bench_1", "floor"]
    assert list(section["areas_of_interest"]) == ["east", "nowhere", "few"]
    assert set(section["zones"]["floor"]) == {"reached", "stopped", "retained", "energy_p95_j"}
    assert section["areas_of_interest"]["few"]["energy_p95_j"] is None


def test_the_printed_table_has_the_zones_with_most_rocks_first_none_without_and_tells_how_many_are_left_out():
    rocks = [0, 5, 40, 3, 0, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]
    benches = [bench(f"bench_{n}", count) for n, count in enumerate(rocks)]
    rows = text_rows(benches)
    assert len(rows) == SHOWN == 12
    assert [row[0] for row in rows] == [f"bench_{n}" for n in (2, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 1)]
    assert left_out(benches) == 1 and left_out(benches[:9]) == 0
    assert [row[0] for row in text_rows([bench("a", 0), bench("b", 1)])] == ["b"]
    assert all(len(row) == len(TEXT_HEADER) for row in rows)


def test_every_area_is_printed_also_one_that_no_rock_reached():
    many = [bench(f"bench_{n}", 900) for n in range(20)]
    areas = [bench(f"area_{n}", n)._replace(kind=AREA) for n in range(14)]
    rows = text_rows([*many, *areas])
    assert [row[0] for row in rows[SHOWN:]] == [f"area_{n} (area)" for n in range(14)]
    assert rows[SHOWN][1] == "0 % (0-0.4)"


@pytest.mark.parametrize(
    ("count", "total", "text"),
    [
        (0, 40_000, "0 % (0-0.010)"),
        (500, 1000, "50.0 % (46-54)"),
        (50_000, 100_000, "50.0 % (49.6-50.4)"),
        (84_500_000, 100_000_000, "84.5 % (84.4-84.6)"),
        (39_998, 40_000, "99.995 % (99.98-99.999)"),
        (40_000, 40_000, "100 % (99.990-100)"),
        (1, 10_000_000, "0.0000 % (0.0000-0.0001)"),
    ],
)
def test_a_share_that_is_not_0_or_100_per_cent_does_not_look_so_while_four_decimals_can_tell(count, total, text):
    share = {"rocks": count, "share": count / total, "interval_95": list(wilson_interval(count, total))}
    row = text_rows([bench("a", 1)._replace(stopped=share)])[0]
    assert row[2] == text


@pytest.mark.parametrize("flown", [20, 1000, 100_000, 10_000_000])
def test_shares_of_any_number_of_rocks_leave_room_for_a_name_in_80_columns(flown):
    for part in (0.9, 0.85, 0.15, 0.05):
        row = text_rows([bench("bench_12", round(part * flown), flown)._replace(energy_p95=2.46e6)])[0]
        assert sum(map(len, row)) + 2 * len(row) <= 80
        assert row[1].startswith(f"{100 * part:.1f} % (")


@pytest.mark.parametrize(
    ("predictive", "sampling", "text"),
    [
        ([None, None], [443e3, 778e3], "496 (not known; 443-778)"),
        ([239e3, 795e3], [443e3, None], "496 (239-795; 443-?)"),
        ([None, None], [None, None], "496 (not known; not known)"),
        (None, None, "496"),
    ],
)
def test_over_parameter_sets_a_p95_energy_is_never_bare(predictive, sampling, text):
    row = bench("a", 1)._replace(energy_p95=496e3, energy_predictive=predictive, energy_sampling=sampling)
    assert text_rows([row])[0][-1] == text


def test_unknown_intervals_and_ends_are_explained_below_the_table_that_has_them():
    energy = bench("a", 1)._replace(energy_p95=496e3, energy_predictive=[239e3, 795e3], energy_sampling=[443e3, 778e3])
    assert notes_on_unknown(text_rows([energy])) == []
    (end,) = notes_on_unknown(text_rows([energy._replace(energy_sampling=[183e3, None])]))
    assert end == "`?`: too few rocks reached it to bound the p95 energy from above; it may be much larger"
    none, end = notes_on_unknown(text_rows([energy._replace(energy_predictive=[None] * 2, energy_sampling=[1, None])]))
    assert none.startswith("`not known`: fewer than 39 parameter sets") and end.startswith("`?`")
    assert notes_on_unknown(text_rows([bench("not known?", 1)])) == []  # the name of a zone is not an interval


def test_a_share_without_a_predictive_interval_over_parameter_sets_says_so():
    share = with_predictive({"rocks": 5, "share": 0.5, "interval_95": [0.24, 0.76]}, float("nan"), float("nan"))
    row = text_rows([bench("a", 1)._replace(retained=share)])[0]
    assert row[3] == "50.0 % (not known; 24-76)"
    known = with_predictive(share, 0.1, 0.9)
    assert text_rows([bench("a", 1)._replace(retained=known)])[0][3] == "50.0 % (10-90; 24-76)"


def test_figures_are_three_and_without_exponent():
    assert [three_figures(value) for value in (2463.0, 0.02991, 1.0, 123456789.0)] == ["2,460", "0.0299", "1",
                                                                                      "123,000,000"]  # fmt: skip
