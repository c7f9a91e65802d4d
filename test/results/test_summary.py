"""Tests of the summary: counts, uncertainties, and comparison with the field in plan."""

import json
import math

import numpy as np
import pytest
from flights.flights_on_a_floor import (
    BOUNCES,
    FRAMES,
    SURVEY,
    SURVEY_Y_UP,
    UNMOVED,
    findings,
    floor,
    none_thrown,
    scene,
    thrown,
)

from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import PERCENTILES, share_of, wilson_interval
from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.results.summary import summary
from rpf3d_core.setup.areas import local_outlines
from rpf3d_core.setup.observed import horizontal_direction
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome

PUBLISHED = 1e-4
"""Largest rounding error of the published intervals, which have four decimals."""

ROUNDING = 1e-9
"""Largest rounding error (m) of survey coordinates of 4.5e6 m in float64."""


def rectangle(folder, name, corners, frame=UNMOVED):
    """Write GeoJSON with a rectangle, given by local (west, south), (east, north) m, in the input's plan axes."""
    (west, south), (east, north) = corners
    ring = np.array([[west, south, 0], [east, south, 0], [east, north, 0], [west, north, 0], [west, south, 0]], float)
    there = frame.points_to_input(ring)
    plan = there[:, [0, 1]] if frame.up == "z" else there[:, [0, 2]]
    (folder / name).write_text(json.dumps({"type": "Polygon", "coordinates": [plan.tolist()]}))


def summarised(folder, frame=UNMOVED, more="", flights=None):
    terrain = floor(frame)
    return summary(findings(scene(folder, more), terrain, flights or thrown(terrain)))


@pytest.mark.parametrize(
    ("count", "total", "low", "high"),
    # Newcombe 1998, Statist. Med. 17:857-872, table I, method 3 (score without continuity correction).
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_the_wilson_interval_is_that_of_newcombes_table(count, total, low, high):
    assert wilson_interval(count, total) == pytest.approx((low, high), abs=PUBLISHED)


def test_a_share_of_no_rocks_is_unknown():
    assert share_of(0, 0) == {"rocks": 0, "share": None, "interval_95": None}


def test_percentiles_leave_out_what_is_not_known():
    assert Sample([1.0, 2.0, 3.0, np.nan]).summary(PERCENTILES) == {
        "rocks": 3, "p5": 1.1, "p25": 1.5, "p50": 2.0, "p75": 2.5, "p95": 2.9, "max": 3.0,
    }  # fmt: skip
    assert Sample().summary(PERCENTILES)["p50"] is None


def test_the_summary_is_json_and_says_what_was_run(tmp_path):
    facts = summarised(tmp_path)
    assert json.loads(json.dumps(facts, allow_nan=False)) == facts
    assert facts["program"] == "rpf3d"
    assert facts["versions"]["numpy"] == np.__version__
    assert facts["scene"]["file"] == "floor.yaml" and len(facts["scene"]["digest"]) == 64
    assert facts["scene"]["seed"] == 1 and facts["scene"]["ground"] == "sliding" and facts["scene"]["effects"] == {}
    assert facts["engine"] == "reference"
    assert facts["terrain"]["triangles"] == facts["terrain"]["faults"]["triangles"] == 128
    assert facts["terrain"]["zones"] == ["bench_1", "floor"]


def test_every_outcome_that_occurs_has_its_number_and_its_sentence(tmp_path):
    outcomes = summarised(tmp_path)["outcomes"]
    assert {name: entry["rocks"] for name, entry in outcomes.items()} == {"stopped": 5, "left_terrain": 1}
    assert outcomes["left_terrain"]["sentence"] == OUTCOME_SENTENCES[Outcome.LEFT_TERRAIN]


def test_speed_counts_flying_only(tmp_path):
    facts = summarised(tmp_path)
    assert (facts["rocks"], facts["fly_s"], facts["compile_s"], facts["rocks_per_s"]) == (6, 0.5, 0.25, 12.0)
    assert (facts["read_s"], facts["wall_s"]) == (0.5, 2.0)
    assert (facts["impacts"], facts["path_m"]) == (6 * BOUNCES, 180.0)


def test_runout_is_of_rocks_at_rest_and_speed_of_all(tmp_path):
    deposits = thrown(floor()).deposits
    facts = summarised(tmp_path)
    run = np.hypot(*(deposits.x - deposits.release)[:5, :2].T)
    assert facts["runout_m"]["rocks"] == 5
    assert facts["runout_m"]["max"] == pytest.approx(run.max())
    assert facts["runout_m"]["p50"] == pytest.approx(np.median(run))
    assert facts["max_speed_m_s"]["rocks"] == 6
    assert facts["max_speed_m_s"]["p95"] == pytest.approx(np.percentile(deposits.max_speed, 95))
    assert facts["max_energy_j"]["max"] == pytest.approx(deposits.max_energy.max())
    assert facts["max_height_m"]["rocks"] == 5  # that of one rock is not known


def test_the_zones_where_rocks_stopped_are_counted(tmp_path):
    deposits = thrown(floor()).deposits
    stopped = summarised(tmp_path)["stopped_in_zones"]
    on_floor = int((deposits.x[:5, 0] > 0).sum())
    assert {zone: share["rocks"] for zone, share in stopped.items()} == {"bench_1": 5 - on_floor, "floor": on_floor}
    assert stopped["floor"]["share"] == pytest.approx(on_floor / 6)
    assert stopped["floor"]["interval_95"] == pytest.approx(wilson_interval(on_floor, 6))


@pytest.mark.parametrize("frame", FRAMES)
def test_an_area_is_reached_by_flying_over_it_and_kept_by_stopping_in_it(frame, tmp_path):
    flights = thrown(floor(frame))
    # West of the first impact of every rock: only flown over. And around the end of rock 0 only.
    rectangle(tmp_path, "gate.json", ((-9.5, -20), (-9.4, 20)), frame)
    x, y, _ = flights.deposits.x[0]
    rectangle(tmp_path, "end.json", ((x - 0.2, y - 0.2), (x + 0.2, y + 0.2)), frame)
    more = "areas_of_interest: [{name: gate, polygons: gate.json}, {name: end, polygons: end.json}]\n"
    facts = summarised(tmp_path, frame, more)
    areas = facts["areas_of_interest"]
    assert areas["gate"]["reached"]["rocks"] == 6 and areas["gate"]["stopped"]["rocks"] == 0
    assert areas["end"]["reached"]["rocks"] == 1 and areas["end"]["stopped"]["rocks"] == 1
    assert areas["end"]["stopped"]["interval_95"] == pytest.approx(wilson_interval(1, 6))
    assert "in plan" in facts["areas_reached_by"]


def test_a_rock_that_left_the_terrain_over_an_area_has_not_stopped_in_it(tmp_path):
    x, y, _ = thrown(floor()).deposits.x[5]
    rectangle(tmp_path, "end.json", ((x - 0.1, y - 0.1), (x + 0.1, y + 0.1)))
    facts = summarised(tmp_path, more="areas_of_interest: [{name: end, polygons: end.json}]\n")
    end = facts["areas_of_interest"]["end"]
    assert end["reached"]["rocks"] == 1 and end["stopped"]["rocks"] == 0


@pytest.mark.parametrize("frame", FRAMES)
def test_of_those_that_came_into_an_area_the_share_that_stayed_and_the_energy_are_told(frame, tmp_path):
    flights = thrown(floor(frame), rocks=60)
    stopped = flights.deposits.outcome == Outcome.STOPPED
    rectangle(tmp_path, "east.json", ((0, -20), (20, 20)), frame)
    more = "areas_of_interest: [{name: east, polygons: east.json}]\n"
    east = summarised(tmp_path, frame, more, flights)["areas_of_interest"]["east"]
    came = flights.deposits.x[:, 0] >= 0.0  # they only ever move eastwards, from -10
    assert 20 <= came.sum() < 60
    assert east["retained"]["share"] == pytest.approx((came & stopped).sum() / came.sum())
    assert east["retained"]["interval_95"] == pytest.approx(wilson_interval((came & stopped).sum(), came.sum()))
    assert 0.0 < east["energy_p95_j"] < flights.deposits.max_energy.max()


@pytest.mark.parametrize("frame", FRAMES)
def test_outlines_for_the_map_are_back_in_the_local_frame(frame, tmp_path):
    rectangle(tmp_path, "area.json", ((-3, -2), (5, 7)), frame)
    (ring,) = local_outlines(frame, read_polygons(tmp_path / "area.json"))
    np.testing.assert_allclose(ring[:4], [[-3, -2], [5, -2], [5, 7], [-3, 7]], atol=ROUNDING)


@pytest.mark.parametrize("frame", [SURVEY, SURVEY_Y_UP])
def test_deposits_are_compared_with_the_field_along_a_horizontal_direction(frame, tmp_path):
    deposits = thrown(floor(frame)).deposits
    local = np.array([[-8.0, 0.0, 50.0], [2.0, 1.0, 50.0], [4.0, 1.0, -9.0], [6.0, 1.0, 0.0]])
    lines = [" ".join(f"{value:.10g}" for value in point) + " 807.5 1 1 1" for point in frame.points_to_input(local)]
    (tmp_path / "field.txt").write_text("# x y z mass\n" + "\n".join(lines) + "\n")
    east = frame.origin[0]
    more = (
        f"observed: {{points_file: field.txt, along: [2, 0, 0], "
        f"sections: {{slope: [null, {east}], ledge: [{east}, {east + 5}], floor: [{east + 5}, null]}}}}\n"
    )
    observed = summarised(tmp_path, frame, more)["observed"]
    field, simulated = observed["field"], observed["simulated"]
    assert field["rocks"] == 4 and field["mean"] - east == pytest.approx(1.0, abs=1e-6)
    assert field["sd"] == pytest.approx(np.std([-8, 2, 4, 6], ddof=1), rel=1e-6)
    assert [field["sections"][name]["rocks"] for name in ("slope", "ledge", "floor")] == [1, 2, 1]
    assert field["sections"]["ledge"]["interval_95"] == pytest.approx(wilson_interval(2, 4))
    x = deposits.x[:5, 0]
    assert simulated["rocks"] == 5 and simulated["mean"] - east == pytest.approx(x.mean(), abs=1e-6)
    assert simulated["p50"] - east == pytest.approx(np.median(x), abs=1e-6)
    assert simulated["sections"]["floor"]["rocks"] == int((x >= 5.0).sum())
    assert observed["mean_difference_m"] == pytest.approx(x.mean() - 1.0, abs=1e-6)


def test_heights_have_no_say_in_the_comparison():
    np.testing.assert_allclose(horizontal_direction((3.0, 4.0, 99.0), "z"), [0.6, 0.8, 0.0])
    np.testing.assert_allclose(horizontal_direction((3.0, 99.0, 4.0), "y"), [0.6, 0.0, 0.8])
    with pytest.raises(InputError, match="vertical"):
        horizontal_direction((0.0, 1.0, 0.0), "y")


def test_points_may_be_separated_by_commas_and_commented(tmp_path):
    (tmp_path / "p.xyz").write_text("# drop points\n1, 2, 3, more\n\n4,5,6\n# the last\n")
    np.testing.assert_array_equal(read_points(tmp_path / "p.xyz"), [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 2 3\n1 2\n", "line 2"),
        ("1 2 x\n", "line 1"),
        ("1 nan 3\n", "line 1"),
        ("# only\n", "no point"),
        ("", "no point"),
    ],
)
def test_a_damaged_file_of_points_is_refused_with_its_name_and_line(tmp_path, text, words):
    (tmp_path / "p.xyz").write_text(text)
    with pytest.raises(InputError, match=rf"p\.xyz.*{words}"):
        read_points(tmp_path / "p.xyz")


def test_no_rocks_have_a_summary_without_numbers(tmp_path):
    facts = summarised(tmp_path, flights=none_thrown())
    assert facts["rocks"] == 0 and facts["rocks_per_s"] is None and facts["outcomes"] == {}
    assert facts["runout_m"]["max"] is None
    assert not any(isinstance(value, float) and math.isnan(value) for value in facts.values())
