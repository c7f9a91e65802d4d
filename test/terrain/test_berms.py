"""Tests of berms (windrows): they raise the ground exactly by their shape, keep it one sheet, and stop rocks."""

import json

import numpy as np
import pytest
from flights import scenes_of_facets as made
from flights.on_both_engines import BOTH, as_loaded, lies_on, loses_energy
from input_files.terrain_files import grid
from scenes import small_pit

from rpf3d_core.errors import InputError
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup import berms
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.terrain.berms import raised
from rpf3d_core.terrain.facets import Terrain, area_vectors
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.ridge import Ridge, height_at, ridge_along
from rpf3d_core.terrain.sections import ground_at
from rpf3d_core.values import Outcome

ROUNDING = 1e-12
"""Largest rounding error (m) of heights of some metres on terrains of some tens of metres."""
ROUGH = made.rough_grid(12, 18.0, 0.3, 0.6, seed=5)
LINES = {
    "bends": [[3, 3], [9, 12.2], [15, 13]],
    "along the edges of facets": [[3, 4.5], [12, 4.5], [12, 9]],
    "beyond the rim": [[-3, 4.5], [22, 4.5]],
}


def ridge(line, height=1.0, width=3.0, crest=1.0) -> Ridge:
    found = ridge_along(np.array(line, dtype=float), height, width, crest)
    assert found is not None
    return found


def open_edges(terrain: Terrain) -> np.ndarray:
    """Return both ends (E, 2, 2) m in plan of the edges of only one facet."""
    edges = edges_of(terrain.triangles, len(terrain.vertices))
    assert (edges.uses <= 2).all()
    alone = edges.uses == 1
    return terrain.vertices[np.stack([edges.low[alone], edges.high[alone]], axis=1)][..., :2]


@pytest.mark.parametrize("crest", [0.0, 1.0])
@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_the_ground_is_higher_by_the_berm_and_is_otherwise_as_it_was(line, crest):
    shape = ridge(line, crest=crest)
    berm = raised(ROUGH, shape, "berm_a")
    places = np.random.default_rng(0).uniform(0.0, 18.0, (5000, 2))
    before, after = ground_at(ROUGH, places)[0], ground_at(berm, places)[0]
    expected = height_at(shape, places, 0.0)
    np.testing.assert_allclose(after - before, expected, atol=ROUNDING)
    assert expected.max() == pytest.approx(1.0, abs=0.02) and (expected == 0.0).mean() > 0.4


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
def test_the_terrain_stays_one_sheet_without_a_hole(line):
    berm = raised(ROUGH, ridge(line), "berm_a")
    rims = open_edges(berm)
    on_rim = (np.abs(rims - 0.0) < 1e-9) | (np.abs(rims - 18.0) < 1e-9)
    assert on_rim.all(axis=1).any(axis=1).all(), "every open edge lies on the rim of the terrain"
    areas = area_vectors(berm.vertices, berm.triangles)
    assert (areas[:, 2] > 0.0).all(), "nothing is folded over or has no area"
    plan = areas[:, 2].sum()
    assert plan == pytest.approx(18.0 * 18.0, rel=1e-9)


def test_facets_of_the_berm_are_a_zone_and_others_keep_theirs_and_their_numbers():
    shape = ridge(LINES["bends"])
    berm = raised(ROUGH, shape, "berm_a")
    assert berm.zones == ("ground", "berm_a")
    middle = berm.vertices[berm.triangles].mean(axis=1)[:, :2]
    assert np.array_equal(berm.zone == 1, height_at(shape, middle, 0.0) > 0.0)
    count = len(ROUGH.triangles)
    same = (berm.vertices[berm.triangles[:count]] == ROUGH.vertices[ROUGH.triangles]).all(axis=(1, 2))
    assert same.sum() > 0.5 * count and (berm.zone[:count][same] == 0).all()


def test_a_section_is_the_trapezoid_that_was_asked_for():
    berm = raised(made.floor(), ridge([[-5, 0], [5, 0]], 1.5, 4.0, 1.0), "berm_a")
    across = np.array([-2.5, -2.0, -1.25, -0.5, 0.0, 0.5, 1.25, 2.0, 2.5])
    z, _ = ground_at(berm, np.stack([np.full(9, 1.0), across], axis=1))
    np.testing.assert_allclose(z, [0.0, 0.0, 0.75, 1.5, 1.5, 1.5, 0.75, 0.0, 0.0], atol=ROUNDING)
    beyond, _ = ground_at(berm, np.array([[5.75, 0.0], [6.5, 0.0], [7.0, 0.0]]))
    np.testing.assert_allclose(beyond, [0.75, 0.0, 0.0], atol=ROUNDING)


@pytest.mark.parametrize("line", [[[0, 0], [10, 0], [0, 0.5]], [[0, 0], [10, 0], [10, 0.5], [0, 0.5]]])
def test_a_line_that_bends_too_sharply_has_no_ridge(line):
    assert ridge_along(np.array(line, dtype=float), 1.0, 4.0, 1.0) is None


@BOTH
@pytest.mark.parametrize("model", ["none", "sliding"])
def test_slow_rocks_stop_before_a_berm_and_none_falls_through_it(engine, model):
    terrain = as_loaded(raised(made.floor(cells=7), ridge([[5, -19], [5, 19]], 2.0, 6.0, 1.0), "berm_a"))
    number = 60 if engine == "compiled" else 15
    random = np.random.default_rng(4)
    x = np.stack([np.full(number, -10.0), random.uniform(-15, 15, number), np.zeros(number)], 1)
    v = np.stack([random.uniform(4, 5.9, number), random.uniform(-1, 1, number), np.zeros(number)], 1)
    physics = made.flight(made.surface(0.5, 0.99, 4.0), model)
    over = made.engine_over(engine, terrain)
    flights = made.fly(over, physics, x, v)
    ended = flights.deposits.outcome
    held = (ended == Outcome.STOPPED) if model == "sliding" else ended != Outcome.LEFT_TERRAIN
    assert held.all() and lies_on(over, flights) and loses_energy(flights)
    assert (flights.deposits.x[:, 0] < 5.0).all(), "0.5 v^2 is not enough to come over the crest"
    if model == "sliding":
        free = made.fly(made.engine_over(engine, made.floor(cells=7)), physics, x, v)
        assert (free.deposits.x[:, 0] > 5.0).any(), "some would have gone further"


@BOTH
def test_rocks_that_fall_onto_a_berm_on_rough_ground_all_come_to_rest_on_it_or_beside_it(engine):
    ground, wide = made.rough_grid(12, 18.0, 0.0, 0.3, seed=2), ridge(LINES["bends"], 1.0, 5.0, 2.0)
    terrain = as_loaded(raised(ground, wide, "berm_a"))
    number = 100 if engine == "compiled" else 25
    random = np.random.default_rng(8)
    x = np.stack([random.uniform(4, 14, number), random.uniform(4, 14, number), random.uniform(2, 8, number)], 1)
    over = made.engine_over(engine, terrain)
    flights = made.fly(over, made.flight(made.surface(0.4, 0.6, 40.0)), x)
    assert (flights.deposits.outcome == Outcome.STOPPED).all() and lies_on(over, flights)
    assert (terrain.zone[flights.deposits.facet] == 1).any()


BERM = "berms: [{{name: {name}, along: {along}, height: {height}, width: {width}, crest: {crest}}}]"


def with_berm(folder, name="south", along="[[-40, -40], [40, -40]]", height=2, width=6, crest=1, more=""):
    path = small_pit.scene_file(folder, more=more)
    text = BERM.format(name=name, along=along, height=height, width=width, crest=crest)
    path.write_text(path.read_text().replace("terrain:\n", f"terrain:\n  {text}\n"))
    return path


def test_a_scene_raises_its_berms_on_the_terrain_as_zones_of_their_own(tmp_path):
    square = {"type": "Polygon", "coordinates": [[[-90, -90], [90, -90], [90, 90], [-90, 90], [-90, -90]]]}
    (tmp_path / "square.geojson").write_text(json.dumps(square))
    scene = read_scene(with_berm(tmp_path, more="zones: [{zone: middle, polygons: square.geojson}]"))
    terrain, faults = read_terrain(scene)
    free, before = read_terrain(read_scene(small_pit.scene_file(tmp_path, name="free.yaml")))
    assert "berm_south" in terrain.zones and "middle" in terrain.zones
    assert (faults.holes, faults.pieces, faults.non_manifold_edges) == (before.holes, before.pieces, 0)
    places = free.frame.points_to_local(np.array([[0.0, -40.0, 0.0], [0.0, -60.0, 0.0]]))[:, :2]
    z = ground_at(terrain, places)[0] - ground_at(free, places)[0]
    np.testing.assert_allclose(z, [2.0, 0.0], atol=1e-9)
    _, facet = ground_at(terrain, places)
    assert [terrain.zones[terrain.zone[f]] for f in facet] == ["berm_south", "middle"]


def test_the_bench_table_has_a_row_for_a_berm(tmp_path):
    run = simulate(with_berm(tmp_path), engine="reference", rocks=10)
    assert "berm_south" in run.terrain.zones and run.maps.zones.count == len(run.terrain.zones)


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({"height": 0}, "terrain.berms[0].height", "above 0 up to 50 (m)"),
        ({"height": 51}, "terrain.berms[0].height", "above 0 up to 50 (m)"),
        ({"width": 0}, "terrain.berms[0].width", "above 0"),
        ({"crest": 6}, "terrain.berms[0].crest", "below the width"),
        ({"along": "[[0, 0], [9000, 0]]"}, "terrain.berms[0].along", "leaves the terrain"),
        ({"along": "[[0, 0], [10, 0], [0, 0.5]]"}, "terrain.berms[0].along", "bends too sharply"),
        ({"along": "[[0, 0], [0, 0]]"}, "terrain.berms[0].along", "all its points are the same"),
    ],
)
def test_a_berm_that_cannot_be_is_refused_with_its_key(tmp_path, given, key, words):
    with pytest.raises(InputError) as refusal:
        read_terrain(read_scene(with_berm(tmp_path, **given)))
    assert f"`{key}`" in str(refusal.value) and words in str(refusal.value)


def told(folder, **given) -> list[str]:
    return [each for each in read_terrain(read_scene(with_berm(folder, **given)))[1].remarks if "berms[0]" in each]


def test_a_berm_that_loose_rock_can_form_on_level_ground_has_no_warning(tmp_path):
    assert told(tmp_path) == []


def test_steep_sides_of_a_berm_are_warned_of(tmp_path):
    (found,) = told(tmp_path, width=2, crest=1)
    assert found.startswith("`terrain.berms[0]` 'south' has sides of 76 degrees on level ground")


def test_a_berm_whose_foot_reaches_a_face_is_warned_of(tmp_path):
    """Height and width in feet gave a windrow 18 m wide, on a berm 8 m wide, without a word."""
    (found,) = told(tmp_path, along="[[-20, -110], [20, -110]]", height=4, width=40)
    assert "% of the foot of `terrain.berms[0]` 'south' lie on ground steeper than 35 degrees, up to" in found


def test_rough_level_ground_at_a_foot_has_no_warning():
    """Of the facets of a survey with a mesh of 0.25 m and a noise of 0.1 m, many are steeper than 35 degrees."""
    vertices, triangles = grid(240, 240, 0.25)
    vertices[:, 2] = np.random.default_rng(1).normal(0.0, 0.1, len(vertices))
    level = made.terrain_of(vertices, triangles)
    slopes = berms._slopes_at_foot(level, ridge([[10, 30], [50, 32]]), 1.5)
    assert len(slopes) > 50 and slopes.max() < berms.STEEP_GROUND


@pytest.mark.parametrize("beyond", [1.0, 8.0])
def test_a_foot_just_beyond_a_crest_and_one_on_the_bench_below_are_steep(beyond):
    """A face of 70 degrees and 15 m lies next to the berm; the foot is 1 m beyond its crest, or on the floor."""
    vertices, triangles = grid(121, 121, 0.5)
    vertices[:, 2] = -np.clip(vertices[:, 1] - 30.0, 0.0, 5.5) * np.tan(np.radians(70.0))
    wide = ridge([[10, 21 + beyond], [50, 21 + beyond]], 4.0, 18.0, 1.0)
    slopes = berms._slopes_at_foot(made.terrain_of(vertices, triangles), wide, 9.0)
    assert 0.3 < (slopes > berms.STEEP_GROUND).mean() < 0.7


def test_the_ground_at_a_foot_is_found_among_the_facets_near_it(monkeypatch):
    """A search among 2 million facets takes 1 s; the facets near the foot are found in 0.1 s."""
    rough = made.rough_grid(60, 18.0, 0.3, 0.6, seed=5)
    shape = ridge(LINES["bends"])
    slopes = berms._slopes_at_foot(rough, shape, 1.5)
    monkeypatch.setattr(berms, "MANY", 0)
    assert len(slopes) > 20 and np.array_equal(berms._slopes_at_foot(rough, shape, 1.5), slopes)
    foot = np.array([[3.0, 3.0]])
    assert 0 < len(berms._near(rough, foot).triangles) < 0.1 * len(rough.triangles)
