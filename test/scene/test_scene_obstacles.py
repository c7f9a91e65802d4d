"""Tests of the scene's keys for barriers and trees: obstacles on the terrain, and refusals that name the key."""

import json

import numpy as np
import pytest
from scenes import small_pit

from rpf3d_core.errors import InputError
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.builders.forest import forest_as_obstacles
from rpf3d_core.setup.named import models_of, obstacles_of
from rpf3d_core.setup.terrain import read_terrain

PANEL = "{{name: net, along: {along}, height: {height}, capacity_kj: {capacity}}}"
TREES = "x,y,dbh_cm,height,kind\n10,20,40,20,conifer\n-30,5,60,,silver_fir\n0,0,25,12,\n"


def barriers(along="[[-20, 0], [20, 0]]", height=3, capacity=100):
    panel = PANEL.format(along=along, height=height, capacity=capacity)
    return f"effects: {{barriers: {{panels: [{panel}]}}}}"


def built(folder, more):
    scene = read_scene(small_pit.scene_file(folder, more=more))
    terrain, _ = read_terrain(scene)
    models = models_of(scene, terrain)
    return scene, terrain, models


def test_a_barrier_stands_on_the_ground_below_its_line(tmp_path):
    _, terrain, models = built(tmp_path, barriers())
    panel = models.effects.head.panel
    length = np.hypot(panel.dx, panel.dy)
    assert length.sum() == pytest.approx(40.0, rel=1e-12) and (length > 0.0).all()
    corners = terrain.vertices[terrain.triangles[panel.facet]]
    low, high = corners[..., 2].min(axis=1), corners[..., 2].max(axis=1)
    assert ((panel.z >= low - 1e-9) & (panel.z <= high + 1e-9)).all()


def test_of_two_barriers_nearly_in_one_place_the_second_moves_onto_the_line_of_the_first(tmp_path):
    """Of three lines along x = 30, only the second is near the first in plan; the third ends 1 m before it begins."""
    near, past = "[[30, -20], [30, 0], [20, 10]]", "[[30.0000000001, 1], [30.0000000001, 9]]"
    given = [("first", near), ("second", "[[30.0000000001, -25], [30.0000000002, 5]]"), ("third", past)]
    panels = ", ".join(PANEL.format(along=line, height=3, capacity=1).replace("net", name) for name, line in given)
    _, terrain, models = built(tmp_path, f"effects: {{barriers: {{panels: [{panels}]}}}}")
    panel, slack = models.effects.head.panel, models.effects.head.slack
    x = panel.x + terrain.frame.origin[0]
    assert slack > 1e-9, "the lines are within the slack"
    assert np.abs(x[panel.line == 2] - 30.0).max() < 1e-12, "the second, on the first section of the first"
    assert np.abs(x[panel.line == 3] - 30.0).max() < 1e-12, "the third, on the second, which reaches it"
    assert np.ptp(panel.y[panel.line == 2] + panel.dy[panel.line == 2]) > 20.0


def test_lines_come_from_geojson_as_well(tmp_path):
    line = {"type": "MultiLineString", "coordinates": [[[-20, 0], [0, 0]], [[0, 10], [0, 30, 5]]]}
    (tmp_path / "lines.geojson").write_text(json.dumps(line))
    scene, _, models = built(tmp_path, barriers("lines.geojson"))
    assert np.hypot(models.effects.head.panel.dx, models.effects.head.panel.dy).sum() == pytest.approx(40.0)
    named = obstacles_of(scene, models)
    assert named.names == ("barriers.net",) and len(named.lines) == 2 and not named.owner.any()
    height = scene.effects.barriers.panels[0].height
    assert named.heights == (height, height)
    tops = [wall.vertices[len(wall.vertices) // 2, 2] - wall.vertices[0, 2] for wall in named.walls]
    assert tops == pytest.approx([height, height])


@pytest.mark.parametrize(
    ("more", "key", "words"),
    [
        (barriers("[[-20, 0], [9000, 0]]"), "effects.barriers.panels[0].along", "leaves the terrain"),
        (barriers("[[3, 3], [3, 3]]"), "effects.barriers.panels[0].along", "two or more different points"),
        (barriers("[[3, 3]]"), "effects.barriers.panels[0].along", "two or more points"),
        (barriers("nowhere.geojson"), "effects.barriers.panels[0].along", "no such file"),
        (barriers("east.geojson"), "effects.barriers.panels[0].along", "lines only"),
        (barriers(height=-1), "effects.barriers.panels[0].height", "0 to 100 (m)"),
        (barriers(height=101), "effects.barriers.panels[0].height", "0 to 100 (m)"),
        (barriers(capacity=-1), "effects.barriers.panels[0].capacity_kj", "kJ"),
        (barriers(capacity="strong"), "effects.barriers.panels[0].capacity_kj", "kJ"),
        ("effects: {barriers: {}}", "effects.barriers.panels", "missing"),
        (
            "effects: {barriers: {panels: [{name: a, along: [[0, 0], [1, 1]], height: 1, capacity_kj: 1}, "
            "{name: a, along: [[0, 0], [1, 1]], height: 1, capacity_kj: 1}]}}",
            "effects.barriers.panels[1].name",
            "names must differ",
        ),
        ("effects: {forest: {}}", "effects.forest", "exactly one of file, stems_per_ha"),
        ("effects: {forest: {stems_per_ha: -3}}", "effects.forest.stems_per_ha", "0 to 20000"),
        ("effects: {forest: {stems_per_ha: 3, dbh_mean_cm: 0}}", "effects.forest.dbh_mean_cm", "above 0"),
        ("effects: {forest: {stems_per_ha: 3, dbh_sd_cm: -1}}", "effects.forest.dbh_sd_cm", "from 0"),
        ("effects: {forest: {stems_per_ha: 3, within: far.geojson}}", "effects.forest.within", "off the terrain"),
        (
            "effects: {forest: {stems_per_ha: 3, deflection: {frontal: [0.5, 0.4, 0.2]}}}",
            "effects.forest.deflection.frontal",
            "add up to 1",
        ),
        (
            "effects: {forest: {stems_per_ha: 3, deflection: {frontal_within: 0.9}}}",
            "effects.forest.deflection.lateral_within",
            "not be below",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_key(tmp_path, more, key, words):
    far = {"type": "Polygon", "coordinates": [[[9e3, 9e3], [9.1e3, 9e3], [9e3, 9.1e3], [9e3, 9e3]]]}
    (tmp_path / "far.geojson").write_text(json.dumps(far))
    with pytest.raises(InputError) as refusal:
        built(tmp_path, more)
    assert f"`{key}`" in str(refusal.value) and words in str(refusal.value)


FROM_A_FILE = "effects: {forest: {file: trees.csv}}"


def test_trees_of_a_file_stand_on_the_ground(tmp_path):
    (tmp_path / "trees.csv").write_text(TREES)
    scene, _, models = built(tmp_path, FROM_A_FILE)
    stems = models.effects.head.stems
    assert stems.radius.tolist() == pytest.approx([0.2, 0.3, 0.125]) and stems.height.tolist() == [20.0, 25.0, 12.0]
    assert stems.energy == pytest.approx([0.93 * 194.0e3, 496.0e3, 0.93 * 65.6e3], rel=0.01)
    named = forest_as_obstacles("forest", scene.effects.forest, models.effects.head)
    assert named.names == ("forest",) and named.stems.shape == (3, 4)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (TREES + "9000,0,30,20,conifer\n", 5, "off the terrain"),
        ("x,y,z,dbh_cm\n0,0,-500,30\n", 2, "inside the ground"),
        ("x,y,z,dbh_cm\n0,0,900,30\n", 2, "in the air"),
        (TREES + "0,0,0,20,conifer\n", 5, "above 0"),
        (TREES + "0,0,30,-2,conifer\n", 5, "above 0"),
        (TREES + "0,0,30,20,palm\n", 5, "conifer, broadleaved or silver_fir"),
        (TREES + "0,zero,30,20,conifer\n", 5, "plain, finite number"),
        (TREES + "0,0\n", 5, "missing"),
        ("x,y,height\n0,0,3\n", 1, "dbh"),
    ],
)
def test_a_tree_that_cannot_be_is_refused_with_its_line(tmp_path, text, line, words):
    (tmp_path / "trees.csv").write_text(text)
    with pytest.raises(InputError) as refusal:
        built(tmp_path, FROM_A_FILE)
    said = str(refusal.value)
    assert "`effects.forest.file`" in said and f"line {line}" in said and words in said


def test_as_many_trees_are_drawn_as_the_density_says_and_only_within_the_polygons(tmp_path):
    square = {"type": "Polygon", "coordinates": [[[-100, -100], [100, -100], [100, 100], [-100, 100], [-100, -100]]]}
    (tmp_path / "square.geojson").write_text(json.dumps(square))
    scene, terrain, models = built(tmp_path, "effects: {forest: {stems_per_ha: 300, within: square.geojson}}")
    stems = models.effects.head.stems
    assert len(stems.x) == 300 * 4
    x, y, _ = terrain.frame.points_to_input(np.stack([stems.x, stems.y, stems.z], axis=1)).T
    assert np.abs(x).max() <= 100.0 and np.abs(y).max() <= 100.0
    halves = np.histogram2d(x, y, bins=2)[0].ravel()
    assert (np.abs(halves - 300) < 5 * np.sqrt(300)).all(), "alike everywhere"
    again = models_of(scene, terrain).effects.head.stems
    assert all(np.array_equal(a, b) for a, b in zip(stems, again, strict=True))


def test_no_trees_at_all_are_a_forest_too(tmp_path):
    _, _, models = built(tmp_path, "effects: {forest: {stems_per_ha: 0}}")
    assert models.effects.head.obstacles == 0
