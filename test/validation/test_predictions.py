"""Tests of the part of the validation page on predictive intervals: figures can be reproduced, words agree."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from field_cases import authume, predictions, tschamut
from field_cases.basis import EndPoints
from field_cases.blocks import meadow
from field_cases.flying import Ends
from field_cases.models import AUTHUME, COULOMB_LIMITED, SHAPES, TSCHAMUT
from field_cases.page_tables import listed

from rpf3d_core.results import overconfidence
from rpf3d_core.scene.library_entries import UNSTATED
from rpf3d_core.unknowns.dealing import set_of_rock

RESULTS: dict[str, Any] = json.loads((Path(__file__).parents[2] / "docs" / "field_cases" / "results.json").read_text())
CASES = list(predictions.cases_of_books())
ONE_STOP = {site: 1 / stops for site, stops in predictions.STOPS.items()}
"""Site -> share of one stop: on another machine, a stop at the end of an interval may change its side."""
needs_data = pytest.mark.skipif(
    not all(site.DATA.is_dir() for site in (authume, tschamut)), reason="the field data is not there"
)


def ends(along: list[float], across: list[float]) -> EndPoints:
    return EndPoints(np.array(along), np.array(across), np.array(along), np.zeros(len(along)))


def test_rocks_that_did_not_stop_count_as_beyond_every_stop() -> None:
    rocks = ends([1.0, 2.0, 3.0, 4.0], [-1.0, -1.0, 1.0, 1.0])
    assert predictions._places(rocks, np.array([True, True, True, True]), 3.5, 0.0) == (0.75, 0.5)
    assert predictions._places(rocks, np.array([False, False, True, True]), 3.5, 0.0) == (0.25, 0.0)


def test_a_stop_is_held_between_five_and_ninety_five_per_cent_of_the_rocks() -> None:
    assert predictions._within([(0.04, 0.06), (0.06, 0.04), (0.94, 0.5), (0.96, 0.97)]) == (0.5, 0.5)


def test_a_rock_flies_with_the_set_that_the_run_deals_it() -> None:
    """The rocks of a run use the sets in turn, so each set has the same number of rocks."""
    source, rock = np.repeat([1, 0], 128), np.tile(np.arange(128)[::-1], 2)
    sets = predictions._sets_of(source, rock)
    assert np.bincount(sets).tolist() == [4] * predictions.SETS
    assert all(sets[k] == set_of_rock(int(rock[k]), predictions.SETS, int(source[k])) for k in range(256))


def test_at_tschamut_each_stop_is_compared_with_the_rocks_of_its_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rocks of two runs stop at 0 to 20 m and at 100 to 120 m; stops at 10 m and 60 m are inside and outside."""
    monkeypatch.setattr(tschamut, "RUNS", 2)
    monkeypatch.setattr(tschamut, "seen", lambda run, x: ends(x[:, 0].tolist(), x[:, 1].tolist()))
    field = ends([10.0, 60.0], [0.0, 0.0])
    monkeypatch.setattr(tschamut, "runs", lambda: SimpleNamespace(seen=lambda: field))
    x = np.concatenate([np.linspace(0.0, 20.0, 41), np.linspace(100.0, 120.0, 41)])
    y = np.tile(np.linspace(-1.0, 1.0, 41), 2)
    rocks = Ends(np.repeat([0, 1], 41), np.stack([x, y, 0.0 * x], axis=1), np.ones(82, bool))
    assert predictions.coverage(TSCHAMUT, predictions.Predicted(rocks, np.zeros(82, int))) == (0.5, 1.0)


@needs_data
def test_a_rock_has_the_shape_of_its_runs_block_or_not() -> None:
    run, shape = np.repeat(np.arange(tschamut.RUNS), 3), np.tile(np.arange(3), tschamut.RUNS)
    own = meadow.of_its_block(run, shape)
    numbers = list(meadow.blocks())
    assert own.reshape(-1, 3).sum(axis=1).tolist() == [1] * tschamut.RUNS
    assert [numbers[k] for k in shape[own]] == meadow.block_of_run()


def test_the_range_over_sets_is_that_of_each_set_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A set whose rocks all stop at one place has this place as its mean."""
    x = np.repeat(np.arange(predictions.SETS, dtype=float), 3)
    ends = Ends(np.zeros(len(x), int), np.stack([x, 0.0 * x, 0.0 * x], axis=1), np.ones(len(x), bool))
    monkeypatch.setattr(authume, "drop", lambda: np.zeros(3))
    found = predictions._over_sets(AUTHUME, predictions.Predicted(ends, x.astype(int)))
    assert found["mean"] == pytest.approx((0.05 * 63, 0.95 * 63)) and found["sd"] == (0.0, 0.0)
    assert found["beyond"] == (0.0, 1.0)


def test_each_assumed_range_has_a_case_without_it() -> None:
    pairs = {(case.site, case.model): [] for case in CASES}  # type: ignore[var-annotated]
    for case in CASES:
        pairs[case.site, case.model].append(case)
    for (_, model), (with_ranges, with_middle) in pairs.items():
        for zone, material in with_ranges.keys["materials"].items():
            single = {key: predictions.ONE_VALUE[key] for key in predictions.ASSUMED_FOR[model]}
            assert with_middle.keys["materials"][zone] == {**material, **single}


def test_the_one_value_is_within_the_assumed_range() -> None:
    for key, span in UNSTATED.items():
        assert span.low < predictions.ONE_VALUE[key] < span.high


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("k", range(len(CASES)), ids=[f"{c.site}-{c.model.name}-{i}" for i, c in enumerate(CASES)])
def test_the_stated_figures_come_out_again(k: int) -> None:
    case, stated = CASES[k], RESULTS["library"][k]
    assert (case.site, case.model.name, case.ground) == (stated["site"], stated["model"], stated["ground"])
    found = dict(zip(("along", "across"), predictions.coverage(case.site, predictions.predicted(case)), strict=True))
    for way in ("along", "across"):
        assert found[way] == pytest.approx(stated[way], abs=ONE_STOP[case.site] + 0.01), way


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("site", [AUTHUME, TSCHAMUT])
def test_the_stated_figures_with_a_calibration_of_the_other_slope_come_out_again(site: str) -> None:
    """Only the model of a point is simulated; the other models use the same code and take longer."""
    calibrations = {name: RESULTS[name]["calibrations"] for name in (AUTHUME, TSCHAMUT)}
    cases = predictions.cases_of_calibrations(calibrations, same_site=False)
    case = next(one for one in cases if (one.site, one.model) == (site, COULOMB_LIMITED))
    stated = next(x for x in RESULTS["elsewhere"] if (x["site"], x["model"]) == (site, COULOMB_LIMITED.name))
    found = dict(zip(("along", "across"), predictions.coverage(site, predictions.predicted(case)), strict=True))
    for way in ("along", "across"):
        assert found[way] == pytest.approx(stated[way], abs=ONE_STOP[site] + 0.01), way


def shares(lines: list[dict[str, Any]], way: str = "along") -> dict[tuple[str, str, str], float]:
    return {(line["site"], line["model"], line["ground"]): line[way] for line in lines}


def test_the_words_of_the_page_hold() -> None:
    """If new figures contradict the words, change docs/field_cases/prose_elsewhere.py."""
    along, across = shares(RESULTS["library"]), shares(RESULTS["library"], "across")
    library = [share for (_, _, ground), share in along.items() if ground == predictions.LIBRARY]
    assert min(library) >= 5 / 6 - 1e-4, "at least five of six"
    assert 0.2 < along[AUTHUME, COULOMB_LIMITED.name, predictions.SINGLE] < 0.3, "a quarter"
    assert along[TSCHAMUT, COULOMB_LIMITED.name, predictions.SINGLE] == 0.0, "none"
    assert all(share < 0.9 for (_, model, _), share in across.items() if model != SHAPES.name), "too little across"


def test_what_a_run_says_of_samples_of_another_slope_was_measured() -> None:
    words = []
    for site in (TSCHAMUT, AUTHUME):
        found = sorted(predictions.held(line, "along") for line in RESULTS["elsewhere"] if line["site"] == site)
        words.append(f"{listed(list(map(str, found)))} of {predictions.STOPS[site]}")
    assert " and ".join(words) == overconfidence.ELSEWHERE_HELD
