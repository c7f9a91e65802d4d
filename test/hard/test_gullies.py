"""Tests of contacts with several facets at the same time: in gullies, corners, pits and slots."""

import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, MODELS, NEAR, G, along_flights, lies_on, loses_energy, outcomes
from flights.scenes_of_facets import (
    cone,
    engine_over,
    flight,
    fly,
    grid_triangles,
    gully,
    joined,
    rough_grid,
    specific_energy,
    surface,
    terrain_of,
)

from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Outcome


@BOTH
@MODELS
@pytest.mark.parametrize("R_n", [0.0, 0.3, 0.8])
def test_a_rock_dropped_into_a_gully_stays_in_it_and_never_falls_through(engine, model, R_n):
    draw = np.random.default_rng(2)
    x = np.stack([draw.uniform(0, 20, 40), draw.uniform(-1, 1, 40), draw.uniform(2, 6, 40)], 1)
    x[:10, 1] = 0.0
    over = engine_over(engine, gully(35.0, 50.0, 2.0, cells=7))
    flights = fly(over, flight(surface(R_n, 0.7, 35.0, 0.5), model), x, (0.5, 0.0, 0.0))
    allowed = {Outcome.STOPPED} if model == "sliding" else {Outcome.STOPPED, Outcome.UNRESOLVED_CONTACT}
    assert outcomes(flights) <= allowed
    points = along_flights(flights)
    left, right = math.tan(math.radians(35)), math.tan(math.radians(50))
    ground = np.where(points[:, 1] > 0, left, -right) * points[:, 1] - math.tan(math.radians(2)) * points[:, 0]
    assert np.all(points[:, 2] > ground - NEAR)
    assert lies_on(over, flights) and loses_energy(flights)


@BOTH
def test_a_rock_that_falls_straight_into_the_line_of_a_level_gully_meets_both_sides_in_turn(engine):
    """With walls of 45 degrees and without losses, the rock bounces from wall to wall and rises vertically again."""
    flights = fly(
        engine_over(engine, gully(45.0, 45.0, 0.0)), flight(surface(1.0, 1.0), "none", max_impacts=60), (3.0, 0.0, 4.0)
    )
    speed = math.sqrt(8 * G)
    np.testing.assert_allclose(flights.impacts.speed_in[:2], speed, rtol=1e-9)
    np.testing.assert_allclose(flights.impacts.x[:2], [(3.0, 0.0, 0.0)] * 2, atol=1e-9)
    np.testing.assert_allclose(flights.impacts.t[1], flights.impacts.t[0], atol=1e-9)
    assert flights.impacts.normal[0] @ flights.impacts.normal[1] == pytest.approx(0.0, abs=1e-12)
    after, _ = specific_energy(flights)
    np.testing.assert_allclose(after, after[0], rtol=1e-9)


@BOTH
@MODELS
@pytest.mark.parametrize("sides", [3, 4, 6, 7])
def test_a_rock_comes_to_rest_at_the_bottom_of_a_pit_with_one_vertex(engine, sides, model):
    draw = np.random.default_rng(sides)
    x = np.concatenate([draw.uniform(-0.8, 0.8, (20, 2)), draw.uniform(3, 4, (20, 1))], 1)
    x[0, :2] = 0.0
    over = engine_over(engine, cone(sides))
    flights = fly(over, flight(surface(0.4, 0.6, 20.0, 0.3), model), x)
    assert lies_on(over, flights) and loses_energy(flights)
    assert outcomes(flights) <= {Outcome.STOPPED, *([Outcome.UNRESOLVED_CONTACT] if model == "none" else [])}
    if model == "sliding":  # steeper than the friction angle: only an edge or the vertex can hold the rock
        assert np.all(flights.deposits.x[:, 2] < 3.0)


@BOTH
def test_a_rock_laid_exactly_on_the_vertex_of_a_pit_stays_there(engine):
    flights = fly(engine_over(engine, cone(5)), flight(surface(friction_angle=10.0, stop_speed=0.0)), (0.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert np.linalg.norm(flights.deposits.x[0]) < NEAR


@BOTH
@MODELS
def test_a_rock_dropped_into_a_corner_of_three_facets_stops_in_it(engine, model):
    """The corner is that of a cube on its tip: every rebound sends the rock into the next facet."""
    tips = np.array(
        [[math.cos(a), math.sin(a), math.sqrt(0.5)] for a in (0.1, 0.1 + 2 * math.pi / 3, 0.1 + 4 * math.pi / 3)]
    )
    over = engine_over(engine, terrain_of([(0, 0, 0), *(10 * tips)], [(0, 1, 2), (0, 2, 3), (0, 3, 1)]))
    draw = np.random.default_rng(4)
    x = np.concatenate([draw.uniform(-1, 1, (50, 2)), draw.uniform(4, 6, (50, 1))], 1)
    x[0, :2] = 0.0
    flights = fly(over, flight(surface(0.5, 0.8, 30.0, 0.5), model), x)
    assert outcomes(flights) <= {Outcome.STOPPED, *([Outcome.UNRESOLVED_CONTACT] if model == "none" else [])}
    heights = along_flights(flights) @ np.asarray(over.facets.normals).T
    assert heights.min() > -NEAR, "a convex room: inside is above all three planes"
    assert lies_on(over, flights) and loses_energy(flights)


@BOTH
@pytest.mark.parametrize("steps", [3, 40])
def test_a_rock_that_slides_along_the_line_of_a_meshed_gully_passes_its_vertices(engine, steps):
    """The normal forces of both walls, per mass, sum to g (sin a + sin b) / sin(a + b); friction is 0.05."""
    over = engine_over(engine, gully(30.0, 10.0, 0.0, length=60.0, cells=steps))
    flights = fly(over, flight([Surface(0.5, 0.8, 0.05, 0.0)] * 2), (0.0, 0.0, 0.0), (5.0, 0.0, 0.0))
    a, b = math.radians(30), math.radians(10)
    push = G * (math.sin(a) + math.sin(b)) / math.sin(a + b)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0, 0] == pytest.approx(25.0 / (2 * 0.05 * push), rel=1e-9)
    np.testing.assert_allclose(flights.paths.x[:, 1:], 0.0, atol=1e-9)


@BOTH
@MODELS
@pytest.mark.parametrize("angle", [80.0, 89.0, 89.9])
def test_a_rock_that_falls_between_two_walls_is_wedged_above_the_line_where_they_meet(engine, model, angle):
    """The gully is 2 m wide at the top; a friction angle of 30 degrees holds no rock on one wall alone."""
    depth = math.tan(math.radians(angle))
    over = engine_over(engine, gully(angle, angle, 0.0, side=1.0))
    draw = np.random.default_rng(5)
    x = np.stack([draw.uniform(5, 15, 12), draw.uniform(-0.9, 0.9, 12), np.full(12, depth + 0.5)], 1)
    flights = fly(over, flight(surface(0.5, 0.8, 30.0), model), x, (0.2, 0.1, 0.0))
    assert outcomes(flights) <= {Outcome.STOPPED, *([Outcome.UNRESOLVED_CONTACT] if model == "none" else [])}
    points = along_flights(flights)
    assert np.all(np.abs(points[:, 1]) * depth <= points[:, 2] + NEAR * depth), "between the walls, all the way"
    assert loses_energy(flights) and lies_on(over, flights)
    if model == "sliding":
        np.testing.assert_allclose(flights.deposits.x[:, 1:], 0.0, atol=NEAR)


@BOTH
def test_a_rock_in_a_slot_of_a_millimetre_bounces_to_and_fro_without_loss_and_falls_as_freely(engine):
    """At 5 m/s across 1 mm and with R_n = R_t = 1, there are 5,000 impacts per second; z is as in free fall."""
    gap, impacts = 1e-3, 2000
    faces = [
        terrain_of([(x, -9, -30), (x, 9, -30), (x, 9, 30), (x, -9, 30)], [(0, 1, 2), (0, 2, 3)]) for x in (0.0, gap)
    ]
    slot = joined(*faces)
    turned_in = terrain_of(slot.vertices, np.concatenate([slot.triangles[:2], slot.triangles[2:, ::-1]]))
    flights = fly(
        engine_over(engine, turned_in), flight(surface(1.0, 1.0), "none", max_impacts=impacts), (0.5 * gap, 0.3, 20.0),
        (5.0, 0.0, 0.0),
    )  # fmt: skip
    t = (np.arange(impacts) + 0.5) * gap / 5.0
    np.testing.assert_allclose(flights.impacts.t, t, rtol=1e-9)
    np.testing.assert_allclose(flights.impacts.x[:, 2], 20.0 - 0.5 * G * t * t, rtol=1e-9)
    np.testing.assert_allclose(flights.impacts.x[:, 0], np.where(np.arange(impacts) % 2 == 0, gap, 0.0), atol=1e-12)


@BOTH
@MODELS
@pytest.mark.parametrize("sides", [3, 6])
def test_a_rock_dropped_into_a_needle_pit_stays_in_it(engine, sides, model):
    """The pit has a radius of 1 cm and a depth of 10 m: its walls have 89.9 degrees and meet in one vertex."""
    over = engine_over(engine, cone(sides, radius=0.01, height=10.0))
    draw = np.random.default_rng(sides)
    x = np.concatenate([draw.uniform(-0.003, 0.003, (10, 2)), np.full((10, 1), 9.9)], 1)
    x[0, :2] = 0.0
    flights = fly(over, flight(surface(0.5, 0.8, 30.0), model), x)
    assert outcomes(flights) <= {Outcome.STOPPED, *([Outcome.UNRESOLVED_CONTACT] if model == "none" else [])}
    points = along_flights(flights)
    assert (points @ np.asarray(over.facets.normals).T).min() > -NEAR
    assert loses_energy(flights) and lies_on(over, flights)


@BOTH
@pytest.mark.parametrize("along", [0.0, 9.0])
@pytest.mark.parametrize("slope", [1e-5, 2e-5, 1e-4])
def test_a_slight_ridge_takes_no_speed_from_a_rock_that_slides_over_it(engine, slope, along):
    """The ridge rises about 1 mm in 100 m, as rounding leaves on a level bench; its flanks must not hold the rock."""
    corners = [(x, y, -slope * abs(x)) for x in (-500.0, 0.0, 500.0) for y in (-500.0, 500.0)]
    ridge = terrain_of(corners, [(0, 2, 3), (0, 3, 1), (2, 4, 5), (2, 5, 3)])
    slides = flight(surface(0.3, 0.9, 0.0, 0.0), max_time=20.0)
    flights = fly(engine_over(engine, ridge), slides, (-10.0, -50.0, -10.0 * slope), (3.0, along, 3.0 * slope))
    assert flights.deposits.x[0] == pytest.approx((50.0, -50.0 + 20.0 * along, -50.0 * slope), abs=0.1)
    np.testing.assert_allclose(flights.paths.v[:, 0], 3.0, atol=0.02)


def folded(opening: float, speed: float, R_n: float) -> float:
    """Return the speed (m/s) at which a rock leaves a wedge, computed by reflections in the cross-section.

    opening : angle (degrees) between the walls; speed : speed (m/s) at which the rock slides down one wall; R_t is 1
    """
    wall = complex(math.cos(math.radians(opening)), math.sin(math.radians(opening)))
    across = [complex(0.0, -1.0) * wall, complex(0.0, 1.0)]  # inward normals: wall met first, other wall
    v, turn = complex(-speed, 0.0), 0
    while (into := (v * across[turn % 2].conjugate()).real) < 0.0:
        v -= (1.0 + R_n) * into * across[turn % 2]
        turn += 1
    return abs(v)


@BOTH
@pytest.mark.parametrize("R_n", [0.7, 0.99])
@pytest.mark.parametrize("opening", [20.0, 35.0, 44.0, 60.0, 80.0])
def test_a_rock_that_slides_into_a_sharp_gully_bounces_out_of_it_again(engine, opening, R_n):
    """Without friction, the rock slides 4 m down one wall of a symmetric gully and meets the other wall."""
    steep = 90.0 - 0.5 * opening
    height = 4.0 * math.sin(math.radians(steep))
    start = (5.0, 4.0 * math.cos(math.radians(steep)), height)
    over = engine_over(engine, gully(steep, steep, 0.0))
    flights = fly(over, flight(surface(R_n, 1.0, 0.0), max_impacts=40), start)
    first = np.flatnonzero(flights.impacts.t > flights.impacts.t[0] + 1e-9)[:1]
    bounced = flights.impacts.speed_out[: first[0] if len(first) else None]
    assert flights.impacts.speed_in[0] == pytest.approx(math.sqrt(2.0 * G * height), rel=1e-9)
    assert bounced[-1] == pytest.approx(folded(opening, math.sqrt(2.0 * G * height), R_n), rel=1e-9)
    assert lies_on(over, flights) and loses_energy(flights)


@BOTH
@pytest.mark.parametrize("opening", [10.0, 20.0])
@pytest.mark.parametrize("R_n", [0.01, 0.1])
def test_a_rock_passes_the_kinks_of_a_sharp_gully_although_it_bounces_there_a_hundred_times(engine, opening, R_n):
    """At a kink of the gully's line, all bounces happen in one place; a rock must not end there in motion."""
    dips, rise = [25.0, 12.0, 30.0, 18.0, 35.0, 8.0, 30.0], 1.0 / math.tan(math.radians(0.5 * opening))
    z = -np.cumsum([0.0, *(2.0 * math.tan(math.radians(dip)) for dip in dips)])
    aside = 0.2 * np.array([0.0, 1.0, -0.5, 0.3, -1.0, 0.8, 0.0, -0.4])
    vertices = [(2.0 * k, aside[k] + y, z[k] + rise * abs(y)) for k in range(8) for y in (-2.0, 0.0, 2.0)]
    over = engine_over(engine, terrain_of(vertices, grid_triangles(8, 3)))
    draw = np.random.default_rng(5)
    x = np.stack([draw.uniform(1.0, 6.0, 40), draw.uniform(-0.5, 0.5, 40), np.full(40, 4.0 + 0.7 * rise)], 1)
    flights = fly(over, flight(Surface(R_n, 0.8, 0.1, 0.5), rebound="coulomb_limited"), x)
    assert outcomes(flights) <= {Outcome.STOPPED, Outcome.LEFT_TERRAIN}
    _, first = np.unique(flights.impacts.row, return_index=True)
    assert max(np.diff([*first, len(flights.impacts.row)])) > 64, "bounces that would have counted as no progress"
    assert lies_on(over, flights) and loses_energy(flights)


@BOTH
@pytest.mark.parametrize("angle", [27.0, 45.0])
@pytest.mark.parametrize("cell", [1.0, 2.0, 3.7])
def test_a_rock_that_moves_along_an_edge_within_a_plane_slides_as_on_one_facet(engine, cell, angle):
    """Rocks start exactly on edges of a grid, with velocities exactly along these edges."""
    slope = math.tan(math.radians(angle))
    grid, alone = (rough_grid(cells, 20.0 * cell, slope, 0.0) for cells in (20, 1))
    near = np.abs(grid.vertices[grid.triangles].mean(axis=1)[:, :2] - (10.0 * cell, 8.0 * cell)).max(axis=1) < cell
    corners = grid.vertices[grid.triangles[near]]
    edges = (np.roll(corners, -1, axis=1) - corners).reshape(-1, 3)
    start = corners.reshape(-1, 3) + np.random.default_rng(1).uniform(0.2, 0.8, (len(edges), 1)) * edges
    along = edges / np.linalg.norm(edges, axis=1)[:, None]
    x, v = (
        np.repeat(start, 4, axis=0),
        np.repeat(along, 4, axis=0) * np.tile([0.5, 3.0, -0.5, -3.0], len(edges))[:, None],
    )
    ends = [
        fly(engine_over(engine, terrain), flight(surface(friction_angle=15.0)), x, v).deposits
        for terrain in (grid, alone)
    ]
    assert set(ends[0].outcome.tolist()) == {Outcome.LEFT_TERRAIN}
    np.testing.assert_allclose(ends[0].x, ends[1].x, atol=1e-6)
    np.testing.assert_allclose(ends[0].t, ends[1].t, rtol=1e-9)


@BOTH
@pytest.mark.parametrize("R_n", [0.0, 0.05])
@pytest.mark.parametrize(("fall", "lean", "dip"), [(7.0, 5.0, 15.0), (7.0, 40.0, 25.0), (25.0, 20.0, 15.0)])
def test_a_rock_that_slides_squarely_into_the_foot_of_an_overhang_slides_on_along_the_foot(
    engine, fall, lean, dip, R_n
):
    """The floor slopes towards the face; the foot slopes by `dip` degrees. The ground has no friction."""
    down, side = math.tan(math.radians(dip)), math.tan(math.radians(fall))
    top = -8.0 * math.sin(math.radians(lean)), 8.0 * math.cos(math.radians(lean))
    vertices = [
        (x, y, z - y * down) for y in np.linspace(-40.0, 40.0, 9) for x, z in ((-20.0, 20.0 * side), (0.0, 0.0), top)
    ]
    over = engine_over(engine, terrain_of(vertices, grid_triangles(9, 3)[:, ::-1]))
    y = np.array([-30.0, -30.0, -27.3, 10.0])  # at vertices of the foot and between them
    gap = np.array([1e-6, 1e-2, 1e-6, 1e-6])
    foot = np.array([0.0, 1.0, -down]) / math.hypot(1.0, down)
    squarely = np.array([1.0, 0.0, -side]) - foot * (down * side / math.hypot(1.0, down))
    x = np.column_stack([-gap, y, gap * side - y * down])
    flights = fly(over, flight(surface(R_n, 0.7, 0.0, 0.0)), x, 5.0 * squarely / np.linalg.norm(squarely))
    assert outcomes(flights) == {Outcome.LEFT_TERRAIN}
    np.testing.assert_allclose(flights.deposits.x[:, 1], 40.0, atol=1e-3)


@BOTH
@pytest.mark.parametrize("seed", [50, 80])
def test_copies_of_facets_do_not_stop_a_rock_that_slides_along_an_edge_within_a_plane(engine, seed):
    """A fifth of the facets are there twice; without the copies, no friction holds the rocks that once stopped."""
    draw = np.random.default_rng(seed)
    grid = rough_grid(10, 10.0, math.tan(math.radians(34.0)), 0.0)
    grid.vertices[:, 2] += np.where(draw.uniform(size=121) < 0.1, draw.uniform(0.0, 1.0, 121), 0.0)
    count = len(grid.triangles)
    again = np.concatenate([grid.triangles, grid.triangles[draw.choice(count, count // 5, replace=False)]])
    copied = terrain_of(grid.vertices, again[draw.permutation(len(again))])
    x, physics = grid.vertices[draw.choice(121, 60)], flight(surface(0.3, 0.8, 30.0, 0.1))
    once, twice = (fly(engine_over(engine, terrain), physics, x).deposits for terrain in (grid, copied))
    assert not np.any((twice.outcome == Outcome.STOPPED) & (once.outcome != Outcome.STOPPED))
