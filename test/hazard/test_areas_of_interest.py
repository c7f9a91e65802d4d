"""Tests that the counts of areas of interest equal those that shapely finds from stored paths."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from flights import scenes_of_facets as made
from flights.flights_on_a_floor import FRAMES, maps_of, scene
from hazards.area_tracks import plan_tracks, reached
from hazards.hazard_layers import laid_out_maps

from rpf3d_core.ensemble.paths import sample_paths
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.setup.areas import read_areas
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Outcome

ROCKS = 150
SIDE = 18.0
FINE = 0.01
"""Distance (m) between the sampled points of a path; meanwhile a rock at 20 m/s gains 0.005 m/s."""

SHAPES = {
    "plain": [[[(4, 4), (14, 4), (14, 14), (4, 14)]]],
    "with a hole": [[[(2, 2), (16, 2), (16, 16), (2, 16)], [(5, 5), (13, 5), (13, 13), (5, 13)]]],
    "two parts": [[[(1, 1), (6, 2), (4, 7)]], [[(10, 10), (17, 11), (12, 17)]]],
    "parts that overlap": [[[(3, 3), (11, 3), (11, 11), (3, 11)]], [[(7, 7), (15, 7), (15, 15), (7, 15)]]],
    "a part in a hole": [
        [[(2, 2), (16, 2), (16, 16), (2, 16)], [(4, 4), (14, 4), (14, 14), (4, 14)]],
        [[(8, 8), (10, 8), (10, 10), (8, 10)]],
    ],
    "bent": [[[(2, 8), (9, 16), (16, 8), (9, 11)]]],
    "beside": [[[(40, 40), (41, 40), (41, 41)]]],
}


def in_input(frame: Frame, ring: list[tuple[float, float]]) -> list[list[float]]:
    """Return the closed ring, from corners (m) of the local frame, in the plan axes of the input."""
    points = frame.points_to_input(np.array([(*corner, 0.0) for corner in [*ring, ring[0]]], dtype=float))
    return points[:, [0, 1] if frame.up == "z" else [0, 2]].tolist()


def file_of(folder: Path, name: str) -> Path:
    return folder / f"{name}.json".replace(" ", "_")


def write_area(file: Path, frame: Frame, polygons: list) -> Path:
    """Write polygons as GeoJSON and return the file: disjoint ones as a MultiPolygon, overlapping ones as features."""
    coordinates = [[in_input(frame, ring) for ring in rings] for rings in polygons]
    apart = shapely.geometry.MultiPolygon([shapely.geometry.Polygon(rings[0], rings[1:]) for rings in coordinates])
    parts = [("MultiPolygon", coordinates)] if apart.is_valid else [("Polygon", rings) for rings in coordinates]
    features = [
        {"type": "Feature", "properties": {}, "geometry": {"type": kind, "coordinates": found}} for kind, found in parts
    ]
    file.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return file


@pytest.fixture(scope="module")
def flown():
    """Return a rough terrain and flights over it, with all tables."""
    terrain = made.rough_grid(12, SIDE, 0.3, 0.6, seed=5)
    random = np.random.default_rng(3)
    x = random.uniform(1.0, SIDE - 1.0, (ROCKS, 3))
    x[:, 2] = 8.0
    physics = made.flight(made.surface(0.6, 0.85, 25.0))
    return terrain, made.fly(made.engine_over("compiled", terrain), physics, x, random.uniform(-4.0, 4.0, (ROCKS, 3)))


@pytest.fixture(params=FRAMES, ids=lambda frame: f"{frame.up}-up at {frame.origin[0]:.0f}")
def counted(request, flown, tmp_path):
    """Return a scene with areas, its terrain in a frame, the flights, and the maps of the flights by the tallies."""
    made_terrain, flights = flown
    terrain = Terrain(
        made_terrain.vertices, made_terrain.triangles, made_terrain.zone, made_terrain.zones, request.param
    )
    areas = []
    for name, polygons in SHAPES.items():
        file = write_area(file_of(tmp_path, name), request.param, polygons)
        areas.append(f"{{name: {name}, polygons: {file.name}}}")
    named = scene(tmp_path, f"areas_of_interest: [{', '.join(areas)}]\n")
    return named, terrain, flights, laid_out_maps(maps_of(named, terrain, flights))


def test_the_rocks_that_reach_an_area_are_those_whose_tracks_meet_it(counted, tmp_path) -> None:
    _, terrain, flights, maps = counted
    tracks = plan_tracks(terrain.frame, flights)
    assert maps.area_names == tuple(SHAPES)
    for number, name in enumerate(SHAPES):
        theirs = reached(tracks, read_polygons(file_of(tmp_path, name)), ROCKS).sum()
        assert maps.areas.rocks[number] == theirs, name
        assert (theirs == 0) == (name == "beside") and theirs < ROCKS


def test_the_rocks_that_stop_and_strike_in_an_area_are_those_that_lie_in_it(counted) -> None:
    named, terrain, flights, maps = counted
    plan = [0, 1] if terrain.frame.up == "z" else [0, 2]
    ends, struck = (terrain.frame.points_to_input(x)[:, plan] for x in (flights.deposits.x, flights.impacts.x))
    stopped = flights.deposits.outcome == Outcome.STOPPED
    for number, (name, area) in enumerate(read_areas(named).items()):
        inside = shapely.contains_xy(area, *ends.T) & stopped
        assert maps.areas.deposits[number] == inside.sum(), name
        assert maps.areas.impacts[number] == shapely.contains_xy(area, *struck.T).sum(), name
        if name != "beside":
            assert inside.sum() > 0


def test_the_energy_in_an_area_is_the_largest_on_the_stretches_inside_it(counted) -> None:
    named, terrain, flights, maps = counted
    samples = sample_paths(flights.paths, max_step=FINE)
    plan = [0, 1] if terrain.frame.up == "z" else [0, 2]
    points = terrain.frame.points_to_input(samples.x)[:, plan]
    for number, area in enumerate(read_areas(named).values()):
        inside = shapely.contains_xy(area, *points.T)
        fastest = float(samples.speed[inside].max(initial=0.0))
        told = float(maps.areas.speed.largest[number])
        if not inside.any():
            assert math.isnan(told)
        else:
            assert fastest * (1 - 1e-6) <= told <= fastest + 9.81 * FINE, "between two points a rock may be faster"


def test_parts_that_overlap_are_one_area(tmp_path) -> None:
    """If crossings of edges were counted for both parts together, their overlap would be outside."""
    write_area(tmp_path / "overlap.json", Frame(), SHAPES["parts that overlap"])
    area = read_areas(scene(tmp_path, "areas_of_interest: [{name: both, polygons: overlap.json}]\n"))["both"]
    assert len(area.geoms) == 1 and area.area == 2 * 64.0 - 16.0 and shapely.contains_xy(area, 9.0, 9.0)


def test_corners_in_the_scene_are_the_same_area_as_a_file_with_them(tmp_path: Path) -> None:
    corners = [[4, 4], [14, 4], [14, 14], [4, 14]]
    (tmp_path / "a.json").write_text(json.dumps({"type": "Polygon", "coordinates": [[*corners, corners[0]]]}))
    read = scene(tmp_path, f"areas_of_interest: [{{name: a, polygons: a.json}}, {{name: b, polygons: {corners}}}]\n")
    areas = read_areas(read)
    assert areas["a"].equals_exact(areas["b"])
