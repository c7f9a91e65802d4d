"""Tests that a rim that hangs over other ground, below which rocks can fly, is reported."""

import numpy as np
import pytest
from flights.on_both_engines import BOTH
from flights.scenes_of_facets import engine_over, flight, floor, fly, joined, rough_grid, surface, terrain_of

from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.setup.warnings import hanging_rims as hanging_rims_module
from rpf3d_core.setup.warnings.hanging_rims import hanging_rim, hanging_rims
from rpf3d_core.simulation.engines import Reference
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import Outcome


def heap(rim: float) -> Terrain:
    """Return a level floor and above it a pyramid, 3 m high, with a square base of 6 m at the height `rim` (m)."""
    corners = [(-3, -3, rim), (3, -3, rim), (3, 3, rim), (-3, 3, rim), (0, 0, rim + 3.0)]
    return joined(floor(10.0), terrain_of(corners, [(k, (k + 1) % 4, 4) for k in range(4)]))


@BOTH
@pytest.mark.parametrize("rim", [0.2, 1.0])
def test_a_heap_whose_rim_hangs_in_the_air_is_reported_with_its_height(engine, rim):
    found = hanging_rim(heap(rim), engine_over(engine, heap(rim)))
    assert found.length == pytest.approx(24.0)
    assert found.whole == pytest.approx(24.0 + 80.0)
    assert found.height == pytest.approx(rim, abs=1e-6)
    assert found.place[2] == pytest.approx(rim)


@BOTH
@pytest.mark.parametrize("rim", [-1.0, 0.0, 0.05])
def test_a_heap_whose_rim_is_buried_or_lies_on_the_ground_is_not(engine, rim):
    assert hanging_rim(heap(rim), engine_over(engine, heap(rim))) is None


def test_a_terrain_of_one_sheet_has_no_hanging_rim():
    slope = rough_grid(8, 8.0, 1.0, 0.3)
    assert hanging_rim(slope, engine_over("reference", slope)) is None


def test_a_crest_whose_face_is_missing_hangs_over_the_floor():
    """The terrain is two level benches, 4 m apart in height, without the upright face between them."""
    corners = [(x, y, z) for x, z in ((-9, 4), (0, 4), (0, 0), (9, 0)) for y in (0.0, 5.0)]
    benches = terrain_of(corners, [(0, 2, 3), (0, 3, 1), (4, 6, 7), (4, 7, 5)])
    (sentence,) = hanging_rims(benches, engine_over("reference", benches))
    assert sentence.startswith(
        "5 m of the terrain's rim (56 m) hang over other ground, up to 4 m at (0.000, 2.500, 4.000)"
    )


def test_long_rims_are_written_in_full():
    corners = [(x, y, z) for x, z in ((-9, 4), (0, 4), (0, 0), (9, 0)) for y in (0.0, 1000.0)]
    benches = terrain_of(corners, [(0, 2, 3), (0, 3, 1), (4, 6, 7), (4, 7, 5)])
    (sentence,) = hanging_rims(benches, engine_over("reference", benches))
    assert sentence.startswith("1,000 m of the terrain's rim (4,040 m) hang over other ground")


@BOTH
def test_under_such_a_rim_a_rock_flies_and_hits_the_heap_from_behind(engine):
    """A check that counts all space below the heap as ground would report this rock as fallen through."""
    flights = fly(engine_over(engine, heap(1.0)), flight(surface(0.9, 0.9), "none"), (-3.2, 0.3, 0.1), (2.0, 0.0, 8.0))
    behind = flights.impacts.normal[:, 2] < 0.0
    assert behind.any() and np.abs(flights.impacts.x[behind, :2]).max() < 3.0
    assert Outcome.FELL_THROUGH not in flights.deposits.outcome


@pytest.mark.parametrize("has_numba", [True, False])
def test_a_long_rim_is_not_searched_side_by_side_with_the_slow_engine(monkeypatch, has_numba):
    """A rim of 800 sides, of which half hang: the reference engine would take a minute for rims of real surveys."""
    level, upper = floor(10.0, cells=100), floor(5.0, 2.0, cells=100)
    asked = []
    search = Reference.ground_below
    monkeypatch.setattr(Reference, "ground_below", lambda engine, x: asked.append(len(x)) or search(engine, x))
    monkeypatch.setattr(hanging_rims_module, "HAS_NUMBA", has_numba and HAS_NUMBA)
    found = hanging_rim(joined(level, upper), engine_over("reference", joined(level, upper)))
    assert sum(asked) <= 100
    assert found.length == pytest.approx(40.0, abs=2.0) and found.whole == pytest.approx(120.0)
    assert found.height == pytest.approx(2.0)
    is_sample = not (has_numba and HAS_NUMBA)
    assert (found.searched, found.sides) == (100 if is_sample else 800, 800)
    (told,) = hanging_rims(joined(level, upper), engine_over("reference", joined(level, upper)))
    assert told.startswith("about ") == is_sample
    assert ("over other ground (from 100 of 800 sides), up to at least 2 m at (" in told) == is_sample
