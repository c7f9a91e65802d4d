"""Tests that evidence contains the figures of the areas of interest in the hazard maps."""

from dataclasses import replace

import numpy as np
import pytest
from flights.flights_on_a_floor import floor, maps_of, scene, thrown
from live_sites.alert_evidence import NOW, S, area, decided, site

from rpf3d_core.alerts.evidence import Evidence, areas_of, unfinished_of, untouched
from rpf3d_core.alerts.levels import Level
from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.maps import HazardMaps, Layers
from rpf3d_core.values import Outcome

ROCKS = 40


@pytest.fixture(scope="module")
def maps(tmp_path_factory) -> HazardMaps:
    """Return the maps of rocks that all start in one area; some reach another area, none the third."""
    terrain = floor()
    folder = tmp_path_factory.mktemp("floor")
    for name, corners in (
        ("beside", [[15, 15], [19, 15], [19, 19], [15, 15]]),
        ("all", [[-19, -19], [19, -19], [19, 19], [-19, 19], [-19, -19]]),
        ("far", [[7, -19], [19, -19], [19, 19], [7, 19], [7, -19]]),
    ):
        (folder / f"{name}.json").write_text(f'{{"type": "Polygon", "coordinates": [{corners}]}}')
    named = [f"{{name: {name}, polygons: {name}.json}}" for name in ("beside", "all", "far")]
    return maps_of(scene(folder, f"areas_of_interest: [{', '.join(named)}]\n"), terrain, thrown(terrain, ROCKS))


def row(layers: Layers, cell: int) -> int:
    return int(np.flatnonzero(layers.cell == cell)[0])


def test_each_area_is_told_in_the_order_of_the_maps_with_its_wilson_interval(maps: HazardMaps) -> None:
    told = areas_of(maps)
    assert [one.name for one in told] == ["beside", "all", "far"]
    for number, one in enumerate(told):
        at = np.flatnonzero(maps.areas.cell == number)
        reached = int(maps.areas.rocks[at].sum())
        assert (one.flown, one.reached) == (ROCKS, reached)
        assert (one.low, one.high) == wilson_interval(reached, ROCKS)
    assert told[0].reached == 0 < told[2].reached < told[1].reached == ROCKS


def test_energy_and_arrival_are_those_of_the_maps_and_unknown_where_no_rock_came(maps: HazardMaps) -> None:
    beside, everywhere, far = areas_of(maps)
    assert (beside.p95_energy, beside.largest_energy, beside.first_arrival_s) == (None, None, None)
    layers, at = maps.areas, row(maps.areas, 1)
    assert everywhere.largest_energy == layers.energy.largest[at]
    assert everywhere.first_arrival_s == layers.first_arrival[at] == 0.0
    assert far.first_arrival_s is not None and far.first_arrival_s > 0.0


def test_the_p95_energy_is_the_most_that_its_bin_leaves_open_and_unknown_of_few_rocks(maps: HazardMaps) -> None:
    _, everywhere, far = areas_of(maps)
    at = row(maps.areas, 1)
    binned, largest = float(maps.areas.energy.p95[at]), float(maps.areas.energy.largest[at])
    assert everywhere.p95_energy == min(binned * (1.0 + maps.areas.percentiles_within), largest)
    assert binned <= everywhere.p95_energy <= largest
    assert far.reached < 20 and far.p95_energy is None and far.largest_energy is not None


def test_evidence_holds_plain_numbers_only(maps: HazardMaps) -> None:
    for one in areas_of(maps):
        assert {type(value) for value in one} <= {str, int, float, type(None)}


def test_evidence_of_maps_is_believed_and_decided_on(maps: HazardMaps) -> None:
    made = Evidence(
        areas=areas_of(maps), result=1, stage=0, at_ns=NOW, trigger_stamp_ns=NOW - S, terrain_stamp_ns=NOW - S,
        terrain_digest="t",
        sources_digest="s", sources=2, seed=1, version="0.1.0",
    )  # fmt: skip
    limits = {"evacuate": {"reach_probability": 0.2}}
    thresholds = site({"far": limits, "beside": limits}, fewest_rocks=ROCKS)
    alert = decided(made, thresholds=thresholds)
    assert (alert.level, alert.faults) == (Level.EVACUATE, ())
    empty = replace(maps, areas=replace(maps.areas, cell=maps.areas.cell + 3))
    assert {one.reached for one in areas_of(empty)} == {0}


def test_a_message_of_no_sources_touches_no_area() -> None:
    assert untouched(["ramp"]) == (area(flown=0, low=0.0, high=0.0),)


def test_rocks_that_were_cut_off_are_those_that_had_not_come_to_an_end() -> None:
    outcomes = dict.fromkeys(Outcome, 1) | {Outcome.FAILED: 3}
    assert unfinished_of(outcomes) == 5 + 3
    assert unfinished_of({Outcome.STOPPED: 5, Outcome.LEFT_TERRAIN: 2}) == 0
