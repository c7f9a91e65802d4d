"""Tests that clicks on the terrain become sources and areas of interest of a scene."""

from dataclasses import replace

import numpy as np
import pytest
from flights.flights_on_a_floor import FRAMES, floor

from rpf3d_core.desk.clicks import AREA, LINE, POINTS, Drawing, area_of, source_of
from rpf3d_core.desk.picking import place_on
from rpf3d_core.errors import InputError
from rpf3d_core.terrain.frame import Frame

DOWN = np.array([0.0, 0.0, -1.0])


def drawn(kind: str, *points: tuple[float, float, float]) -> Drawing:
    drawing = Drawing(kind)
    for point in points:
        drawing = drawing.clicked(np.array(point))
    return drawing


@pytest.mark.parametrize("place", [(0.0, 0.0), (1.7, -3.2), (-4.99, 4.99)])
def test_a_ray_from_above_meets_the_floor_below_it(place: tuple[float, float]) -> None:
    start = np.array([*place, 50.0])
    found = place_on(floor(), start, start + DOWN)
    assert found is not None
    np.testing.assert_allclose(found, [*place, 0.0], atol=1e-12)


def test_a_slanted_ray_meets_the_nearest_facet_and_one_that_misses_meets_none() -> None:
    terrain = floor()
    twice = replace(
        terrain,
        vertices=np.concatenate([terrain.vertices, terrain.vertices + np.array([0.0, 0.0, 2.0])]),
        triangles=np.concatenate([terrain.triangles, terrain.triangles + len(terrain.vertices)]),
        zone=np.concatenate([terrain.zone, terrain.zone]),
    )
    found = place_on(twice, np.array([-3.0, 0.0, 5.0]), np.array([0.0, 0.0, 2.0]))
    assert found is not None and found[2] == pytest.approx(2.0) and found[0] == pytest.approx(0.0)
    assert place_on(twice, np.array([0.0, 0.0, -5.0]), np.array([0.0, 0.0, -6.0])) is None
    assert place_on(twice, np.array([500.0, 0.0, 5.0]), np.array([500.0, 0.0, 4.0])) is None


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize(("kind", "key"), [(POINTS, "points"), (LINE, "line")])
def test_clicks_are_a_source_in_the_coordinates_of_the_input(frame: Frame, kind: str, key: str) -> None:
    local = np.array([(1.0, 2.0, 3.0), (4.0, 6.125, 3.5)])
    source = source_of(drawn(kind, *map(tuple, local)), frame, "a", rocks=7, above_ground=0.5)
    assert (source["name"], source["rocks"], source["above_ground"]) == ("a", 7, 0.5)
    np.testing.assert_allclose(frame.points_to_local(np.array(source[key])), local, atol=0.006)


@pytest.mark.parametrize("frame", FRAMES)
def test_clicks_are_an_area_in_plan_coordinates_of_the_input(frame: Frame) -> None:
    local = [(1.0, 2.0, 3.0), (4.0, 6.0, 3.5), (1.0, 6.0, 9.0)]
    area = area_of(drawn(AREA, *local), frame, "ramp")
    expected = frame.points_to_input(np.array(local))[:, [0, 1] if frame.up == "z" else [0, 2]]
    np.testing.assert_allclose(area["polygons"], expected, atol=0.006)


def test_the_last_click_can_be_taken_back_and_without_a_tool_a_click_does_nothing() -> None:
    drawing = drawn(LINE, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert drawing.undone().points == ((0.0, 0.0, 0.0),)
    assert drawn("", (0.0, 0.0, 0.0)).points == ()


@pytest.mark.parametrize(("kind", "least"), [(POINTS, "1 point"), (LINE, "2 points")])
def test_a_source_of_too_few_clicks_says_how_many_it_needs(kind: str, least: str) -> None:
    with pytest.raises(InputError, match=f"click at least {least} on the terrain"):
        source_of(Drawing(kind), FRAMES[0], "a", 1, 0.0)


def test_an_outline_that_crosses_itself_is_refused_by_its_name() -> None:
    with pytest.raises(InputError, match=r"the area 'bow' must be the corners of a polygon.*crosses itself"):
        area_of(drawn(AREA, (0, 0, 0), (4, 4, 0), (4, 0, 0), (0, 4, 0)), FRAMES[0], "bow")
    with pytest.raises(InputError, match="at least 3 points"):
        area_of(drawn(AREA, (0, 0, 0), (4, 4, 0)), FRAMES[0], "thin")
