"""Tests that both locators find every facet: at the border, on walls, far away, and wide facets over narrow ones."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from flights.scenes_of_facets import (
    engine_over,
    flight,
    floor,
    fly,
    joined,
    rough_grid,
    same_bits,
    strip,
    surface,
    terrain_of,
)

from rpf3d_core.detection.bucket_grid import BUCKETS_PER_FACET, ENTRIES_PER_FACET, FEWEST_BUCKETS
from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.simulation.engines import Compiled, Reference
from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.benches.slope import benches_terrain
from rpf3d_core.terrain.facets import Terrain, facets_of

pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine to compare with")


def both(terrain: Terrain, x, v):
    reference, compiled = (fly(engine_over(name, terrain), flight(surface()), x, v) for name in FOUND)
    assert same_bits(reference, compiled)
    return compiled


FOUND = ("reference", "compiled")


@pytest.mark.parametrize("cells", range(2, 21))
def test_a_rock_aimed_at_the_rim_hits_alike(cells):
    size = 0.1 * cells * 3
    terrain = rough_grid(cells, size, 0.0, 0.0)
    fall = np.sqrt(2.0 / 9.81)
    # Onto all four sides of the grid, and onto its corners, from inside and from outside.
    ends = [(a * size, b * size) for a in (0.0, 0.37, 1.0) for b in (0.0, 0.37, 1.0)]
    starts = [(0.4 * size, 0.3 * size), (1.5 * size, 0.4 * size), (-0.5 * size, 1.5 * size)]
    aims = [((*s, 1.0), ((e[0] - s[0]) / fall, (e[1] - s[1]) / fall, 0.0)) for s in starts for e in ends]
    both(terrain, [x for x, _ in aims], [v for _, v in aims])
    high = terrain.vertices[:, 0].max()
    rim = both(terrain, [(high, y, 1.0) for y in np.linspace(0.0, size, 7)], (0.0, 0.0, 0.0))
    assert (rim.deposits.impacts >= 1).all()


@pytest.mark.parametrize("turn", [0.0, 90.0, 30.0])
def test_walls_alone_are_hit_by_both_and_soon(turn):
    wall = strip([(0.0, 10.0), (0.0, 0.0)], half_width=6.0, across=4, strike=turn)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    flights = both(wall, [(5.0 * c, 5.0 * s, 8.0)], [(-8.0 * c, -8.0 * s, 0.0)])
    assert flights.deposits.impacts[0] >= 1


def stray() -> Terrain:
    return terrain_of([(9e4, 9e4, 0), (9e4 + 1, 9e4, 0), (9e4, 9e4 + 1, 0)], [(0, 1, 2)])


def sliver() -> Terrain:
    """Return a terrain of one narrow facet below the rough ground, which reaches far beyond it."""
    return terrain_of([(-1, -1, -500), (9e4, 9e4, -500), (9e4, 9e4 + 1, -500)], [(0, 1, 2)])


GROUND = rough_grid(40, 40.0, 0.4, 0.3, seed=4)
SCENES = {
    "a stray triangle": joined(GROUND, stray()),
    "a sliver to far away": joined(GROUND, sliver()),
    "wide facets around": joined(GROUND, floor(5000.0, z=-100.0, cells=4)),
    "many wide facets": joined(GROUND, *(floor(5000.0, z=-100.0 - k) for k in range(100))),
    "ground alone": GROUND,
}


@pytest.mark.parametrize("name", SCENES)
def test_buckets_stay_small_and_few(name):
    facets = facets_of(SCENES[name])
    locator = bucket_locator(facets)
    count = len(facets.zone)
    assert locator.nx * locator.ny <= max(BUCKETS_PER_FACET * count, FEWEST_BUCKETS)
    assert len(locator.ids) <= ENTRIES_PER_FACET * count
    if name in ("a stray triangle", "a sliver to far away", "ground alone"):
        assert locator.cell < 2.0
        assert np.median(np.diff(locator.starts)) < 20


def test_every_facet_stands_in_the_bucket_of_each_of_its_points():
    for terrain in SCENES.values():
        facets = facets_of(terrain)
        grid = bucket_locator(facets)
        weights = np.random.default_rng(6).dirichlet((1, 1, 1), len(facets.zone))
        points = np.einsum("fk,fkj->fj", weights, facets.corners.reshape(-1, 3, 3))
        i = np.clip(np.floor((points[:, 0] - grid.x) / grid.cell), 0, grid.nx - 1).astype(int)
        j = np.clip(np.floor((points[:, 1] - grid.y) / grid.cell), 0, grid.ny - 1).astype(int)
        k = j * grid.nx + i
        assert all(f in grid.ids[grid.starts[b] : grid.starts[b + 1]] for f, b in enumerate(k))


NAN = """
import sys
sys.path[:0] = sys.argv[1:]
import math
from flights.scenes_of_facets import floor
from rpf3d_core.arc import Arc
from rpf3d_core.detection.contact import NOTHING_LEFT, first_contact
from rpf3d_core.detection.vtk_locator import VtkLocator
from rpf3d_core.terrain.facets import facets_of
facets = facets_of(floor())
locator = VtkLocator(facets)
for x, v, end in (((math.nan, 0.0, 1.0), (1.0, 0.0, 0.0), 9.0), ((0.0, 0.0, 1.0), (math.nan, 0.0, 0.0), 9.0),
                  ((0.0, 0.0, 1.0), (30.0, 0.0, 0.0), math.nan)):
    first_contact(locator, facets, Arc(x, v, 9.81), NOTHING_LEFT, end)
print("done")
"""


def test_a_walk_along_an_arc_that_is_no_number_ends():
    folders = [str(Path(__file__).parents[1] / "support"), str(Path(__file__).parents[2])]
    done = subprocess.run(
        [sys.executable, "-c", NAN, *folders], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout == "done\n", done.stderr


class Counted:
    """Stands in for VTK's locator and counts the searched boxes in `boxes`."""

    def __init__(self, locator: object) -> None:
        self.locator, self.boxes = locator, 0

    def FindCellsWithinBounds(self, box: list[float], found: object) -> None:
        self.boxes += 1
        self.locator.FindCellsWithinBounds(box, found)  # type: ignore[attr-defined]


@pytest.mark.parametrize("height", [5.0, 8e2, 8.15e5])
def test_a_place_far_above_the_terrain_needs_few_boxes(height: float) -> None:
    """A source in a file in millimetres starts 815 km above a terrain in metres."""
    facets = facets_of(benches_terrain(Benches(number=1, roughness=0.1)))
    engine = Reference(facets)
    engine.locator.locator = counted = Counted(engine.locator.locator)
    place = np.array([[50.0, 30.0, facets.high[2] + height]])
    place[0, :2] = 0.5 * (np.array(facets.low[:2]) + np.array(facets.high[:2]))
    found = engine.ground_below(place)
    assert np.array_equal(found, Compiled(facets).ground_below(place))
    assert found[0, 1] >= 0 and found[0, 0] > height
    assert counted.boxes < 30


def test_under_the_ground_both_engines_find_nothing_and_search_few_boxes() -> None:
    """No rock looks straight down, so no check follows whether a rock has fallen through the ground."""
    facets = facets_of(benches_terrain(Benches(number=1, roughness=0.1)))
    engine = Reference(facets)
    engine.locator.locator = counted = Counted(engine.locator.locator)
    place = np.array([[*0.5 * (np.array(facets.low[:2]) + np.array(facets.high[:2])), facets.low[2] + 1e-3]])
    assert engine.ground_below(place).tolist() == [[0.0, -1.0, 1.0]]
    assert np.array_equal(engine.ground_below(place), Compiled(facets).ground_below(place))
    assert counted.boxes < 30
