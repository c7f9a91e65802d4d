"""Tests of the automatic size of map cells: by hand for single sources, and independent of how rocks are flown."""

import numpy as np
import pytest

from rpf3d_core.ensemble.releases import Source
from rpf3d_core.hazard.cell_size import coarsest_cell, filled_cell
from rpf3d_core.hazard.maps import FEWEST_ROCKS, reach_probability
from rpf3d_core.hazard.passages import passage_per_metre
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.cells import fewest_rocks, least_cell
from rpf3d_core.setup.prepared import prepare

LOW, HIGH = (0.0, 0.0, 0.0), (1000.0, 800.0, 100.0)
SCENE = """\
terrain: {pit: {triangles: 20000, seed: 1}}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 30}}
rock: {density: 2700, diameter: 1.0}
sources:
  - name: crest
    line: [[-607, -50, 1687], [-606, 0, 1687], [-604, 50, 1687]]
    above_ground: 0.5
    rocks: 200
    velocity: [2, 0, 0]
rebound: constant
ground: sliding
engine: reference
seed: 1
"""


def scene(folder, more=""):
    path = folder / "pit.yaml"
    path.write_text(SCENE + more)
    return read_scene(path)


def source(points, rocks, **more):
    return Source("one", np.array(points, dtype=float), rocks, **more)


def test_a_line_has_the_front_of_its_length_and_a_fifth_of_the_depth_below_it():
    line = source([[0, 0, 100], [0, 180, 100]], 200, line=True)
    assert filled_cell([line], 200, LOW, HIGH) == pytest.approx(20 * (180 + 0.2 * 100) / 200)
    assert filled_cell([line], 2000, LOW, HIGH) == pytest.approx(20 * 200 / 2000)


def test_single_points_far_apart_count_their_own_fronts_only():
    two = source([[0, 0, 100], [0, 500, 100]], 100)
    assert filled_cell([two], 100, LOW, HIGH) == pytest.approx(20 * 2 * 20 / 100)
    near = source([[0, 0, 100], [0, 5, 100]], 100)
    assert filled_cell([near], 100, LOW, HIGH) == pytest.approx(20 * 25 / 100)
    assert filled_cell([], 0, LOW, HIGH) == 0.0


def test_sources_over_one_another_share_a_front():
    lines = [source([[10 * k, 0, 100], [10 * k, 180, 100]], 100, line=True) for k in range(2)]
    assert filled_cell(lines, 200, LOW, HIGH) == pytest.approx(20 * (np.hypot(10, 180) + 20) / 200)


def test_the_coarsest_cell_leaves_a_map():
    assert coarsest_cell(LOW, HIGH) == 50.0


def test_most_cells_of_few_rocks_have_percentiles(tmp_path):
    run = simulate(scene(tmp_path))
    rocks = run.maps.cells.rocks
    assert run.maps.raster.cell == 20.0
    assert np.isfinite(run.maps.cells.energy.p95).sum() > 0
    assert rocks[rocks >= FEWEST_ROCKS].sum() > 0.5 * rocks.sum(), "most visits are to cells that are coloured"


def test_the_cell_falls_with_the_number_of_rocks_to_half_a_facet_and_a_given_cell_stays(tmp_path):
    def cell(rocks, more=""):
        return prepare(scene(tmp_path, more).model_copy(update={"sources": sources(rocks)})).raster.cell

    def sources(rocks):
        return tuple(one.model_copy(update={"rocks": rocks}) for one in scene(tmp_path).sources)

    assert [cell(rocks) for rocks in (20, 200, 1000, 10**7)] == [50.0, 20.0, 5.0, 5.0]
    assert cell(20, "hazard: {cell: 3}\n") == 3.0


def test_rocks_auto_has_the_cell_of_its_fewest_rocks(tmp_path):
    auto = scene(tmp_path, "rocks: auto\n")
    assert fewest_rocks(auto) == 4000
    prepared = prepare(auto)
    of_200 = least_cell(scene(tmp_path), prepared.terrain, prepared.sources)
    assert least_cell(auto, prepared.terrain, prepared.sources) == pytest.approx(of_200 * 200 / 4000)


def test_on_a_pit_passages_per_metre_are_the_same_at_any_cell_and_reach_is_not(tmp_path):
    """A cell of 20 m has the mean of the cells of 2 and 5 m in it."""
    maps = {}
    for cell in (2, 5, 20):
        run = simulate(scene(tmp_path, f"hazard: {{cell: {cell}, passage_per_metre: true}}\n"))
        maps[cell] = run.maps
    coarse, reach = passage_per_metre(maps[20]), {cell: reach_probability(m.cells, 200) for cell, m in maps.items()}
    assert reach[2].max() < reach[5].max() < reach[20].max() > 2.0 * reach[2].max()
    column, row = centres(maps[20])
    for cell in (2, 5):
        value = passage_per_metre(maps[cell]).value
        inside = [np.floor(x / 20.0 + 1e-9) for x in centres(maps[cell])]
        for x, y, told, low, high in zip(column, row, *coarse, strict=True):
            here = (inside[0] == np.floor(x / 20.0)) & (inside[1] == np.floor(y / 20.0))
            mean = value[here].sum() * (cell / 20.0) ** 2
            assert low <= mean <= high or mean == pytest.approx(told, abs=1e-9)
            assert mean == pytest.approx(told, abs=1e-7)


def centres(maps):
    """Return the eastings and northings (S,) m of the centres of reached cells, with a raster aligned to (0, 0)."""
    raster = maps.raster
    row, column = np.divmod(maps.cells.cell, raster.nx)
    origin = np.round(raster.x / raster.cell) * raster.cell, np.round(raster.y / raster.cell) * raster.cell
    return origin[0] + (column + 0.5) * raster.cell, origin[1] + (row + 0.5) * raster.cell
