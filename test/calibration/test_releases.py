"""Tests that the rocks of a calibration round represent all release points of the scene."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rpf3d_core.calibration.flying import _mixed_order, fly_set, releases_of_round, slope_of
from rpf3d_core.calibration.observations import Field
from rpf3d_core.errors import SceneError
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import Prepared, prepare

SCENE = """\
terrain: {files: [{path: floor.obj, zone: default}]}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 32}}
rock: {density: 2700, mass: 500}
sources: [{name: crest, points_file: crest.csv, rocks: 400, velocity: [1, 0, 0]}]
rebound: constant
ground: sliding
engine: reference
"""


def prepared_crest(folder: Path, points: int) -> Prepared:
    """Return a prepared scene with `points` release points, one every metre along a crest."""
    (folder / "floor.obj").write_text("v -9 -9 0\nv 9 -9 0\nv 9 409 0\nv -9 409 0\nf 1 2 3\nf 1 3 4\n")
    (folder / "crest.csv").write_text("x,y,z\n" + "".join(f"0,{y},20\n" for y in range(points)))
    (folder / "scene.yaml").write_text(SCENE)
    return prepare(read_scene(folder / "scene.yaml"))


@pytest.mark.parametrize("number", [0, 1, 5])
def test_each_round_flies_from_the_whole_crest(tmp_path: Path, number: int) -> None:
    prepared = prepared_crest(tmp_path, 400)
    field = Field(stops=np.empty((0, 2)), masses=None, shapes=None, values=(), counted=())
    slope: Any = SimpleNamespace(prepared=prepared, field=field, rocks=128)
    y = releases_of_round(slope, number).x[:, 1] + prepared.terrain.frame.origin[1]
    counts, _ = np.histogram(y, bins=8, range=(0.0, 400.0))
    assert counts.sum() == 128
    assert counts.min() >= 15  # 16 from each of eight parts of the crest


@pytest.mark.parametrize(("points", "blocks"), [(16, 32), (25, 25), (50, 25)])
def test_each_observed_block_falls_from_many_points(tmp_path: Path, points: int, blocks: int) -> None:
    prepared = prepared_crest(tmp_path, points)
    masses = 100.0 + np.arange(blocks)
    field = Field(stops=np.zeros((blocks, 2)), masses=masses, shapes=None, values=(), counted=())
    slope: Any = SimpleNamespace(prepared=prepared, field=field, rocks=128)
    rounds = [releases_of_round(slope, number) for number in range(20)]
    met = {(mass, y) for each in rounds for mass, y in zip(each.mass.tolist(), each.x[:, 1].tolist(), strict=True)}
    assert min(sum(mass == one for one, _ in met) for mass in masses.tolist()) >= min(points - 2, 15)
    assert all(np.array_equal(each.mass, rounds[0].mass) for each in rounds), "weights of rocks for blocks are kept"


OBSERVED = """\
observed: {points_file: stops.csv, along: [1, 0, 0]}
calibration:
  unknowns: {materials.default.normal_restitution: {min: 0.2, max: 0.5}}
  mass_column: mass
"""


def test_weights_of_rocks_for_blocks_have_the_order_of_the_stops_of_a_flown_set(tmp_path: Path) -> None:
    """Otherwise each block would be ranked among rocks of any mass."""
    prepared_crest(tmp_path, 3)
    stops = [f"5,{y},0,{mass}" for y, mass in ((1, 10), (2, 1000), (3, 100000))]
    (tmp_path / "stops.csv").write_text("\n".join(["x,y,z,mass", *stops]) + "\n")
    (tmp_path / "scene.yaml").write_text(SCENE + OBSERVED)
    slope = slope_of(read_scene(tmp_path / "scene.yaml"))
    releases = releases_of_round(slope, 0)
    assert slope.alike is not None
    flown = fly_set(slope, [0.3], releases)
    masses = releases.mass[_mixed_order(slope.rocks)]
    speeds = np.sqrt(2000.0 * flown.energy / masses)
    assert speeds.max() < 2.0 * speeds.min(), "the energies, and so the stops, have this order"
    assert np.array_equal(slope.alike.argmax(axis=0), np.searchsorted([10.0, 1000.0, 100000.0], masses))


@pytest.mark.parametrize("column", ["mass_column: mass", ""])
def test_fewer_rocks_than_blocks_with_masses_are_refused(tmp_path: Path, column: str) -> None:
    """A block without a rock like it would have no prediction; formerly all weights of the sets became NaN."""
    prepared_crest(tmp_path, 3)
    stops = [f"{k % 9},{k},0,{k + 1}" for k in range(100)]
    (tmp_path / "stops.csv").write_text("\n".join(["x,y,z,mass", *stops]) + "\n")
    observed = OBSERVED.replace("mass_column: mass", f"rocks: 64\n  {column}")
    (tmp_path / "scene.yaml").write_text(SCENE + observed)
    with pytest.raises(SceneError, match="is 64, but 100 observed blocks have") if column else nullcontext():
        assert slope_of(read_scene(tmp_path / "scene.yaml")).rocks == 64


def test_left_out_the_number_of_rocks_is_at_least_that_of_blocks_with_masses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepared_crest(tmp_path, 3)
    monkeypatch.setattr("rpf3d_core.calibration.flying.MOST_ROCKS", 128)
    stops = [f"{k % 9},{k},0,{k + 1}" for k in range(200)]
    (tmp_path / "stops.csv").write_text("\n".join(["x,y,z,mass", *stops]) + "\n")
    (tmp_path / "scene.yaml").write_text(SCENE + OBSERVED)
    slope = slope_of(read_scene(tmp_path / "scene.yaml"))
    assert slope.rocks == 200 and slope.alike is not None and slope.alike.max(axis=1).min() == pytest.approx(1.0)
