"""Tests of counts of rocks with a misfit: zero misfit counts the rocks as flown, others count displaced copies."""

from math import erf, sqrt

import numpy as np
import pytest
from input_files.terrain_files import with_models

from rpf3d_core.calibration.flown_counts import (
    COPIES,
    PathExtents,
    extent_of,
    passed,
    reached_area,
    reached_section,
    stopped_in_area,
    stopped_in_section,
    unit_displacements,
)
from rpf3d_core.calibration.flown_passages import passages, visited
from rpf3d_core.calibration.observations import Directions
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.batches import BatchControl, Keep, fly_batches
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import Prepared, prepare, releases_in_ranges

ROCKS = 40
SCENE = f"""\
terrain: {{files: [{{path: floor.obj, zone: default}}]}}
materials: {{default: {{normal_restitution: 0.3, tangential_restitution: 0.8, friction_angle_deg: 20}}}}
sources: [{{name: ledge, points_file: ledge.csv, rocks: {ROCKS}, velocity: [10, 0, 0], spread: [4, 4, 0]}}]
engine: reference
stop_speed: 0.5
"""
MISFITS = np.array([0.0, 3.0])
SQUARE = [np.array([[20.0, -3.0], [40.0, -3.0], [40.0, 4.0], [20.0, 4.0], [20.0, -3.0]])]


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    folder = tmp_path_factory.mktemp("floor")
    (folder / "floor.obj").write_text("v -50 -50 0\nv 90 -50 0\nv 90 50 0\nv -50 50 0\nf 1 2 3\nf 1 3 4\n")
    (folder / "ledge.csv").write_text("x,y,z\n0,0,12\n")
    (folder / "scene.yaml").write_text(with_models(SCENE))
    return prepare(read_scene(folder / "scene.yaml"))


@pytest.fixture(scope="module")
def batch(prepared: Prepared) -> Batch:
    keep = Keep(paths=np.ones(ROCKS, dtype=bool), impacts=np.zeros(ROCKS, dtype=bool))
    releases = releases_in_ranges(prepared, [range(ROCKS)])
    return fly_batches(prepared.engine, prepared.flight, releases, keep, None, BatchControl(threads=1))


@pytest.fixture(scope="module")
def directions(prepared: Prepared) -> Directions:
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return Directions(axes=axes, origin=axes @ np.array(prepared.terrain.frame.origin))


@pytest.fixture(scope="module")
def square(prepared: Prepared) -> list[np.ndarray]:
    return [ring - np.array(prepared.terrain.frame.origin)[:2] for ring in SQUARE]


def below(z: float) -> float:
    return 0.5 * (1.0 + erf(z / sqrt(2.0)))


def test_without_an_error_the_rocks_that_passed_are_counted(
    prepared: Prepared, batch: Batch, directions: Directions
) -> None:
    extent, numbers = extent_of(batch, directions), set()
    for at in np.linspace(-6.0, 60.0, 45).tolist():
        hard = passages(batch, directions, at, prepared.engine).passed
        assert (passed(extent, at, MISFITS)[0] == hard).all()
        numbers.add(int(hard.sum()))
    assert {0, ROCKS} < numbers  # none, all, and some


def test_a_rock_that_stopped_short_of_a_gate_may_have_passed_it() -> None:
    begin = np.array([0.0, 0.0, 31.0])
    extent = PathExtents(begin=begin, least=begin, most=np.array([28.5, 33.0, 50.0]))
    found = passed(extent, 30.0, np.array([0.0, 3.0]))
    np.testing.assert_array_equal(found[0], [0.0, 1.0, 0.0])
    np.testing.assert_allclose(found[1], [below(-0.5), below(1.0), 0.0], atol=1e-12)  # the last starts beyond the gate
    np.testing.assert_allclose(reached_section(extent, (30.0, None), MISFITS)[1], [below(-0.5), below(1.0), 1.0])
    assert (reached_section(extent, (None, 30.0), MISFITS) == 1.0).all()


def test_stops_in_sections_share_out_the_rocks_that_stopped() -> None:
    along, deposited = np.array([28.5, 33.0, 30.0, 31.0]), np.array([True, True, True, False])
    parts = [stopped_in_section(along, deposited, section, MISFITS)
             for section in ((None, 30.0), (30.0, 32.0), (32.0, None))]  # fmt: skip
    np.testing.assert_array_equal([part[0] for part in parts], [[1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0]])
    np.testing.assert_allclose(parts[0][1], [below(0.5), below(-1.0), 0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.sum(parts, axis=0), np.tile(deposited, (2, 1)).astype(float))


def test_displacements_have_the_mean_and_the_spread_of_the_error() -> None:
    moves = unit_displacements()
    np.testing.assert_allclose(moves.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(moves.std(axis=0), 1.0)
    assert abs(np.corrcoef(moves.T)[0, 1]) < 0.2


def dense(batch: Batch, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (P, 2) m every 5 mm along a rock's path in plan, and the share (P,) of its length before each."""
    first, last = batch.first[row : row + 2, 1]
    corners = np.concatenate([batch.pieces[first:last, 1:3], batch.finals[row : row + 1, 1:3]])
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.linspace(0.0, gone[-1], int(gone[-1] / 0.005) + 2)
    return np.stack([np.interp(at, gone, corners[:, k]) for k in (0, 1)], axis=1), at / max(gone[-1], 1e-300)


def by_force(batch: Batch, box: np.ndarray, sd: float) -> np.ndarray:
    """Return (R,) the shares of displaced paths with a point in a box; displacements (sd in m) grow along the path."""
    (west, south), (east, north) = box.min(axis=0), box.max(axis=0)
    shares = []
    for row in range(len(batch.rows)):
        points, share = dense(batch, row)
        x, y = np.moveaxis(points + share[:, None] * (sd * unit_displacements())[:, None, :], 2, 0)
        shares.append(((x > west) & (x < east) & (y > south) & (y < north)).any(axis=1).mean())
    return np.array(shares)


@pytest.mark.parametrize("sd", [3.0, 20.0])
def test_areas_count_the_displaced_paths_of_each_rock(batch: Batch, square: list[np.ndarray], sd: float) -> None:
    hard = visited(batch, square)
    assert 0 < hard.sum() < ROCKS
    found = reached_area(batch, square, np.array([0.0, sd]))
    np.testing.assert_array_equal(found[0], hard)
    np.testing.assert_allclose(found[1], by_force(batch, square[0], sd), atol=1e-12)
    assert ((found[1] > 0.0) & (found[1] < 1.0)).any()


def test_no_path_jumps_over_a_narrow_road_however_large_the_error(batch: Batch, square: list[np.ndarray]) -> None:
    """The road is 0.3 m wide, just below all releases, where displacements of the ends hardly move the paths."""
    middle = batch.pieces[batch.first[:-1, 1], 1].max() + 0.5
    road = np.array([[middle, -200.0], [middle + 0.3, -200.0], [middle + 0.3, 200.0], [middle, 200.0]])
    found = reached_area(batch, [np.concatenate([road, road[:1]])], np.array([0.0, 5.0, 20.0]))
    assert (found[0] == 1.0).all()
    for flags, sd in zip(found[1:], (5.0, 20.0), strict=True):
        np.testing.assert_allclose(flags, by_force(batch, road, sd), atol=1e-12)
    assert found[1].mean() > 0.99 and found[2].mean() > 0.75, "only an error beyond the length of a path turns it back"


def test_a_hole_of_an_area_is_not_reached(batch: Batch, square: list[np.ndarray]) -> None:
    around = square[0] + 1000.0 * np.sign(square[0] - square[0][:4].mean(axis=0))
    sky = square[0] + 900.0 * np.sign(square[0] - square[0][:4].mean(axis=0))
    assert (reached_area(batch, [around], MISFITS) == 1.0).all()
    assert (reached_area(batch, [around, sky], MISFITS) == 0.0).all()


def test_stops_in_areas_count_the_displaced_copies_of_each_rock(batch: Batch, square: list[np.ndarray]) -> None:
    (west, south), (east, north) = square[0].min(axis=0), square[0].max(axis=0)
    stops = batch.finals[:, 1:3]
    copies = [stops, *(stops + by for by in 3.0 * unit_displacements())]
    inside = [((x > west) & (x < east) & (y > south) & (y < north)).astype(float) for x, y in (one.T for one in copies)]
    found = stopped_in_area(batch, square, MISFITS)
    np.testing.assert_array_equal(found[0], inside[0])
    np.testing.assert_allclose(found[1], np.mean(inside[1:], axis=0))
    assert len(inside) == COPIES + 1
    assert 0 < inside[0].sum() < ROCKS
