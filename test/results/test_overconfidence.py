"""Tests of the list of reasons why the results of a run look more certain than they are."""

import re
from collections import Counter
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import grid, write_binary_stl

import rpf3d_core as rpf3d
from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.results.overconfidence import (
    _of_the_edge,
    _of_the_unfinished,
    behind_a_crest,
    busiest_place,
    surer_than_it_may_be,
)
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.unknowns.parameter_sets import parameter_sets, write_parameter_sets
from rpf3d_core.values import UNSTOPPED, Outcome

NAMED_ELSEWHERE = (Outcome.LEFT_TERRAIN, Outcome.LOST_TO_HOLE)
"""Outcomes that other sentences and warnings are on."""

SCENE = """\
terrain: {files: [{path: slope.stl, zone: rock}]}
materials:
  rock: {normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 45}
sources: [{name: a, points: [[1.3, 1.2, 9]], rocks: 30}]
stop_speed: 0.4
rebound: constant
ground: sliding
engine: reference
"""
SPREAD = ("rocks: 30}", "rocks: 30, spread: [0.3, 0.3, 0.2], velocity: [1, 0.3, 0]}")
UNKNOWN = ("normal_restitution: 0.5", "normal_restitution: {prior: {min: 0.4, max: 0.6}}")


def sentences(folder: Path, *changes: tuple[str, str], rocks: int | None = None) -> list[str]:
    vertices, triangles = grid(5, 6)
    write_binary_stl(folder / "slope.stl", vertices[triangles])
    text = SCENE
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (folder / "scene.yaml").write_text(text)
    return surer_than_it_may_be(rpf3d.simulate(folder / "scene.yaml", rocks=rocks))


def has(found: list[str], words: str) -> bool:
    return any(words in sentence for sentence in found)


def test_rocks_on_one_path_are_repetitions(tmp_path: Path) -> None:
    assert has(sentences(tmp_path), "the rocks fly along one path")
    two = ("points: [[1.3, 1.2, 9]]", "points: [[1.3, 1.2, 9], [2.5, 2.5, 8]]")
    assert has(sentences(tmp_path, two), "the rocks fly along 2 paths")
    assert not has(sentences(tmp_path, SPREAD), "fly along")
    assert not has(sentences(tmp_path, rocks=1), "fly along"), "one rock is no repetition"


def test_known_ground_ranges_and_a_sample_differ(tmp_path: Path) -> None:
    sets = parameter_sets(["materials.rock.normal_restitution"], [[0.45], [0.5], [0.55]])
    write_parameter_sets(tmp_path / "posterior.parquet", sets)
    sample = ("stop_speed: 0.4", "stop_speed: 0.4\nunknowns: {sample: posterior.parquet}")
    assert has(sentences(tmp_path, SPREAD), "every coefficient counts as known")
    assert has(sentences(tmp_path, SPREAD, UNKNOWN), "not from a calibration")
    found = sentences(tmp_path, SPREAD, sample)
    assert not has(found, "counts as known") and not has(found, "calibration")
    assert has(found, "materials.rock.tangential_restitution, materials.rock.friction_angle_deg: one value")


ALL_UNKNOWN = """\
unknowns: {priors: {materials.*.tangential_restitution: {min: 0.7, max: 0.9},
                    materials.*.friction_angle_deg: {min: 15, max: 45}}}
rebound: constant
"""


def test_coefficients_with_one_value_next_to_ranges_are_named(tmp_path: Path) -> None:
    words = "one value in all parameter sets"
    found = sentences(tmp_path, SPREAD, UNKNOWN)
    rest = "materials.rock.tangential_restitution, materials.rock.friction_angle_deg"
    assert has(found, f"{rest}: {words}")
    assert not has(sentences(tmp_path, SPREAD, UNKNOWN, ("rebound: constant\n", ALL_UNKNOWN)), words)
    idle = ("ground: sliding", "ground: none")
    assert has(sentences(tmp_path, SPREAD, UNKNOWN, idle), f"materials.rock.tangential_restitution: {words}")
    assert not has(sentences(tmp_path, SPREAD), words), "without unknowns, another sentence says it of all coefficients"


SPHERE = ("sources:", "rock: {shape: sphere}\nsources:")


def test_only_coefficients_that_the_models_use_are_named_and_one_that_is_left_out_is_0(tmp_path: Path) -> None:
    changes = (SPHERE, ("rebound: constant\nground: sliding\n", ""))
    (found,) = [each for each in sentences(tmp_path, SPREAD, UNKNOWN, *changes) if "one value in all" in each]
    assert found.startswith("materials.rock.friction_angle_deg, materials.rock.rolling_friction: ")


def test_a_range_that_the_sample_does_not_hold_is_named(tmp_path: Path) -> None:
    sets = parameter_sets(["materials.rock.tangential_restitution"], [[0.75], [0.8], [0.85]])
    write_parameter_sets(tmp_path / "posterior.parquet", sets)
    sample = ("stop_speed: 0.4", "stop_speed: 0.4\nunknowns: {sample: posterior.parquet}")
    found = sentences(tmp_path, SPREAD, UNKNOWN, sample)
    assert has(found, "ranges of materials.rock.normal_restitution are from books or estimates, because the sample")


@pytest.mark.parametrize(("misfit", "named"), [(4.1, True), (0.2, False)])
def test_the_misfit_that_a_calibration_found_is_named(tmp_path: Path, misfit: float, named: bool) -> None:
    sets = parameter_sets(["materials.rock.normal_restitution"], [[0.45], [0.5], [0.55]])
    write_parameter_sets(tmp_path / "posterior.parquet", sets)
    sample = ("stop_speed: 0.4", f"stop_speed: 0.4\nunknowns: {{sample: posterior.parquet, misfit: {misfit}}}")
    assert has(sentences(tmp_path, SPREAD, sample), f"differ from the model's by {misfit} m") == named


def test_a_run_of_too_few_sets_is_named(tmp_path: Path) -> None:
    assert has(sentences(tmp_path, SPREAD, UNKNOWN, rocks=30), "only 30 of 64 parameter sets have flown")
    assert not has(sentences(tmp_path, SPREAD, UNKNOWN, rocks=64), "parameter sets have flown")


def test_a_run_that_was_stopped_is_not_told_to_fly_more_rocks_for_each_set(tmp_path: Path) -> None:
    sentences(tmp_path, SPREAD, UNKNOWN, rocks=30)
    run = replace(rpf3d.simulate(tmp_path / "scene.yaml", rocks=30), planned=6400)
    (found,) = [each for each in surer_than_it_may_be(run) if "parameter sets" in each and "not known" in each]
    assert found == (
        "the run was stopped after 30 of 64 parameter sets: predictive intervals are not known; let the run end"
    )


def test_places_that_few_rocks_reached_are_named(tmp_path: Path) -> None:
    words = "energies in rock are unknown: fewer than 20 rocks reached them"
    assert has(sentences(tmp_path, SPREAD, rocks=19), words)
    assert not has(sentences(tmp_path, SPREAD, rocks=20), words)


def test_a_map_that_rocks_do_not_fill_is_named(tmp_path: Path) -> None:
    fine = ("stop_speed: 0.4", "stop_speed: 0.4\nhazard: {cell: 0.01}")
    coarse = ("stop_speed: 0.4", "stop_speed: 0.4\nhazard: {cell: 50}")
    assert has(sentences(tmp_path, SPREAD, fine), "cells of 0.01 m are finer than the rocks fill")
    assert not has(sentences(tmp_path, SPREAD, coarse), "finer than")


def test_the_cell_that_is_named_is_one_that_the_rocks_fill(tmp_path: Path) -> None:
    fine = ("stop_speed: 0.4", "stop_speed: 0.4\nhazard: {cell: 0.01}")
    (found,) = [each for each in sentences(tmp_path, SPREAD, fine) if "finer than the rocks fill" in each]
    size = re.search(r"set `hazard\.cell: ([\d.]+)`", found)
    assert size is not None
    assert not has(sentences(tmp_path, SPREAD, (fine[0], fine[1].replace("0.01", size[1]))), "finer than")


@pytest.mark.parametrize(("height", "stayed"), [(0.5, True), (9.0, False)])
def test_rocks_that_did_not_fall_are_counted(tmp_path: Path, height: float, stayed: bool) -> None:
    flat = [[0, 0, 0], [60, 0, 0], [60, 60, 0], [0, 60, 0]]
    write_binary_stl(tmp_path / "flat.stl", np.array(flat, dtype=float)[[[0, 1, 2], [0, 2, 3]]])
    changes = (("slope.stl", "flat.stl"), ("[[1.3, 1.2, 9]]", f"[[30, 30, {height}]]"), SPREAD)
    assert has(sentences(tmp_path, *changes), "all 30 rocks of source 'a' stopped less than 2 m below") is stayed


def test_a_source_behind_a_crest_is_noticed_among_others(tmp_path: Path) -> None:
    """The 20 rocks of this source are only a tenth of all rocks, so a share of all rocks would not reveal it."""
    flat = [[0, 0, 0], [60, 0, 0], [60, 60, 0], [0, 60, 0]]
    write_binary_stl(tmp_path / "flat.stl", np.array(flat, dtype=float)[[[0, 1, 2], [0, 2, 3]]])
    one = "{{name: {}, points: [[30, 30, {}]], rocks: {}, spread: [0.3, 0.3, 0.2]}}"
    both = f"{one.format('crest', 9, 180)}, {one.format('ledge', 0.5, 20)}"
    found = sentences(tmp_path, ("slope.stl", "flat.stl"), ("{name: a, points: [[1.3, 1.2, 9]], rocks: 30}", both))
    assert has(found, "all 20 rocks of source 'ledge' stopped less than 2 m below their release")
    assert not has(found, "'crest'")


def test_rocks_that_went_on_are_not_rounded_away() -> None:
    drop = np.where(np.arange(1000) < 999, 0.0, 9.0)[:, None] * [0.0, 0.0, 1.0]
    whole, zeros = np.zeros(1000, dtype=np.int64), np.zeros(1000)
    deposits = Deposits(
        source=whole, rock=np.arange(1000), outcome=np.full(1000, Outcome.STOPPED), facet=whole, release=drop,
        x=np.zeros((1000, 3)), t=zeros, path=zeros, impacts=whole, max_speed=zeros, max_energy=zeros, max_height=zeros,
        ground_speed=zeros, mass=zeros,
    )  # fmt: skip
    assert next(behind_a_crest(deposits, ["a"])).startswith("999 of 1,000 rocks of source 'a' stopped")


def test_rocks_that_flew_past_the_edge_are_counted_with_the_place(tmp_path: Path) -> None:
    """All rocks leave the terrain over its eastern edge, at x = 5 m."""
    fast = ("rocks: 30}", "rocks: 30, velocity: [30, 0, 3]}")
    words = "30 of 30 rocks flew past the edge of the terrain, so nothing is known about where they stop; "
    (found,) = (sentence for sentence in sentences(tmp_path, fast) if sentence.startswith(words))
    assert "; 100 % of them did near E 5, N 1." in found


def test_rocks_that_flew_past_the_edge_are_counted_among_all_rocks(tmp_path: Path) -> None:
    """A large run keeps only some of its rocks for display."""
    sentences(tmp_path, ("rocks: 30}", "rocks: 30, velocity: [30, 0, 3]}"))
    run = rpf3d.simulate(tmp_path / "scene.yaml")
    deposits = run.flights.deposits
    some = replace(deposits, **{name: getattr(deposits, name)[:7] for name in ("x", "outcome", "release", "source")})
    kept = replace(run, flights=replace(run.flights, deposits=some))
    assert has(list(_of_the_edge(kept)), "30 of 30 rocks flew past the edge")


def test_the_place_of_the_edge_is_in_the_coordinates_of_the_input(tmp_path: Path) -> None:
    sentences(tmp_path)
    run = rpf3d.simulate(tmp_path / "scene.yaml")
    deposits = run.flights.deposits
    left = replace(deposits, outcome=np.full(30, Outcome.LEFT_TERRAIN), x=np.tile([3.0, 2.0, 1.0], (30, 1)))
    totals = copy(run.totals)
    totals.outcomes = Counter({Outcome.LEFT_TERRAIN: 30})
    frame = Frame(origin=(500.0, -7000.0, 90.0), up="y")
    turned = replace(run, flights=replace(run.flights, deposits=left), totals=totals,
                     prepared=replace(run.prepared, terrain=replace(run.terrain, frame=frame)))  # fmt: skip
    assert has(list(_of_the_edge(turned)), "near x 503, z 6,998.")
    totals.outcomes = Counter({Outcome.STOPPED: 30})
    assert not list(_of_the_edge(turned))


@pytest.mark.parametrize("outcome", [outcome for outcome in UNSTOPPED if outcome not in NAMED_ELSEWHERE])
def test_rocks_that_did_not_finish_may_go_on(tmp_path: Path, outcome: Outcome) -> None:
    sentences(tmp_path)
    run = rpf3d.simulate(tmp_path / "scene.yaml")
    totals = copy(run.totals)
    totals.outcomes = Counter({outcome: 12, Outcome.STOPPED: 18})
    (sentence,) = _of_the_unfinished(replace(run, totals=totals))
    assert sentence.startswith("12 of 30 rocks ") and sentence.endswith(" may be too small")


def test_rocks_that_fell_through_the_ground_are_called_a_fault_of_rpf3d(tmp_path: Path) -> None:
    sentences(tmp_path)
    run = rpf3d.simulate(tmp_path / "scene.yaml")
    totals = copy(run.totals)
    totals.outcomes = Counter({Outcome.STOPPED: 18, Outcome.FELL_THROUGH: 12})
    (sentence,) = _of_the_unfinished(replace(run, totals=totals))
    assert sentence.startswith("12 of 30 rocks were found below the ground, a fault of rpf3d: ")


def test_the_busiest_place_is_that_of_most_points() -> None:
    rng = np.random.default_rng(3)
    few, many = rng.normal((10.0, 10.0), 0.5, (40, 2)), rng.normal((510.0, 85.0), 0.5, (60, 2))
    far = [[9e3, 0.0, 0.0]]
    points = np.concatenate([np.pad(few, ((0, 0), (0, 1))), np.pad(many, ((0, 0), (0, 1))), far])
    place, share = busiest_place(points, 25.0)
    assert place.tolist() in points[40:100].tolist() and place[:2] == pytest.approx(many.mean(axis=0), abs=0.5)
    assert share == 60 / 101
    assert busiest_place(np.array([[7.0, 8.0, 9.0]]), 25.0)[0].tolist() == [7.0, 8.0, 9.0]


@pytest.mark.parametrize(("east", "is_partly_off"), [(3.9, False), (12.0, True)])
def test_rocks_that_left_the_terrain_may_have_reached_an_area_that_is_partly_off_it(
    tmp_path: Path, east: float, is_partly_off: bool
) -> None:
    area = f"ground: sliding\nareas_of_interest: [{{name: shop, polygons: [[2, 0.1], [{east}, 0.1], [{east}, 3]]}}]"
    fast = ("rocks: 30}", "rocks: 30, velocity: [30, 0, 3]}")
    found = sentences(tmp_path, fast, ("ground: sliding", area))
    assert has(found, "of shop (area) lies on the terrain: with the 30 rocks that left") == is_partly_off
