"""Tests of rocks that pass a gate, against a fall in closed form, and of areas that rocks reach."""

import dataclasses

import numpy as np
import pytest
from flights import scenes_of_facets as made
from input_files.terrain_files import with_models

from rpf3d_core.calibration.flown_passages import contained, passages, visited
from rpf3d_core.calibration.observations import Directions
from rpf3d_core.ensemble.batches import BatchControl, Keep, fly_batches
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import Prepared, prepare, releases_in_ranges

SCENE = """\
terrain: {files: [{path: floor.obj, zone: default}]}
materials: {default: {normal_restitution: 0.3, tangential_restitution: 0.8}}
sources: [{name: ledge, points_file: ledge.csv, rocks: 2, velocity: [10, 0, 0]}]
engine: reference
gravity: 9.81
"""
SQUARE = [np.array([[8.0, -1.0], [12.0, -1.0], [12.0, 1.0], [8.0, 1.0], [8.0, -1.0]])]


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    folder = tmp_path_factory.mktemp("floor")
    (folder / "floor.obj").write_text("v -50 -50 0\nv 90 -50 0\nv 90 50 0\nv -50 50 0\nf 1 2 3\nf 1 3 4\n")
    (folder / "ledge.csv").write_text("x,y,z\n0,0,20\n0,30,20\n")
    (folder / "scene.yaml").write_text(with_models(SCENE))
    return prepare(read_scene(folder / "scene.yaml"))


def flown(prepared: Prepared):
    keep = Keep(paths=np.ones(2, dtype=bool), impacts=np.zeros(2, dtype=bool))
    releases = releases_in_ranges(prepared, [range(2)])
    return fly_batches(prepared.engine, prepared.flight, releases, keep, None, BatchControl(threads=1))


def directions(prepared: Prepared) -> Directions:
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return Directions(axes=axes, origin=axes @ np.array(prepared.terrain.frame.origin))


def test_speed_and_height_at_a_gate_are_those_of_a_fall(prepared: Prepared) -> None:
    found = passages(flown(prepared), directions(prepared), 10.0, prepared.engine)
    np.testing.assert_allclose(found.speed, np.hypot(10.0, 9.81), rtol=1e-9)  # after one second
    np.testing.assert_allclose(found.height, 20.0 - 0.5 * 9.81, rtol=1e-9)
    assert found.passed.all()


def test_a_gate_that_no_rock_passes(prepared: Prepared) -> None:
    found = passages(flown(prepared), directions(prepared), 89.0, prepared.engine)
    assert not found.passed.any()
    assert np.isnan(found.height).all()


def test_where_there_is_no_ground_the_speed_is_known_and_the_height_is_not(prepared: Prepared) -> None:
    """Both rocks pass x = 10 m, at y = 0 and at y = 30 m. The ground of this engine ends at y = 15 m."""
    vertices = prepared.terrain.vertices.copy()
    vertices[vertices[:, 1] == vertices[:, 1].max(), 1] -= 35.0
    short = made.engine_over("reference", dataclasses.replace(prepared.terrain, vertices=vertices))
    found = passages(flown(prepared), directions(prepared), 10.0, short)
    assert found.passed.all()
    assert found.height[0] == pytest.approx(20.0 - 0.5 * 9.81, rel=1e-9) and np.isnan(found.height[1])


def test_rocks_that_cross_an_area_have_reached_it(prepared: Prepared) -> None:
    origin = np.array(prepared.terrain.frame.origin)[:2]
    assert visited(flown(prepared), [ring - origin for ring in SQUARE]).tolist() == [True, False]


def test_points_in_a_ring_with_a_hole() -> None:
    hole = [np.array([[9.0, -0.5], [11.0, -0.5], [11.0, 0.5], [9.0, 0.5], [9.0, -0.5]])]
    points = np.array([[8.5, 0.0], [10.0, 0.0], [20.0, 0.0], [10.0, 0.9]])
    assert contained(points, SQUARE + hole).tolist() == [True, False, False, True]
