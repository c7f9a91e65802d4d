"""The part of the validation page on predictive intervals: its figures come out again, and its words hold."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from field_cases import authume, ranges, tschamut
from field_cases.basis import EndPoints

from rpf3d_core.results import certainty
from rpf3d_core.scene.library_entries import UNSTATED

RESULTS: dict[str, Any] = json.loads((Path(__file__).parents[2] / "docs" / "field_cases" / "results.json").read_text())[
    "ranges"
]
CASES = list(ranges.cases_of_books())
ONE_STOP = {site: 1 / stops for site, stops in ranges.STOPS.items()}
"""Share of one stop: on another machine, a stop at the end of an interval may change its side."""
needs_data = pytest.mark.skipif(
    not all(site.DATA.is_dir() for site in (authume, tschamut)), reason="the field data is not there"
)


def ends(along: list[float], across: list[float]) -> EndPoints:
    return EndPoints(np.array(along), np.array(across), np.array(along), np.zeros(len(along)))


def test_rocks_that_did_not_stop_count_as_beyond_every_stop() -> None:
    rocks = ends([1.0, 2.0, 3.0, 4.0], [-1.0, -1.0, 1.0, 1.0])
    assert ranges._places(rocks, np.array([True, True, True, True]), 3.5, 0.0) == (0.75, 0.5)
    assert ranges._places(rocks, np.array([False, False, True, True]), 3.5, 0.0) == (0.25, 0.0)


def test_a_stop_is_held_between_five_and_ninety_five_per_cent_of_the_rocks() -> None:
    assert ranges._within([(0.04, 0.06), (0.06, 0.04), (0.94, 0.5), (0.96, 0.97)]) == (0.5, 0.5)


def test_each_assumed_range_has_a_case_without_it() -> None:
    pairs = {(case.site, case.rocks): [] for case in CASES}  # type: ignore[var-annotated]
    for case in CASES:
        pairs[case.site, case.rocks].append(case)
    for (_, rocks), (with_ranges, with_middle) in pairs.items():
        for zone, material in with_ranges.keys["materials"].items():
            single = {key: ranges.ONE_VALUE[key] for key in ranges.ASSUMED_FOR[rocks]}
            assert with_middle.keys["materials"][zone] == {**material, **single}


def test_the_one_value_is_within_the_assumed_range() -> None:
    for key, span in UNSTATED.items():
        assert span.low < ranges.ONE_VALUE[key] < span.high


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("k", range(len(CASES)), ids=[f"{c.site}-{c.rocks}-{i}" for i, c in enumerate(CASES)])
def test_the_stated_figures_come_out_again(k: int) -> None:
    case, stated = CASES[k], RESULTS["books"][k]
    assert (case.site, case.rocks, case.ground) == (stated["site"], stated["rocks"], stated["ground"])
    found = ranges.covered(case)
    for way in ("along", "across"):
        assert found[way] == pytest.approx(stated[way], abs=ONE_STOP[case.site] + 0.01), way


def shares(lines: list[dict[str, Any]], way: str = "along") -> dict[tuple[str, str, str], float]:
    return {(line["site"], line["rocks"], line["ground"]): line[way] for line in lines}


def test_the_words_of_the_page_hold() -> None:
    """Fails where new figures ask for other words in docs/field_cases/prose_ranges.py."""
    along, across = shares(RESULTS["books"]), shares(RESULTS["books"], "across")
    assert all(share > 0.9 for (_, _, ground), share in along.items() if ground == ranges.LIBRARY), "nearly all stops"
    assert 0.2 < along[ranges.AUTHUME, ranges.POINTS, ranges.SINGLE] < 0.3, "a quarter"
    assert along[ranges.TSCHAMUT, ranges.POINTS, ranges.SINGLE] == 0.0, "none"
    assert all(share < 0.9 for (_, rocks, _), share in across.items() if rocks != ranges.BLOCKS), "too little across"


def test_what_a_run_says_of_samples_of_another_slope_was_measured() -> None:
    found = sorted(RESULTS["elsewhere"], key=lambda line: ranges.held(line, "along"))
    words = [ranges.held_of_all(line, "along") for line in found]
    assert f"{', '.join(words[:-1])} and {words[-1]}" == certainty.ELSEWHERE_HELD
