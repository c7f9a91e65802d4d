"""Tests of scenes from STONE's grids: all numbers are compared with the rasters, cell by cell."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from input_files.imported_folders import CELL, COLUMNS, CORNER, ROWS, Grid, full, slope, stone_grids, write_folder

from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.imports.classes import MOST_CLASSES
from rpf3d_core.imports.stone import import_stone
from rpf3d_core.imports.stone_sources import NEIGHBOURS
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.keys import GroundSpec
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.scene.zone_materials import material_of
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.terrain.zones import in_plan
from rpf3d_core.values import Outcome

SIX_DIGITS = 1e-5
"""Largest relative rounding error: the scene file has six digits of each number."""

Change = Callable[[dict[str, Grid]], None]


def imported(tmp_path: Path, grids: dict[str, Grid]) -> Scene:
    folder = write_folder(tmp_path / "stone", grids)
    return read_scene(import_stone(folder, tmp_path / "scene").scene)


def facets_with_cells(scene: Scene) -> list[tuple[Material, int, int]]:
    """Return (material, row, column) for each facet; row and column are those of the cell with its centroid."""
    terrain, _ = read_terrain(scene)
    x, y = in_plan(terrain.frame, terrain.vertices[terrain.triangles].mean(axis=1)).T
    row = ROWS - 1 - np.floor((y - CORNER[1]) / CELL).astype(int)
    column = np.floor((x - CORNER[0]) / CELL).astype(int)
    materials = [material_of(scene, zone) for zone in terrain.zones]
    return [(materials[zone], r, c) for zone, r, c in zip(terrain.zone, row.tolist(), column.tolist(), strict=True)]


def assert_drawn(value: object, mean: float, low: float, high: float) -> None:
    """Assert that a value is a truncated normal distribution whose sd is a quarter of its range."""
    found = (value.mean, value.min, value.max)  # type: ignore[attr-defined]
    assert found == pytest.approx((mean, low, high), rel=SIX_DIGITS)
    assert value.sd == pytest.approx(0.25 * (high - low), rel=1e-4)  # type: ignore[attr-defined]


def test_each_facet_has_the_coefficients_of_the_cell_that_its_centroid_lies_in(tmp_path: Path) -> None:
    grids = stone_grids()
    facets = facets_with_cells(imported(tmp_path, grids))
    assert len(facets) == 2 * (ROWS - 1) * (COLUMNS - 1)
    for material, row, column in facets:
        if grids["sources"][row, column] == -1.0:
            assert (material.normal_restitution, material.tangential_restitution) == (0.0, 0.0)
            assert (material.friction_angle_deg, material.stop_speed) == (89.0, 1000.0)
            continue
        r_n, r_t, mu = (grids[name][row, column] for name in ("nrest", "trest", "friction"))
        assert_drawn(material.normal_restitution, r_n / 100, 0.9 * r_n / 100, 1.1 * r_n / 100)
        assert_drawn(material.tangential_restitution, r_t / 100, 0.9 * r_t / 100, 1.1 * r_t / 100)
        angles = [math.degrees(math.atan(share * mu)) for share in (1.0, 0.9, 1.1)]
        assert_drawn(material.friction_angle_deg, *angles)
        assert material.draw == "per_impact"


@pytest.mark.parametrize("share", [False, True], ids=["percent", "shares"])
def test_percent_and_shares_are_one_scene_but_for_names(tmp_path: Path, share: bool) -> None:
    grids = stone_grids()
    if share:
        grids |= {"nrest": grids["nrest"] / 100, "trest": grids["trest"] / 100}
    done = import_stone(write_folder(tmp_path / "in", grids), tmp_path / "scene")
    means = sorted(material.normal_restitution.mean for material in read_scene(done.scene).materials.values()
                   if not isinstance(material.normal_restitution, float))  # fmt: skip
    assert means == pytest.approx([0.35, 0.65])
    assert any(f"restitution read as {'shares of 1' if share else 'percent'}" in sentence for sentence in done.taken)


def steepest(heights: Grid, row: int, column: int) -> str:
    falls = {
        name: (heights[row, column] - heights[row - north, column + east]) / math.hypot(east, north)
        for name, (east, north) in NEIGHBOURS.items()
    }
    return max(falls, key=lambda name: falls[name])


def test_rocks_start_from_their_cells_towards_the_steepest_neighbour(tmp_path: Path) -> None:
    grids = stone_grids()
    row, column = np.mgrid[0:ROWS, 0:COLUMNS].astype(float)
    grids["dem"] = 300.0 + 3.0 * np.hypot(row - 6.3, column - 5.6)  # a bowl, so that the slopes have all directions
    grids["sources"] = np.where(np.random.default_rng(5).random((ROWS, COLUMNS)) < 0.5, np.nan, (row + column) % 3)
    scene = imported(tmp_path, grids)
    found: dict[tuple[float, float, str], int] = {}
    for source in scene.sources:
        assert source.points_file is not None
        points = read_points(source.points_file, heights=False)
        assert source.rocks % len(points) == 0
        for x, y, _ in points.tolist():
            key = (x, y, source.name)
            found[key] = found.get(key, 0) + source.rocks // len(points)
        east, north = NEIGHBOURS[source.name]
        toward = np.array([east, north]) / math.hypot(east, north)
        assert source.velocity == pytest.approx((*toward, 0.0), abs=1e-6)
    expected = {
        (CORNER[0] + (c + 0.5) * CELL, CORNER[1] + (ROWS - r - 0.5) * CELL, steepest(grids["dem"], r, c)): int(n)
        for r in range(1, ROWS - 1) for c in range(1, COLUMNS - 1) if (n := grids["sources"][r, c]) > 0
    }  # fmt: skip
    assert len({name for _, _, name in expected}) == len(NEIGHBOURS)
    assert found == expected


def test_numbers_of_rocks_with_a_common_factor_are_dealt_to_few_points(tmp_path: Path) -> None:
    (source,) = imported(tmp_path, stone_grids()).sources  # three cells of 10 rocks, one of 4
    assert source.points_file is not None
    assert (source.rocks, len(read_points(source.points_file, heights=False))) == (34, 17)


def test_the_numbers_of_a_calculation_are_r_stones_defaults(tmp_path: Path) -> None:
    scene = imported(tmp_path, stone_grids())
    assert (scene.gravity, scene.stop_speed, scene.hazard.cell) == (9.805, 3.0, CELL)
    assert scene.sources[0].velocity_spread == (0.1, 0.1, 0.0)
    assert scene.ground.name == "sliding"


@pytest.mark.skipif("rolling_stone" not in GroundSpec.model_fields, reason="this version has no rolling rule of STONE")
def test_the_coefficients_of_stones_own_rule_are_comments_of_the_scene(tmp_path: Path) -> None:
    grids = stone_grids()
    file = import_stone(write_folder(tmp_path / "stone", grids), tmp_path / "scene").scene
    text = file.read_text().replace("# rolling_friction:", "rolling_friction:")
    file.write_text(text.replace("ground: sliding", "ground: rolling_stone"))
    scene = read_scene(file)
    assert scene.ground.name == "rolling_stone"
    for material, row, column in facets_with_cells(scene):
        if grids["sources"][row, column] != -1.0:
            mu = grids["friction"][row, column]
            assert_drawn(material.rolling_friction, mu, 0.9 * mu, 1.1 * mu)


def test_no_normal_restitution_stops_rocks_as_a_stop_cell_does(tmp_path: Path) -> None:
    grids = stone_grids()
    grids["nrest"][9:11] = 0.0
    stops = {(row, column) for material, row, column in facets_with_cells(imported(tmp_path, grids))
             if material.stop_speed == 1000.0}  # fmt: skip
    wanted = (grids["sources"] == -1.0) | (grids["nrest"] == 0.0)
    with_facets = {(r, c) for r, c in np.argwhere(wanted).tolist() if (r, c) not in ((0, 0), (ROWS - 1, COLUMNS - 1))}
    assert stops == with_facets


def test_rocks_end_in_the_stop_cells_that_lie_across_their_way(tmp_path: Path) -> None:
    grids = stone_grids()
    grids["sources"][8:10] = -1.0  # wider than any bounce
    scene = imported(tmp_path, grids)
    run = simulate(scene.path, engine="reference")
    y = run.terrain.frame.points_to_input(run.flights.deposits.x)[:, 1]
    row = ROWS - 1 - np.floor((y - CORNER[1]) / CELL)
    assert run.totals.outcomes[Outcome.STOPPED] == run.totals.rocks == 34
    assert (row >= 7).all() and (row <= 9).all()


def test_stop_cells_need_no_coefficients(tmp_path: Path) -> None:
    grids = stone_grids()
    for name in ("nrest", "trest", "friction"):
        grids[name][grids["sources"] == -1.0] = np.nan
    assert "stop" in imported(tmp_path, grids).materials


def test_too_many_coefficients_are_binned_and_the_largest_change_is_told(tmp_path: Path) -> None:
    grids, draw = stone_grids(), np.random.default_rng(3)
    rows, columns = 40, 40
    grids = {"dem": slope(rows, columns), "sources": full(0.0, rows, columns),
             "nrest": draw.uniform(20, 70, (rows, columns)), "trest": draw.uniform(40, 90, (rows, columns)),
             "friction": draw.uniform(0.3, 0.9, (rows, columns))}  # fmt: skip
    grids["sources"][4, 4] = 1.0
    done = import_stone(write_folder(tmp_path / "in", grids), tmp_path / "scene")
    scene = read_scene(done.scene)
    (told,) = [sentence for sentence in done.left if "different grounds were put into" in sentence]
    assert told.startswith("1,598 different grounds")  # all cells but the two corners that no facet has
    assert len(scene.materials) <= MOST_CLASSES
    terrain, _ = read_terrain(scene)
    x, y = in_plan(terrain.frame, terrain.vertices[terrain.triangles].mean(axis=1)).T
    row, column = rows - 1 - np.floor((y - CORNER[1]) / CELL).astype(int), np.floor((x - CORNER[0]) / CELL).astype(int)
    means = np.array([material_of(scene, zone).normal_restitution.mean for zone in terrain.zones])  # type: ignore[union-attr]
    error = np.abs(100.0 * means[terrain.zone] - grids["nrest"][row, column]).max()
    assert f"nrest (percent) by {error:.3g}"[:-1] in told
    assert error < 50 / 4, "five steps or more"


def test_restitution_above_one_is_cut_off(tmp_path: Path) -> None:
    scene = imported(tmp_path, stone_grids() | {"nrest": full(95.0), "trest": full(60.0), "friction": full(0.4)})
    ground = scene.materials["rn_95_rt_60_mu_0.4"].normal_restitution
    assert (ground.min, ground.max) == pytest.approx((0.855, 1.0))  # type: ignore[union-attr]


def changed(name: str, where: tuple[object, ...], value: float) -> Change:
    def change(grids: dict[str, Grid]) -> None:
        grids[name][where] = value

    return change


def in_shares(grids: dict[str, Grid]) -> None:
    grids["nrest"] = grids["nrest"] / 100.0


def without_sources(grids: dict[str, Grid]) -> None:
    grids["sources"] = full(-1.0)


def at_the_rim(grids: dict[str, Grid]) -> None:
    grids["sources"] = full(0.0)
    grids["sources"][0] = 3.0


def many_rocks(grids: dict[str, Grid]) -> None:
    grids["sources"][2, 3:5] = (9_999_991.0, 7.0)


REFUSED = [
    (changed("sources", (2, 3), 2.5), r"sources\.asc: is 2\.5 at row 3, column 4, but must be a whole number of rocks"),
    (changed("sources", (2, 3), -2.0), r"sources\.asc: is -2 at row 3, column 4"),
    (without_sources, r"sources\.asc: is above 0 nowhere, so no rock falls"),
    (at_the_rim, r"sources\.asc: is above 0 nowhere but at the rim of the ground"),
    (many_rocks, r"sources\.asc: its numbers of rocks make 10,000,\d+ lines of source points, more than 5,000,000"),
    (changed("nrest", (3, 3), 101.0), r"nrest\.asc: is 101 at row 4, column 4, but must be from 0 to 100"),
    (changed("trest", (3, 3), -1.0), r"trest\.asc: is -1 at row 4, column 4, but must be from 0 to 100: .* percent"),
    (changed("trest", (3, 3), np.nan), r"trest\.asc: has no value at row 4, column 4"),
    (in_shares, r"nrest\.asc: reaches 0\.65, as shares do, but trest\.asc 75, as percent do"),
    (changed("friction", (3, 3), 16.7), r"friction\.asc: is 16\.7 at row 4, column 4, but must be the tangent"),
    (changed("friction", (3, 3), -0.1), r"friction\.asc: is -0\.1"),
]


@pytest.mark.parametrize(("change", "sentence"), REFUSED, ids=[sentence[:45] for _, sentence in REFUSED])
def test_wrong_numbers_are_refused_and_nothing_is_left(tmp_path: Path, change: Change, sentence: str) -> None:
    grids = stone_grids()
    change(grids)
    folder = write_folder(tmp_path / "in", grids)
    with pytest.raises(InputError, match=sentence):
        import_stone(folder, tmp_path / "scene")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in"]
