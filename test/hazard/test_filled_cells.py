"""Tests that the advice for a map with many empty cells names a cell size or a number of rocks that fills them."""

from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.hazard.filled_cells import (
    ReachedCells,
    filling_cell,
    reached_cells,
    rocks_that_fill,
    share_of_cells,
    share_of_visits,
)
from rpf3d_core.runs.run import simulate

SCENE = """\
terrain: {{benches: {{number: 2, height: 12, berm: 6, width: 160}}}}
materials: {{default: {{normal_restitution: {{mean: 0.3, sd: 0.15, min: 0, max: 0.6}}, tangential_restitution: 0.85}}}}
rock: {{density: 2500, diameter: 0.8}}
sources: [{{name: top, crest: 1, above_ground: 1, rocks: 300, velocity: [2, 0, 0], velocity_spread: [3, 1, 0]}}]
engine: reference
hazard: {{cell: {cell:g}}}
"""


def reached(folder: Path, cell: float) -> ReachedCells:
    (folder / "scene.yaml").write_text(SCENE.format(cell=cell))
    return reached_cells(simulate(folder / "scene.yaml").maps)


def test_the_named_cell_is_filled_and_one_of_half_its_size_is_not(tmp_path: Path) -> None:
    fine = reached(tmp_path, 0.25)
    assert share_of_visits(fine.rocks) < 0.5
    size = filling_cell(fine)
    assert size is not None
    assert share_of_visits(reached(tmp_path, size).rocks) >= 0.5
    assert share_of_visits(reached(tmp_path, 0.5 * size).rocks) < 0.5


def test_no_cell_is_named_where_few_rocks_come_to_most_places(tmp_path: Path) -> None:
    """Around the paths of most rocks there are always cells that only single rocks reach, for any size of cells."""
    assert filling_cell(reached(tmp_path, 0.25), share_of_cells) is None
    assert share_of_cells(reached(tmp_path, 20.0).rocks) < 0.5


def cells(rocks: list[int], widest: float = 1000.0) -> ReachedCells:
    """Return four reached cells in a square of 2 by 2, with these numbers of rocks. widest : largest cell size (m)"""
    return ReachedCells(np.array([0, 1, 0, 1]), np.array([0, 0, 1, 1]), np.array(rocks), cell=1.0, widest=widest)


def test_a_cell_so_large_that_it_shows_no_map_is_not_named() -> None:
    assert filling_cell(cells([19, 19, 19, 19])) == 2.0
    assert filling_cell(cells([19, 19, 19, 19], widest=9.0)) is None
    assert filling_cell(cells([1, 1, 1, 1]), share_of_cells) is None, "one rock fills no cell"


@pytest.mark.parametrize(
    ("rocks", "needed"), [([1, 1, 1, 50], 2000), ([4, 4, 40, 40], 91), ([7, 7, 7, 7], 290), ([3, 3, 3, 3], 670)]
)
def test_the_number_of_rocks_is_that_of_the_cell_in_the_middle(rocks: list[int], needed: int) -> None:
    assert rocks_that_fill(cells(rocks), 100) == needed
