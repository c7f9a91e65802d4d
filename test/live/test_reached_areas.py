"""Tests of which paths cross an area of interest in plan, also between the points of a path."""

import numpy as np
import pytest

from rpf3d_core.live.areas import reached_by

SQUARE = np.array([[10.0, 10.0, 3.0], [12.0, 10.0, 3.0], [12.0, 12.0, 3.0], [10.0, 12.0, 3.0], [10.0, 10.0, 3.0]])
PATHS = {
    "passes between its points": [[0.0, 11.0, 9.0], [30.0, 11.0, 0.0]],
    "stops before it": [[0.0, 11.0, 9.0], [9.9, 11.0, 0.0]],
    "stops inside": [[0.0, 0.0, 9.0], [11.0, 11.0, 0.0]],
    "is a point inside": [[11.0, 11.0, 0.0]],
    "is a point outside": [[13.0, 11.0, 0.0]],
    "touches a corner": [[8.0, 12.0, 0.0], [12.0, 8.0, 0.0]],
    "goes around": [[9.0, 9.0, 0.0], [13.0, 9.0, 0.0], [13.0, 13.0, 0.0]],
}
REACHED = [True, False, True, True, False, True, False]


def paths():
    sizes = [len(path) for path in PATHS.values()]
    return np.concatenate(list(map(np.array, PATHS.values()))), np.cumsum([0, *sizes[:-1]])


def test_a_path_reaches_an_area_that_it_crosses_or_touches_in_plan():
    found = reached_by([[SQUARE]], *paths())
    assert dict(zip(PATHS, found.tolist(), strict=True)) == dict(zip(PATHS, REACHED, strict=True))


def test_any_of_several_areas_counts_and_a_hole_is_part_of_its_area():
    outer = np.array([[-5.0, -5.0], [40.0, -5.0], [40.0, 40.0], [-5.0, 40.0]])
    assert reached_by([[outer, SQUARE]], *paths()).all()
    assert reached_by([[SQUARE + 100.0], [SQUARE]], *paths()).tolist() == REACHED


@pytest.mark.parametrize("areas", [[], [[]], [[SQUARE[:2]]]])
def test_without_an_area_that_encloses_anything_no_path_reaches_one(areas):
    assert not reached_by(areas, *paths()).any()


def test_an_outline_that_crosses_itself_still_counts():
    bow = np.array([[10.0, 10.0], [12.0, 12.0], [12.0, 10.0], [10.0, 12.0]])
    assert reached_by([[bow]], *paths()).tolist()[0]


def test_without_paths_none_reaches_an_area():
    assert reached_by([[SQUARE]], np.empty((0, 3)), np.empty(0, dtype=np.int64)).tolist() == []
