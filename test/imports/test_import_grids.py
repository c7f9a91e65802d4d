"""Tests of what all imports require: complete grids on the same cells, and a new output folder."""

import gzip
import os
from pathlib import Path

import numpy as np
import pytest
import rasterio
from input_files.imported_folders import (
    CELL,
    COLUMNS,
    CORNER,
    ROWS,
    Grid,
    full,
    slope,
    stone_grids,
    write_folder,
    write_grid,
)
from rasterio.transform import from_origin

from rpf3d_core.errors import InputError
from rpf3d_core.formats.cell_outlines import enclosed_cell
from rpf3d_core.imports.classes import MOST_CLASSES, classes_of, facets_of_cells
from rpf3d_core.imports.rockyfor3d import import_rockyfor3d
from rpf3d_core.imports.stone import import_stone
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.terrain import read_terrain


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path / "in", stone_grids())


def refused(folder: Path, sentence: str, out: str = "scene") -> None:
    with pytest.raises(InputError, match=sentence):
        import_stone(folder, folder.parent / out)


def test_missing_grids_are_named_together(folder: Path) -> None:
    (folder / "nrest.asc").unlink()
    (folder / "friction.asc").unlink()
    refused(folder, r"in: has no nrest\.asc, friction\.asc; STONE needs dem, sources, nrest, trest, friction, each as")


def test_a_folder_of_the_other_program_says_what_is_missing(folder: Path) -> None:
    with pytest.raises(InputError, match=r"has no rockdensity\.asc, d1\.asc, .* soiltype\.asc; Rockyfor3D needs dem"):
        import_rockyfor3d(folder, folder.parent / "scene")


def test_what_is_no_folder_is_refused(folder: Path) -> None:
    refused(folder / "dem.asc", r"dem\.asc: is not a folder; give the one that holds dem\.asc")
    refused(folder / "gone", r"gone: is not a folder")


def test_two_files_of_one_name_are_refused(folder: Path) -> None:
    (folder / "dem.asc.gz").write_bytes(gzip.compress((folder / "dem.asc").read_bytes()))
    refused(folder, r"dem\.asc and dem\.asc\.gz are both the grid dem; keep one of them")


def test_names_may_be_in_capitals_and_grids_compressed_or_geotiff(folder: Path) -> None:
    plain = import_stone(folder, folder.parent / "plain").scene.read_text()
    (folder / "DEM.ASC").write_bytes((folder / "dem.asc").read_bytes())
    (folder / "dem.asc").unlink()
    (folder / "trest.asc.gz").write_bytes(gzip.compress((folder / "trest.asc").read_bytes()))
    (folder / "trest.asc").unlink()
    transform = from_origin(CORNER[0], CORNER[1] + ROWS * CELL, CELL, CELL)
    shape = {"height": ROWS, "width": COLUMNS, "count": 1, "dtype": "float64"}
    with rasterio.open(folder / "friction.tif", "w", driver="GTiff", transform=transform, **shape) as grid:
        grid.write(stone_grids()["friction"], 1)
    (folder / "friction.asc").unlink()
    assert import_stone(folder, folder.parent / "mixed").scene.read_text() == plain


def replaced(folder: Path, name: str, values: Grid, **where: object) -> None:
    write_grid(folder / f"{name}.asc", values, **where)  # type: ignore[arg-type]


def test_grids_on_other_cells_are_refused(folder: Path) -> None:
    replaced(folder, "trest", full(55.0), cell=4.0)
    refused(folder, r"trest\.asc: its cells are 4 m, but those of dem\.asc 5 m; resample it")
    replaced(folder, "trest", full(55.0, ROWS - 1))
    refused(folder, r"trest\.asc: has 13 rows of 12, but dem\.asc has 14 rows of 12; cut them alike")
    replaced(folder, "trest", full(55.0), corner=(CORNER[0] + CELL, CORNER[1]))
    refused(folder, r"trest\.asc: its north-west corner is \(601005, 201070\), but that of dem\.asc is \(601000, 2010")


def test_a_corner_written_with_fewer_digits_is_the_same_corner(folder: Path) -> None:
    replaced(folder, "trest", full(55.0), corner=(CORNER[0] + 1e-4, CORNER[1]))
    assert import_stone(folder, folder.parent / "scene").scene.exists()


def test_maps_whose_cells_are_not_those_of_the_grids_are_told(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    for name, values in stone_grids().items():
        replaced(folder, name, values, corner=(CORNER[0] + 1.5, CORNER[1] - 1.0))
    done = import_stone(folder, tmp_path / "scene")
    assert done.left[-1].endswith("those lie on whole multiples of a cell, (1.5, -1) m off")
    straight = import_stone(write_folder(tmp_path / "straight", stone_grids()), tmp_path / "other")
    assert not any("hazard maps" in sentence for sentence in straight.left)


def test_a_damaged_grid_is_refused_by_its_name(folder: Path) -> None:
    text = (folder / "nrest.asc").read_text()
    (folder / "nrest.asc").write_text(text.rsplit("\n", 2)[0])
    refused(folder, r"nrest\.asc: has 156 values, but its header announces 14 rows of 12, 168 in all")
    (folder / "nrest.asc").write_text(text.replace("65.0", "hard", 1))
    refused(folder, r"nrest\.asc: every value must be a number")
    (folder / "nrest.asc").write_text("a web page")
    refused(folder, r"nrest\.asc: cannot be read as a value grid")


def test_cells_that_are_no_squares_are_refused(folder: Path) -> None:
    for name in ("dem", "sources", "nrest", "trest", "friction"):
        text = (folder / f"{name}.asc").read_text()
        (folder / f"{name}.asc").write_text(text.replace("cellsize 5.0", "dx 5.0\ndy 4.0"))
    refused(folder, r"dem\.asc: its cells are 5 by 4 m; they must be squares, with north up")


def test_ground_that_is_cut_off_at_a_corner_is_taken_and_has_no_zone_there(folder: Path) -> None:
    heights = slope()
    heights[:2, :3] = np.nan
    for name in ("nrest", "trest", "friction"):
        values = stone_grids()[name]
        values[:2, :3] = np.nan
        replaced(folder, name, values)
    replaced(folder, "dem", heights)
    terrain, _ = read_terrain(read_scene(import_stone(folder, folder.parent / "scene").scene))
    assert len(terrain.triangles) == 2 * ((ROWS - 1) * (COLUMNS - 1) - 6)


@pytest.mark.parametrize(
    ("missing", "cell"),
    [([(0, 3), (1, 3)], None), ([(2, 2)], (2, 2)), ([(2, 3), (3, 2)], (2, 3)), ([(3, 0), (2, 1), (1, 2)], None),
     ([(4, 4)], None), ([], None), ([(0, 0), (2, 2)], (2, 2)),
     ([(0, 1), (1, 1), (1, 3), (2, 3), (3, 2), (3, 1)], (1, 3))],
    ids=["bay", "gap", "gap over a corner", "bay over corners", "corner", "none", "both", "a bay beside the gap"],
)  # fmt: skip
def test_a_gap_is_missing_ground_that_does_not_reach_the_edge(
    missing: list[tuple[int, int]], cell: tuple[int, int] | None
) -> None:
    image = np.zeros((5, 5), bool)
    for row, column in missing:
        image[row, column] = True
    assert enclosed_cell(image) == cell


def test_each_facet_is_counted_for_one_cell() -> None:
    ground = np.ones((4, 5), bool)
    facets = facets_of_cells(ground)
    assert facets.sum() == 2 * 3 * 4
    assert (facets[1:-1, 1:-1] == 2).all()
    assert (facets[0, 0], facets[-1, -1]) == (0, 0), "the diagonals run to these corners"
    ground[0, 0] = False
    assert facets_of_cells(ground).sum() == 2 * 11


def test_classes_that_are_few_keep_their_numbers() -> None:
    grid, code = np.array([[1.5, 2.5], [2.5, 0.1]]), np.array([[0.0, 1.0], [1.0, 1.0]])
    classes = classes_of((code, grid), (False, True), np.ones((2, 2), int))
    assert classes.values.tolist() == [[0.0, 1.5], [1.0, 0.1], [1.0, 2.5]]
    assert classes.number.tolist() == [[1, 3], [3, 2]]
    assert (classes.distinct, classes.facets.tolist(), classes.error.tolist()) == (3, [1, 1, 2], [0.0, 0.0])


def test_bins_keep_codes_and_tell_the_largest_difference() -> None:
    draw = np.random.default_rng(1)
    code, grid = draw.integers(0, 8, (60, 60)).astype(float), draw.random((60, 60))
    classes = classes_of((code, grid), (False, True), np.ones((60, 60), int))
    assert len(classes.values) <= MOST_CLASSES < classes.distinct
    found = classes.values[classes.number - 1]
    assert (found[..., 0] == code).all()
    difference = np.abs(found[..., 1] - grid)
    assert classes.error.tolist() == [0.0, difference.max()]
    assert difference.max() < 1 / 16, "16 steps of 8 codes would be few enough"
    means = [grid[classes.number == k + 1].mean() for k in range(len(classes.values))]
    assert classes.values[:, 1] == pytest.approx(means)


def test_a_folder_with_content_is_never_written_to(folder: Path) -> None:
    done = import_stone(folder, folder.parent / "scene")
    done.scene.write_text("mine")
    refused(folder, r"scene: is not empty; give the path of a new or empty folder")
    assert done.scene.read_text() == "mine"
    refused(folder, r"dem\.asc: is a file; the scene needs the path of a folder", out="in/dem.asc")


def test_an_empty_folder_will_do(folder: Path) -> None:
    (folder.parent / "scene").mkdir()
    assert import_stone(folder, folder.parent / "scene").scene.exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_may_not_be_written_to_is_refused(folder: Path) -> None:
    closed = folder.parent / "closed"
    closed.mkdir(mode=0o500)
    refused(folder, r"cannot be written, because .*closed is not a folder that may be written to", out="closed/scene")
