"""Tests of effects in a scene: read with units, refused by key if wrong, and built for the simulation."""

from pathlib import Path

import numpy as np
import pytest
from scenes.small_pit import scene_file

from rpf3d_core.effects.drag import Drag
from rpf3d_core.effects.drag_layer import stands_at
from rpf3d_core.effects.hooks import links_of
from rpf3d_core.errors import InputError, SceneError
from rpf3d_core.scene.models.scarring import ScarringSpec
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.builders.scarring import ground_of_zone
from rpf3d_core.setup.prepared import prepare


def effects_of(folder: Path, written: str) -> list:
    """Return the effects of a scene as the kernels use them; written : YAML of the key `effects`."""
    scene = read_scene(scene_file(folder, more=f"effects: {written}"))
    return links_of(prepare(scene).flight.models.effects)


@pytest.mark.parametrize(
    ("written", "key", "reason"),
    [
        ("{drag: {coefficient: -1}}", "drag.coefficient", "is -1, but must be a number from 0 to 10"),
        ("{drag: {density: air}}", "drag.density", "is 'air', but must be a number from 0 to 10"),
        ("{drag: {accuracy: 0}}", "drag.accuracy", "is 0, but must be a number of at least 1e-5 (m)"),
        ("{drag: {speed: 3}}", "drag.speed", "is not a key"),
        ("{drag_layer: }", "drag_layer.coefficient", "is missing"),
        ("{drag_layer: {coefficient: -5}}", "drag_layer.coefficient", "is -5, but must be a number from 0 to 1e5"),
        ("{drag_layer: {coefficient: 5, height: tall}}", "drag_layer.height", "is 'tall', but must be a number"),
        ("{drag_layer: {coefficient: 5, polygons: no.geojson}}", "drag_layer.polygons", "names 'no.geojson', but"),
        ("{fragmentation: {cone_deg: 200}}", "fragmentation.cone_deg", "is 200, but must be a number from 0 to 180"),
        ("{fragmentation: {least_volume: 0}}", "fragmentation.least_volume", "is 0, but must be a number of at least"),
        ("{fragmentation: {generations: 9}}", "fragmentation.generations", "is 9, but must be a whole number from 1"),
        ("{scarring: {stiffness: 15}}", "scarring.stiffness", "is 15, but must be a number of at least 1000 (Pa)"),
        ("{scarring: {zones: {bench_1: {kapa: 3}}}}", "scarring.zones.bench_1.kapa", "is not a key"),
        ("{scarring: {zones: {bench_1: {mu_min: -3}}}}", "scarring.zones.bench_1.mu_min", "is -3, but must be"),
    ],
)
def test_a_wrong_parameter_is_refused_by_its_key(tmp_path, written, key, reason):
    with pytest.raises(SceneError) as told:
        read_scene(scene_file(tmp_path, more=f"effects: {written}"))
    assert f"`effects.{key}` {reason}" in str(told.value)


@pytest.mark.parametrize(
    ("written", "reason"),
    [
        ("{scarring: {zones: {bank: {}}}}", "`effects.scarring.zones.bank` fits no zone of the terrain"),
        ("{scarring: {mu_min: 1, mu_max: 0.5}}", "`effects.scarring.mu_max` is 0.5 in zone"),
    ],
)
def test_what_does_not_fit_the_terrain_is_refused_before_anything_flies(tmp_path, written, reason):
    with pytest.raises(InputError) as told:
        effects_of(tmp_path, written)
    assert reason in str(told.value)


def test_drag_is_built_with_the_gravity_of_the_scene(tmp_path):
    assert effects_of(tmp_path, "{drag: }") == [Drag(0.5, 1.2, 0.01, 9.81)]


def test_a_forest_stands_in_its_polygons_or_everywhere(tmp_path):
    """The centre of the pit is the origin of the input; `east.geojson` is the half with x > 0."""
    (everywhere,) = effects_of(tmp_path, "{drag_layer: {coefficient: 500}}")
    (east,) = effects_of(tmp_path, "{drag_layer: {coefficient: 500, height: 12, polygons: east.geojson}}")
    origin = prepare(read_scene(scene_file(tmp_path))).terrain.frame.points_to_local(np.zeros((1, 3)))[0]
    for x, inside in ((5.0, True), (-5.0, False)):
        place = (float(origin[0]) + x, float(origin[1]) + 1.0, 0.0)
        assert stands_at(everywhere.edges, place)
        assert stands_at(east.edges, place) is inside
    assert (east.coefficient, east.height, everywhere.height) == (500.0, 12.0, 30.0)


def test_a_forest_off_the_terrain_is_refused(tmp_path):
    away = '{"type": "Polygon", "coordinates": [[[9000, 0], [9100, 0], [9100, 50], [9000, 0]]]}'
    (tmp_path / "away.geojson").write_text(away)
    with pytest.raises(InputError, match=r"`effects\.drag_layer\.polygons` lie off the terrain"):
        effects_of(tmp_path, "{drag_layer: {coefficient: 500, polygons: away.geojson}}")


def test_the_exact_name_of_a_zone_counts_before_patterns_also_if_it_is_a_pattern_itself():
    wall = {"wall[1]": {"soil_drag": 3}}
    for zones in (wall, {"wall*": {"kappa": 5}, **wall}):
        spec = ScarringSpec.model_validate({"zones": zones})
        assert ground_of_zone(spec, "wall[1]")["soil_drag"] == 3.0
    assert ground_of_zone(spec, "wall_2")["kappa"] == 5.0


def test_soft_ground_is_soft_where_the_scene_says_so(tmp_path):
    written = "{scarring: {kappa: 4, zones: {bench_*: {soil_drag: 3}, bench_1: {stiffness: 1.0e+7, mu_max: 3}}}}"
    (soft,) = effects_of(tmp_path, written)
    scene = read_scene(scene_file(tmp_path, more=f"effects: {written}"))
    zones = prepare(scene).terrain.zones
    first, second = zones.index("bench_1"), zones.index("bench_2")
    hard = next(i for i, zone in enumerate(zones) if not zone.startswith("bench_"))
    assert (soft.stiffness[first], soft.drag[first], soft.mu_max[first]) == (1e7, 2.5, 3.0)
    assert (soft.stiffness[second], soft.drag[second], soft.mu_max[second]) == (15e6, 4.0, 2.0)
    assert (soft.drag[hard], soft.mu_min[hard], soft.mu_max[hard]) == (0.0, 0.0, 0.0)
    assert set(soft.kappa) == {4.0}
