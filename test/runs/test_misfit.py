"""Tests that predictive intervals include the misfit of a calibrated model: closed forms, bits, and files."""

import json
import math
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from flights.scenes_of_facets import terrain_of
from input_files.terrain_files import write_binary_stl
from scenes.small_pit import scene_file

import rpf3d_core as rpf3d
from rpf3d_core.hazard.by_set.displaced import moved_cells, zones_in_plan
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.results.findings import Run
from rpf3d_core.results.overconfidence import surer_than_it_may_be
from rpf3d_core.results.summary import summary
from rpf3d_core.terrain.facets import facets_of

SPREAD, MISFIT, LIMIT = 6.0, 3.0, 2.0
"""Standard deviations (m) of the stops and of the model's error; distance (m) of the limit from the mean stop."""
SETS, POINTS = 256, 50
FLAT = """\
terrain: {files: [{path: near.stl, zone: near}, {path: far.stl, zone: far}]}
materials:
  default: {normal_restitution: 0.01, tangential_restitution: 0.5,
            friction_angle_deg: {prior: {min: 40, max: 41}}}
sources: [{name: drop, points_file: drop.csv, rocks: 12800}]
areas_of_interest: [{name: beyond, polygons: beyond.geojson}]
hazard: {cell: 1}
stop_speed: 0.5
rebound: constant
ground: sliding
engine: compiled
seed: 4
"""
UNKNOWNS = "unknowns: {{sets: {sets}, misfit: {misfit}}}\n"
PIT = """\
seed: 3
unknowns:
  sets: 40
  misfit: 12
  priors: {materials.default.normal_restitution: {min: 0.3, max: 0.6}}
"""
EDGE = 60.0


def plate(folder: Path, name: str, low: float, high: float) -> None:
    """Write an STL file with a horizontal rectangle of two facets from x = low to x = high (m)."""
    a, b, c, d = ([low, -EDGE, 0], [high, -EDGE, 0], [high, EDGE, 0], [low, EDGE, 0])
    write_binary_stl(folder / name, np.array([[a, b, c], [a, c, d]], dtype=float))


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a floor, an area, and drop points at normal quantiles of x; rocks stop where they land."""
    folder = tmp_path_factory.mktemp("flat")
    plate(folder, "near.stl", -EDGE, LIMIT)
    plate(folder, "far.stl", LIMIT, EDGE)
    ring = [[LIMIT, -EDGE], [EDGE, -EDGE], [EDGE, EDGE], [LIMIT, EDGE], [LIMIT, -EDGE]]
    (folder / "beyond.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    places = [NormalDist(0.0, SPREAD).inv_cdf((i + 0.5) / POINTS) for i in range(POINTS)]
    (folder / "drop.csv").write_text("x,y,z\n" + "\n".join(f"{x},0,0.5" for x in places))
    return folder


def flown(folder: Path, misfit: float) -> Run:
    scene = folder / f"misfit_{misfit:g}.yaml"
    scene.write_text(FLAT + UNKNOWNS.format(sets=SETS, misfit=misfit))
    return rpf3d.simulate(scene)


def expected(probability: float, misfit: float = MISFIT) -> float:
    """Return the quantile, at a probability, of the share of stops beyond the limit; misfit : common error (sd, m)."""
    return NormalDist().cdf((NormalDist(0.0, misfit).inv_cdf(probability) - LIMIT) / SPREAD)


@pytest.fixture(scope="module")
def displaced(flat: Path) -> dict[str, Any]:
    return summary(flown(flat, MISFIT))


def test_the_share_beyond_a_limit_has_the_interval_of_normal_stops_with_a_normal_error(
    displaced: dict[str, Any],
) -> None:
    for share in (
        displaced["areas_of_interest"]["beyond"]["stopped"], displaced["areas_of_interest"]["beyond"]["reached"],
        displaced["benches"]["far"]["stopped"], displaced["stopped_in_zones"]["far"],
    ):  # fmt: skip
        assert share["predictive"] == pytest.approx([expected(0.025), expected(0.975)], abs=0.03)
        assert share["interval_95"] == share["predictive"]


def test_the_other_side_of_the_limit_has_the_rest(displaced: dict[str, Any]) -> None:
    near = displaced["benches"]["near"]["stopped"]["predictive"]
    assert near == pytest.approx([1.0 - expected(0.975), 1.0 - expected(0.025)], abs=0.03)


def test_without_a_misfit_the_interval_is_that_of_the_ground_alone(flat: Path, displaced: dict[str, Any]) -> None:
    run = flown(flat, 0.0)
    share = summary(run)["benches"]["far"]["stopped"]
    low, high = share["predictive"]
    assert high - low < 0.03 and low < share["share"] < high
    assert share["share"] == pytest.approx(NormalDist(0.0, SPREAD).cdf(-LIMIT), abs=0.5 / POINTS)
    assert share["share"] == displaced["benches"]["far"]["stopped"]["share"], "the share itself does not change"
    assert run.maps.sets.displaced is None


def test_the_runout_has_the_interval_of_the_length_of_the_error(displaced: dict[str, Any]) -> None:
    """The rocks stop where they land, so their runout is the length of a normal displacement (Rayleigh)."""
    low, high = displaced["runout_m"]["predictive"]["p50"]
    ends = [MISFIT * math.sqrt(-2.0 * math.log(1.0 - share)) for share in (0.025, 0.975)]
    assert [low, high] == pytest.approx(ends, abs=0.15 * MISFIT)
    assert displaced["runout_m"]["p50"] == pytest.approx(0.0, abs=0.05), "the rocks themselves do not move"


def test_a_small_misfit_is_nearly_none(flat: Path) -> None:
    none, little = (summary(flown(flat, misfit))["benches"]["far"]["stopped"]["predictive"] for misfit in (0.0, 0.01))
    assert little == pytest.approx(none, abs=0.01)


def test_the_map_shows_where_the_error_may_bring_rocks(flat: Path) -> None:
    """The rocks drop on the line y = 0; the band of the map is wider because of the misfit."""
    run = flown(flat, MISFIT)
    band, raster = run.maps.reach_band, run.maps.raster
    rows = band.cell // raster.nx
    y = raster.y + (rows + 0.5) * raster.cell
    assert set(run.maps.cells.cell) <= set(band.cell.tolist()) and len(band.cell) > 5 * len(run.maps.cells.cell)
    assert abs(y).max() < 5.0 * MISFIT and (band.high[abs(y) < MISFIT] > 0.0).all()
    assert (band.low <= band.high).all() and band.high.max() <= 1.0


def test_moved_cells_keep_the_rocks_and_their_mean_place() -> None:
    raster = Raster(x=0.0, y=0.0, cell=2.0, nx=20, ny=10)
    cells, rocks = np.array([5 * 20 + 4, 5 * 20 + 5, 6 * 20 + 9]), np.array([3, 2, 5], dtype=np.uint32)
    moved, counts = moved_cells(cells, rocks, np.array([3.0, -1.0]), raster)
    assert counts.sum() == pytest.approx(10.0)
    before = np.array([rocks @ (cells % 20), rocks @ (cells // 20)]) / 10.0
    after = np.array([counts @ (moved % 20), counts @ (moved // 20)]) / 10.0
    assert after - before == pytest.approx([1.5, -0.5])
    assert moved_cells(cells, rocks, np.zeros(2), raster)[0].tolist() == cells.tolist()


def test_rocks_that_move_beyond_the_map_are_left_out() -> None:
    raster = Raster(x=0.0, y=0.0, cell=1.0, nx=4, ny=4)
    moved, counts = moved_cells(np.array([3, 4]), np.array([1, 1]), np.array([1.0, 0.0]), raster)
    assert moved.tolist() == [5] and counts.tolist() == [1.0]


@pytest.fixture(scope="module")
def pit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scene_file(tmp_path_factory.mktemp("misfit"), more=PIT)


def facts_of(run: Run) -> str:
    facts = summary(run)
    for name in ("read_s", "index_s", "wall_s", "compile_s", "fly_s", "rocks_per_s", "engine"):
        facts.pop(name)
    facts["scene"].pop("digest")  # it has the name of the engine
    return json.dumps(facts, sort_keys=True)


def test_engines_and_threads_give_the_same_bits(pit: Path) -> None:
    run = rpf3d.simulate(pit, rocks=200, engine="compiled", threads=2)
    for engine, threads in (("compiled", 5), ("reference", None)):
        other = rpf3d.simulate(pit, rocks=200, engine=engine, threads=threads)
        assert facts_of(other) == facts_of(run)
        assert all(a.tobytes() == b.tobytes() for a, b in zip(run.maps.reach_band, other.maps.reach_band, strict=True))


def test_the_result_says_which_numbers_hold_the_misfit(pit: Path, tmp_path: Path) -> None:
    run = rpf3d.simulate(pit, rocks=400, engine="compiled")
    folder = rpf3d.write_run(run, tmp_path / "out", recording=False)
    facts = json.loads((folder / "summary.json").read_text())
    assert facts["unknowns"]["misfit_m"] == 12.0
    assert "leaves_out" not in facts["runout_m"] and "misfit" in facts["max_speed_m_s"]["leaves_out"]
    assert all("misfit" in outcome["leaves_out"] for outcome in facts["outcomes"].values())
    for place in facts["benches"].values():
        for name in ("reached", "stopped", "retained"):
            share = place[name]
            if share["predictive"] is not None:
                (low, high), (least, most) = share["predictive"], share["sampling"]
                assert low <= least <= share["share"] <= most <= high
    assert any("include this misfit" in sentence for sentence in surer_than_it_may_be(run))


def test_a_zone_of_vertical_facets_alone_is_not_known_in_plan() -> None:
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1)]
    terrain = terrain_of(corners, [(0, 1, 2), (0, 1, 3), (0, 1, 4)], [0, 1, 2], ("flat", "wall", "ramp"))
    assert zones_in_plan(facets_of(terrain), 3).tolist() == [True, False, True]
