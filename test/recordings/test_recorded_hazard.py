"""Tests that the recording shows the hazard of each reached facet by its colour, and the benches."""

import numpy as np
import pytest
from flights.flights_on_a_floor import SURVEY, floor, scene, thrown
from hazards.hazard_layers import Points, lines_of_rocks, maps_of

from rpf3d_core.hazard.benches import bench_table, text_rows
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.hazard.scales import COLOURS, FEW_COLOUR
from rpf3d_core.recordings.blueprint import LAYERS
from rpf3d_core.recordings.hazard import (
    BENCHES,
    ENERGY,
    LIFT,
    REACH,
    STEPS,
    bench_document,
    hazard_layers,
    hazard_mesh,
)
from rpf3d_core.recordings.log import RecordedGround, write_recording

pytest.importorskip("rerun", reason="rerun is not installed")

SINGLE = 1e-5


@pytest.fixture(scope="module")
def maps():
    return maps_of(floor(SURVEY, cells=40), lines_of_rocks(floor(SURVEY)), 2.0)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, maps):
    folder = tmp_path_factory.mktemp("recording")
    terrain = floor(SURVEY, cells=40)
    write_recording(folder / "with.rrd", scene(folder), RecordedGround(terrain), thrown(terrain), None, maps)
    write_recording(folder / "without.rrd", scene(folder), RecordedGround(terrain), thrown(terrain))
    return {name: read_back(folder / f"{name}.rrd") for name in ("with", "without")}


def read_back(path):
    """Return entity -> column -> first value, of blueprint and recording."""
    import rerun.chunk

    entities = {}
    for chunk in rerun.chunk.RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = entities.setdefault(str(chunk.entity_path), {})
        for name in batch.schema.names:
            columns.setdefault(name, batch.column(name)[0])
    return entities


def hidden_entities(path):
    """Return name of a view -> entities that it hides, from the blueprint of a recording."""
    import rerun.chunk

    reader = rerun.chunk.RrdReader(path)
    names, hidden = {}, {}
    for chunk in reader.stream(store=reader.blueprints()[0]).to_chunks():
        batch, (_, *place) = chunk.to_record_batch(), str(chunk.entity_path).split("/")
        if place[0] == "view" and "ViewBlueprint:display_name" in batch.schema.names:
            names[place[1]] = batch.column("ViewBlueprint:display_name").to_pylist()[0][0]
        if "EntityBehavior:visible" in batch.schema.names:
            assert batch.column("EntityBehavior:visible").to_pylist() == [[False]]
            hidden.setdefault(place[1], set()).add("/".join(place).split("overrides/")[1].removesuffix("/visualizers"))
    return {name: hidden.get(number, set()) for number, name in names.items()}


def test_there_is_a_view_for_each_layer_that_hides_the_other_and_what_would_cover_it(recorded, tmp_path, maps):
    terrain = floor(SURVEY, cells=40)
    write_recording(tmp_path / "run.rrd", scene(tmp_path), RecordedGround(terrain), thrown(terrain), None, maps)
    hidden = hidden_entities(tmp_path / "run.rrd")
    assert hidden["Reach probability"] == {ENERGY, "world/trajectories", "world/ends"}
    assert hidden["Energy, p95"] == {REACH, "world/trajectories", "world/ends"}
    (paths,) = [name for name in hidden if name.startswith("Terrain by zone")]
    assert hidden[paths] == {REACH, ENERGY}
    assert {"/world/trajectories", "/world/ends"} <= set(recorded["with"])  # what is hidden has these names
    write_recording(tmp_path / "run.rrd", scene(tmp_path), RecordedGround(terrain), thrown(terrain))
    assert set().union(*hidden_entities(tmp_path / "run.rrd").values()) == set()


def test_layers_are_entities_of_their_own_and_only_there_with_maps(recorded):
    names = {f"/{name}" for name in (REACH, ENERGY, BENCHES)}
    assert names <= set(recorded["with"])
    assert not names & set(recorded["without"])
    assert set(LAYERS) == {REACH, ENERGY}


def test_a_layer_is_the_facets_that_rocks_came_to(recorded, maps):
    mesh = recorded["with"][f"/{REACH}"]
    assert len(mesh["Mesh3D:triangle_indices"].as_py()) == len(maps.facets.cell)
    assert 0 < len(maps.facets.cell) < maps.facets.count


@pytest.mark.parametrize("number", [0, 1])
def test_each_facet_has_the_colour_of_its_own_value_at_all_corners(maps, number):
    terrain, layer = floor(SURVEY, cells=40), hazard_layers(maps)[number]
    mesh = hazard_mesh(terrain, maps, layer, number + 1)
    corners = mesh.colours[mesh.triangles].astype(int)
    assert (corners == corners[:, :1]).all()
    values = maps.facets.rocks / maps.flown if number == 0 else maps.facets.energy.p95
    scale = layer.scale
    place = np.log(np.clip(values, scale.low, scale.high) / scale.low) / np.log(scale.high / scale.low)
    few = np.isnan(values)
    assert few.any() == (number == 1)
    np.testing.assert_array_equal(corners[few, 0], np.tile(FEW_COLOUR, (few.sum(), 1)))
    stops = np.linspace(0.0, 1.0, len(COLOURS))
    exact = np.stack([np.interp(place[~few], stops, channel) for channel in COLOURS.T], axis=-1)
    widest = np.abs(np.diff(COLOURS, axis=0)).max() * (len(COLOURS) - 1) / STEPS / 2 + 1.0
    assert np.abs(corners[~few, 0] - exact).max() <= widest
    assert len(np.unique(corners[~few, 0], axis=0)) > 3


def test_a_layer_lies_a_little_above_its_facets_and_none_in_another(maps):
    terrain = floor(SURVEY, cells=40)
    heights = [hazard_mesh(terrain, maps, layer, n).vertices[:, 2] for n, layer in enumerate(hazard_layers(maps), 1)]
    lift = LIFT * 40.0 * np.sqrt(2.0)
    np.testing.assert_allclose(heights[0], lift, rtol=SINGLE)
    np.testing.assert_allclose(heights[1], 2.0 * lift, rtol=SINGLE)


def test_the_bench_table_is_a_page_that_tells_what_the_colours_mean(recorded, maps):
    text = recorded["with"][f"/{BENCHES}"]["TextDocument:text"].as_py()[0]
    terrain = floor(SURVEY, cells=40)
    for row in text_rows(bench_table(terrain, maps)):
        assert f"| {' | '.join(row)} |" in text
    assert "300 rocks" in text and "95 % intervals (Wilson)" in text
    assert "| Reach probability | 0.2 % |" in text and "| 100 % |" in text and "kJ |" in text
    assert text == bench_document(terrain, maps, hazard_layers(maps))


def test_no_rocks_are_no_layers_but_a_table_that_says_so(tmp_path):
    terrain, none, path = floor(), np.empty(0), tmp_path / "run.rrd"
    empty = Points(none.astype(int), np.empty((0, 2)), none, none, none, none.astype(bool))
    maps = maps_of(terrain, empty, 2.0)
    write_recording(path, scene(tmp_path), RecordedGround(terrain), thrown(terrain), None, maps)
    entities = read_back(path)
    assert f"/{REACH}" not in entities and "0 rocks" in entities[f"/{BENCHES}"]["TextDocument:text"].as_py()[0]


def test_few_rocks_have_a_colour_that_no_value_has(maps):
    assert np.abs(COLOURS - FEW_COLOUR).max(axis=1).min() > 50
    assert (maps.facets.rocks[np.isnan(maps.facets.energy.p95)] < FEWEST_ROCKS).all()
