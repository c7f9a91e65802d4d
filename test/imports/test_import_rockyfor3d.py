"""Tests of scenes from Rockyfor3D folders: all numbers are compared with the rasters, cell by cell."""

import itertools
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from input_files.imported_folders import CELL, COLUMNS, CORNER, ROWS, Grid, full, rockyfor3d_grids, write_folder

from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.imports.rockyfor3d import import_rockyfor3d
from rpf3d_core.imports.rockyfor3d_ground import SOILS, tangential_restitution
from rpf3d_core.imports.scene_text import names_of
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.keys import EffectsSpec
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.scene.zone_materials import material_of
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.zones import in_plan

SIX_DIGITS = 1e-5
"""Largest relative rounding error: the scene file has six digits of each number."""
EVEN = 1e-3
"""Largest relative error: a uniform variation of R_t by a tenth moves the mean of its root by 4e-4."""
QUADRATURE = 1e-4
"""Largest relative error of a mean over a uniform variation, which is computed differently here."""

RANGES = {0: (0, 0), 1: (0.21, 0.25), 2: (0.25, 0.31), 3: (0.30, 0.36), 4: (0.34, 0.42), 5: (0.39, 0.47),
          6: (0.48, 0.58), 7: (0.32, 0.39)}  # fmt: skip
"""Soil type -> range of R_n, as published for Rockyfor3D; not confirmed from the source."""

Change = Callable[[dict[str, Grid]], None]


def imported(tmp_path: Path, grids: dict[str, Grid]) -> Scene:
    folder = write_folder(tmp_path / "rockyfor3d", grids)
    return read_scene(import_rockyfor3d(folder, tmp_path / "scene").scene)


def cells_of_facets(terrain: Terrain) -> tuple[np.ndarray, np.ndarray]:
    """Return the row and the column (F,) of the cell with the centroid of each facet."""
    x, y = in_plan(terrain.frame, terrain.vertices[terrain.triangles].mean(axis=1)).T
    row = ROWS - 1 - np.floor((y - CORNER[1]) / CELL).astype(int)
    return row, np.floor((x - CORNER[0]) / CELL).astype(int)


def volume_of_mean_block(grids: dict[str, Grid]) -> float:
    """Return the mean block volume (m3) of the six inner source cells: three ellipsoids and three boxes."""
    ellipsoid, box = math.pi / 6.0 * 1.2 * 1.0 * 0.8, 0.6 * 1.0 * 0.8
    return 0.5 * (ellipsoid + box)


def bounds(value: float | object) -> tuple[float, float]:
    if isinstance(value, float):
        return value, value
    return getattr(value, "bounds", None) or (value.min, value.max)  # type: ignore[attr-defined]


def assert_ground(material: Material, soil: int, moh: tuple[float, float, float], radius: float) -> None:
    assert bounds(material.normal_restitution) == pytest.approx(RANGES[soil])
    if soil == 0:
        assert (material.tangential_restitution, material.stop_speed) == (0.0, 1000.0)
        return
    ends = [min(max(share / (1.0 + height / radius), 0.1), 0.99) ** 0.5 for share in (0.9, 1.1) for height in moh]
    assert bounds(material.tangential_restitution) == pytest.approx((min(ends), max(ends)), rel=SIX_DIGITS)
    mean = sum(share * (1.0 + height / radius) ** -0.5 for share, height in zip((0.7, 0.2, 0.1), moh, strict=True))
    assert material.tangential_restitution.mean == pytest.approx(mean, rel=EVEN)  # type: ignore[union-attr]
    assert material.draw == "per_impact"


def test_each_facet_has_the_ground_of_the_cell_that_its_centroid_lies_in(tmp_path: Path) -> None:
    grids = rockyfor3d_grids()
    scene = imported(tmp_path, grids)
    terrain, _ = read_terrain(scene)
    radius = (3.0 * volume_of_mean_block(grids) / (4.0 * math.pi)) ** (1.0 / 3.0)
    rows, columns = cells_of_facets(terrain)
    assert len(rows) == 2 * (ROWS - 1) * (COLUMNS - 1)
    for zone, row, column in zip(terrain.zone, rows, columns, strict=True):
        soil, *moh = (grids[name][row, column] for name in ("soiltype", "rg70", "rg20", "rg10"))
        assert_ground(material_of(scene, terrain.zones[zone]), int(soil), tuple(moh), radius)


def test_each_zone_has_facets_and_a_material(tmp_path: Path) -> None:
    scene = imported(tmp_path, rockyfor3d_grids())
    terrain, _ = read_terrain(scene)
    assert sorted(terrain.zones) == sorted(scene.materials)
    assert set(terrain.zone.tolist()) == set(range(len(terrain.zones)))
    assert len(terrain.zones) == 7  # soils 4, 3 and 1 with two roughnesses each, and the river


def test_heights_are_those_of_the_raster(tmp_path: Path) -> None:
    grids = rockyfor3d_grids()
    terrain, _ = read_terrain(imported(tmp_path, grids))
    points = terrain.frame.points_to_input(terrain.vertices)
    row = np.rint(ROWS - 0.5 - (points[:, 1] - CORNER[1]) / CELL).astype(int)
    column = np.rint((points[:, 0] - CORNER[0]) / CELL - 0.5).astype(int)
    assert len(points) == ROWS * COLUMNS
    assert np.abs(points[:, 2] - grids["dem"][row, column]).max() < 1e-9


def test_there_is_a_rock_in_each_source_cell_but_for_the_outer_two_rows_and_columns(tmp_path: Path) -> None:
    scene = imported(tmp_path, rockyfor3d_grids())
    (source,) = scene.sources
    assert source.points_file is not None
    points = read_points(source.points_file, heights=False)
    there = {(CORNER[0] + (column + 0.5) * CELL, CORNER[1] + (ROWS - row - 0.5) * CELL)
             for row, column in itertools.product((2, 3), (3, 4, 5))}  # fmt: skip
    assert {(x, y) for x, y, _ in points.tolist()} == there
    assert (source.rocks, len(points)) == (6, 6)
    assert source.spread == (0.5 * CELL, 0.5 * CELL, 0.0)
    assert source.velocity == (0.0, 0.0, 0.0)


def test_volumes_are_those_of_the_shapes(tmp_path: Path) -> None:
    grids = rockyfor3d_grids()
    rock = imported(tmp_path, grids).rock
    ellipsoid, box = math.pi / 6.0 * 1.2 * 1.0 * 0.8, 0.6 * 1.0 * 0.8
    assert rock.density == 2650.0
    assert bounds(rock.volume) == pytest.approx((box, ellipsoid), rel=SIX_DIGITS)
    assert rock.volume.mean == pytest.approx(volume_of_mean_block(grids), rel=SIX_DIGITS)  # type: ignore[union-attr]
    assert rock.volume.sd == pytest.approx(0.5 * (ellipsoid - box), rel=1e-4)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("code", "volume"),
    [(1, 1.2 * 0.9 * 0.6), (2, math.pi / 6 * 1.2 * 0.9 * 0.6), (3, math.pi / 6 * 1.2 * 0.9 * 0.6),
     (4, math.pi / 4 * 1.2 * 0.9 * 0.6)],
    ids=["rectangular", "ellipsoidal", "spherical", "disc"],
)  # fmt: skip
def test_blocks_that_are_alike_have_one_volume(tmp_path: Path, code: int, volume: float) -> None:
    grids = rockyfor3d_grids() | {"d1": full(1.2), "d2": full(0.9), "d3": full(0.6), "blshape": full(code)}
    assert imported(tmp_path, grids).rock.volume == pytest.approx(volume, rel=SIX_DIGITS)


@pytest.mark.parametrize("soil", range(8))
def test_every_soil_type_has_its_range(tmp_path: Path, soil: int) -> None:
    scene = imported(tmp_path, rockyfor3d_grids() | {"soiltype": full(soil)})
    assert {bounds(material.normal_restitution) for material in scene.materials.values()} == {RANGES[soil]}
    assert len(SOILS) == len(RANGES)


def test_the_documented_ranges_are_those_of_the_soils() -> None:
    page = (Path(__file__).parents[2] / "docs" / "reference" / "imports.md").read_text()
    rows = re.findall(r"^\| (\d) \| ([\d.]+)(?: to ([\d.]+))? \|", page, re.MULTILINE)
    assert {int(soil): (float(low), float(high or low)) for soil, low, high in rows} == RANGES


def test_smooth_ground_has_the_largest_coefficient_that_there_is() -> None:
    spread = tangential_restitution((0.0, 0.0, 0.0), 0.5)
    assert spread.high == pytest.approx(0.99**0.5)
    assert spread.low == pytest.approx(0.9**0.5)
    below = (0.99**1.5 - 0.9**1.5) / 1.5 / 0.2  # part below 0.99 of the uniform variation from 0.9 to 1.1
    assert spread.mean == pytest.approx(below + 0.99**0.5 * 0.11 / 0.2, rel=QUADRATURE)


def test_obstacles_as_high_as_the_block_halve_the_energy() -> None:
    spread = tangential_restitution((0.5, 0.5, 0.5), 0.5)
    assert spread.mean == pytest.approx(0.5**0.5, rel=1e-3)
    assert (spread.low, spread.high) == pytest.approx((0.45**0.5, 0.55**0.5))


def test_what_is_unconfirmed_says_so_beside_its_number(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "in", rockyfor3d_grids())
    text = import_rockyfor3d(folder, tmp_path / "scene").scene.read_text()
    drawn = [line for line in text.splitlines() if "uniform" in line or ("mean:" in line and "volume" not in line)]
    assert len(drawn) == 12
    assert all("# unconfirmed" in line for line in drawn)


def test_what_is_not_carried_over_stands_in_the_scene_too(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "in", rockyfor3d_grids())
    done = import_rockyfor3d(folder, tmp_path / "scene")
    said = re.sub(r"\s*\n#\s+", " ", done.scene.read_text())
    assert len(done.left) >= 7
    assert [sentence for sentence in done.left if sentence not in said] == []
    assert any("1 source cell in the outer 2 rows and columns" in sentence for sentence in done.left)


def test_the_scene_flies_on_the_reference_engine(tmp_path: Path) -> None:
    scene = imported(tmp_path, rockyfor3d_grids())
    run = simulate(scene.path, rocks=12, engine="reference")
    x = run.terrain.frame.points_to_input(run.flights.deposits.x)
    assert run.totals.rocks == 12
    assert (x[:, 1] < CORNER[1] + (ROWS - 4) * CELL).all(), "all of them leave the source cells, downhill"


def test_a_folder_of_one_ground_needs_no_polygons(tmp_path: Path) -> None:
    grids = rockyfor3d_grids() | {name: full(0.1) for name in ("rg70", "rg20", "rg10")} | {"soiltype": full(5)}
    scene = imported(tmp_path, grids)
    assert scene.zones == ()
    assert list(scene.materials) == ["soil_5_rg_0.1_0.1_0.1"]
    assert not (scene.path.parent / "zones").exists()


def forest(grids: dict[str, Grid]) -> dict[str, Grid]:
    """Return the grids with two stands: 400 stems/ha of 30 cm and 100 stems/ha of 50 cm."""
    stems = full(0.0)
    stems[6:8, :6], stems[6:8, 6:] = 400.0, 100.0
    mean, conifers = np.where(stems == 400.0, 30.0, 50.0), np.where(stems == 400.0, 80.0, 20.0)
    return grids | {"nrtrees": stems, "dbhmean": mean, "dbhstd": full(10.0), "conif_percent": conifers}


def test_a_forest_is_carried_over_or_told(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "in", forest(rockyfor3d_grids()))
    done = import_rockyfor3d(folder, tmp_path / "scene")
    text = done.scene.read_text()
    mark = "" if "forest" in EffectsSpec.model_fields else "# "
    sd = (10.0**2 + 0.8 * 4.0**2 + 0.2 * 16.0**2) ** 0.5  # 34 cm is the mean of 4 trees of 30 and one of 50
    for line in ("effects:", "  forest:", "    stems_per_ha: 250", "    within: forest.geojson", "    dbh_mean_cm: 34",
                 f"    dbh_sd_cm: {sd:.6g}", "    conifer_share: 0.68"):  # fmt: skip
        assert f"\n{mark}{line}\n" in text
    assert read_polygons(tmp_path / "scene" / "forest.geojson").area == pytest.approx(2 * COLUMNS * CELL**2)
    assert any("forest" in sentence for sentence in done.left)


def test_trees_and_nets_are_copied_and_told(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "in", rockyfor3d_grids() | {"net_number": full(1.0)})
    (folder / "treefile.txt").write_text("601010 201010 32\n")
    done = import_rockyfor3d(folder, tmp_path / "scene")
    assert (tmp_path / "scene" / "treefile.txt").read_text() == "601010 201010 32\n"
    assert (tmp_path / "scene" / "net_number.asc").exists()
    assert "treefile.txt, net_number.asc: copied and not read" in done.left


def changed(name: str, where: tuple[object, ...], value: float) -> Change:
    def change(grids: dict[str, Grid]) -> None:
        grids[name][where] = value

    return change


def without_sources(grids: dict[str, Grid]) -> None:
    grids["rockdensity"][2:] = 0.0


REFUSED = [
    (changed("soiltype", (4, 5), 8.0), r"soiltype\.asc: is 8 at row 5, column 6, but must be a soil type from 0 to 7"),
    (changed("soiltype", (4, 5), 2.5), r"soiltype\.asc: is 2\.5 at row 5, column 6"),
    (changed("soiltype", (4, slice(5, 8)), np.nan), r"soiltype\.asc: has no value at row 5, column 6 \(and 2 more\)"),
    (changed("rg20", (0, 0), -0.1), r"rg20\.asc: is -0\.1 at row 1, column 1, but must be a height of at least 0 m"),
    (changed("blshape", (2, 3), 0.0), r"blshape\.asc: is 0 at row 3, column 4, but must be one of 1 \(rectangular\)"),
    (changed("d2", (3, 4), 0.0), r"d2\.asc: is 0 at row 4, column 5, but must be above 0 m in every source cell"),
    (changed("d3", (3, 4), np.nan), r"d3\.asc: has no value at row 4, column 5"),
    (changed("rockdensity", (8, 8), np.nan), r"rockdensity\.asc: has no value at row 9, column 9, but must"),
    (without_sources, r"rockdensity\.asc: is 0 everywhere but in the outer 2 rows and columns .* so no rock falls"),
    (changed("dem", (5, 6), np.nan), r"dem\.asc: has no height at row 6, column 7, amid cells that have one"),
]


@pytest.mark.parametrize(("change", "sentence"), REFUSED, ids=[sentence[:40] for _, sentence in REFUSED])
def test_wrong_numbers_are_refused_and_nothing_is_left(tmp_path: Path, change: Change, sentence: str) -> None:
    grids = rockyfor3d_grids()
    change(grids)
    folder = write_folder(tmp_path / "in", grids)
    with pytest.raises(InputError, match=sentence):
        import_rockyfor3d(folder, tmp_path / "scene")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in"]


def test_half_a_forest_is_refused(tmp_path: Path) -> None:
    grids = forest(rockyfor3d_grids())
    del grids["dbhstd"]
    folder = write_folder(tmp_path / "in", grids)
    with pytest.raises(InputError, match=r"has no dbhstd\.asc; a forest \(nrtrees\.asc is there\) needs nrtrees"):
        import_rockyfor3d(folder, tmp_path / "scene")


def test_source_cells_beside_missing_ground_are_left_out_and_told(tmp_path: Path) -> None:
    grids = rockyfor3d_grids()
    grids["dem"][:3, :3] = np.nan
    folder = write_folder(tmp_path / "in", grids)
    done = import_rockyfor3d(folder, tmp_path / "scene")
    assert "2 source cells next to missing ground: a rock might start off the terrain" in done.left
    assert read_scene(done.scene).sources[0].rocks == 4
    assert simulate(done.scene, engine="reference").totals.rocks == 4


def test_repeated_names_of_zones_get_names_that_no_other_zone_has() -> None:
    assert names_of(["a_no2", "a", "a", "a"]) == ["a_no2", "a", "a_no3", "a_no4"]
