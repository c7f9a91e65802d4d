"""Tests that the seams of a rounded T-junction are closed, and that everything else of a mesh stays as it is."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from flights.models_by_name import models_called
from flights.scenes_of_facets import ENGINES, engine_over, joined, released, rough_grid, terrain_of, without_facets
from meshes.random_ground import Case, fallen, in_the_air
from meshes.rounded_seams import (
    areas_in_plan,
    directed_twice,
    free_sides_inside,
    rough_ground,
    rounded,
    sides_of,
    with_t_junctions,
)

from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.materials.library import Surface, materials_of
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.closed_seams import ClosedTerrain, with_closed_seams
from rpf3d_core.terrain.facets import Terrain, tolerance_of
from rpf3d_core.terrain.mesh.close_seams import WIDEST_CLOSED
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.values import Outcome

UTM = (500_000.0, 7_000_000.0, 900.0)


def closed(terrain: Terrain) -> ClosedTerrain:
    return with_closed_seams(terrain, edges_of(terrain.triangles, len(terrain.vertices)))


def seamed(seed: int, size: float, decimals: int, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Terrain:
    """Return rough ground with rounded T-junctions; size : m, of its sides; origin : m."""
    draw = np.random.default_rng([seed, decimals])
    return rounded(with_t_junctions(draw, rough_ground(draw, size)), decimals, origin)


def outline(size: float) -> np.ndarray:
    return np.array([[0.0, 0.0], [size, size]])


def t_junction(*places: tuple[float, float, float], side: float = 10.0) -> Terrain:
    """Return a facet with a side along y, and the facets of the neighbour, whose rim runs through some places (m)."""
    corners = [(0, 0, 0), (0, side, 0), (-side, 0, 0), (side, side / 2, 0), *places]
    chain = [0, *range(4, 4 + len(places)), 1]
    return terrain_of(corners, [(0, 1, 2), *((a, 3, b) for a, b in pairwise(chain))])


# --- what is closed ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), UTM])
@pytest.mark.parametrize("size", [8.0, 1100.0])
@pytest.mark.parametrize("seed", [0, 1, 2, 4, 5, 6, 7, 8, 9])  # in seed 3, some vertices lie exactly on a side
def test_every_seam_of_a_mesh_in_millimetres_is_closed(seed, size, origin):
    terrain = seamed(seed, size, 3, origin)
    found = closed(terrain)
    assert free_sides_inside(terrain, outline(size)) > 100
    assert free_sides_inside(found.terrain, outline(size)) == 0
    assert max(sides_of(found.terrain.triangles).values()) == 2
    assert directed_twice(found.terrain) == 0
    assert not len(found.seams.vertex)
    assert found.seams.closed > 50 and found.seams.widest < 0.002


@pytest.mark.parametrize("seed", range(10))
def test_nearly_every_seam_of_a_mesh_in_centimetres_is_closed(seed):
    terrain = seamed(seed, 100.0, 2, UTM)
    found = closed(terrain)
    assert free_sides_inside(found.terrain, outline(100.0)) < 0.03 * free_sides_inside(terrain, outline(100.0))
    assert max(sides_of(found.terrain.triangles).values()) == 2
    assert 0.002 < found.seams.widest < WIDEST_CLOSED


@pytest.mark.parametrize("seed", range(10))
def test_numbers_zones_areas_and_normals_stay(seed):
    terrain = seamed(seed, 8.0, 3)
    found = closed(terrain)
    count, parent = len(terrain.triangles), found.parent
    made = found.terrain
    assert made.vertices is terrain.vertices and made.zones == terrain.zones
    assert np.array_equal(made.zone, np.concatenate([terrain.zone, terrain.zone[parent]]))
    before, after = areas_in_plan(terrain), areas_in_plan(made)
    assert (after[np.concatenate([before, before[parent]]) > 0.0] > 0.0).all()
    summed = after[:count] + np.bincount(parent, after[count:], count)
    assert np.abs(summed - before).max() < 0.01  # a side of 2 m moves by 2 mm
    whole = np.setdiff1d(np.arange(count), parent)
    assert np.array_equal(made.triangles[whole], terrain.triangles[whole])
    assert (made.triangles[:count] == terrain.triangles).any(axis=1).all()


def test_a_side_runs_through_several_vertices_in_order():
    terrain = t_junction((-0.001, 2, 0), (0, 5, 0.001), (0.001, 7, 0))
    scrambled = replace(terrain, triangles=terrain.triangles[[0, 3, 1, 4, 2]])
    found = closed(scrambled)
    chain = {frozenset(pair) for pair in ((0, 4), (4, 5), (5, 6), (6, 1))}
    at_seam = {frozenset(side) for side, uses in sides_of(found.terrain.triangles).items() if uses == 2}
    assert chain <= at_seam
    assert found.terrain.triangles.tolist()[0] == [0, 4, 2]
    assert (found.seams.closed, found.parent.tolist()) == (3, [0, 0, 0])
    assert found.seams.widest == pytest.approx(0.001)


def test_a_facet_is_cut_at_all_three_sides():
    corners = [(0, 0, 0), (10, 0, 0), (0, 10, 0)]
    outer = [(5, -9, 0), (9, 9, 0), (-9, 5, 0)]
    middle = [(3, -0.001, 0), (7, 0.001, 0), (7, 3.001, 0), (2, 8, 0.001), (0, 8, -0.001), (0.001, 4, 0)]
    facets = [(0, 1, 2)]
    for k, begin in enumerate((0, 1, 2)):
        chain = [begin, 6 + 2 * k, 7 + 2 * k, (begin + 1) % 3]
        facets += [(b, a, 3 + k) for a, b in pairwise(chain)]
    found = closed(terrain_of([*corners, *outer, *middle], facets))
    assert found.seams.closed == 6 and found.parent.tolist() == [0] * 6
    assert (areas_in_plan(found.terrain) > 0.0).all()
    free = {side for side, uses in sides_of(found.terrain.triangles).items() if uses == 1}
    assert free == {(0, 3), (1, 3), (1, 4), (2, 4), (2, 5), (0, 5)}


def test_both_sides_of_a_seam_may_have_vertices_of_their_own():
    corners = [
        (0, 0, 0),
        (0, 10, 0),
        (-9, 5, 0),
        (9, 5, 0),
        (0.001, 3, 0),
        (0, 6, 0.001),
        (-0.001, 4, 0),
        (0, 8, -0.001),
    ]
    left, right = [0, 4, 5, 1], [0, 6, 7, 1]
    facets = [(a, b, 2) for a, b in pairwise(left)]
    facets += [(b, a, 3) for a, b in pairwise(right)]
    found = closed(terrain_of(corners, facets))
    assert found.seams.closed == 4
    uses = sides_of(found.terrain.triangles)
    assert [uses[side] for side in ((0, 4), (4, 6), (5, 6), (5, 7), (1, 7))] == [2] * 5


def test_a_vertex_near_two_sides_is_used_once_in_a_facet():
    sharp = terrain_of(
        [(0, 0, 0), (10, 0.2, 0), (10, -0.2, 0), (0.3, 0.0061, 0.001), (5, 8, 0)],
        [(0, 2, 1), (0, 3, 4), (3, 1, 4)],
    )
    found = closed(sharp)
    a, b, c = found.terrain.triangles.T
    assert ((a != b) & (b != c) & (c != a)).all()
    assert max(sides_of(found.terrain.triangles).values()) == 2 and directed_twice(found.terrain) == 0


def test_a_seam_at_the_foot_of_an_upright_wall_is_closed():
    wall = terrain_of(
        [(0, 0, 0), (0, 10, 0), (9, 5, 0), (0, 0, 8), (0, 10, 8), (0.001, 4, 0)],
        [(0, 2, 1), (3, 0, 5), (3, 5, 4), (5, 1, 4)],
    )
    found = closed(wall)
    assert found.seams.closed == 1
    assert free_sides_inside(found.terrain, np.array([[0.0, 0.0], [9.0, 10.0]]), 5.1) == 0


# --- what stays -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.021, 0.04, 0.06])
def test_a_slit_wider_than_the_limit_stays(gap):
    terrain = t_junction((gap, 5, 0))
    found = closed(terrain)
    assert found.terrain is terrain and found.seams.closed == 0
    assert len(found.seams.vertex) == (gap < 0.05)


def test_a_short_side_keeps_a_gap_of_some_percent():
    terrain = t_junction((0.006, 0.05, 0), side=0.1)
    assert closed(terrain).terrain is terrain


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_a_vertex_within_a_crack_stays_a_t_junction(share):
    crack = 64.0 * tolerance_of(t_junction((0, 5, 0)))
    terrain = t_junction((share * crack, 5, 0))
    assert closed(terrain).terrain is terrain


def test_an_exact_vertex_on_a_side_that_is_cut_is_used_too():
    found = closed(t_junction((0.0, 3, 0), (0.001, 7, 0)))
    assert found.seams.closed == 1 and len(found.parent) == 2
    assert [sides_of(found.terrain.triangles)[side] for side in ((0, 4), (4, 5), (1, 5))] == [2, 2, 2]


def test_holes_and_the_rim_stay():
    ground = without_facets(rough_grid(8, 80.0, 0.4, 1.0), 20, 21, 60)
    assert closed(ground).terrain is ground


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.01), (0.003, 0.0, -0.003), (0.0, 0.004, 0.0)])
def test_a_second_survey_of_the_same_ground_is_not_joined(offset):
    ground = rough_grid(4, 20.0, 0.4, 0.5)
    other = rough_grid(4, 20.0, 0.4, 0.5)
    both = joined(ground, replace(other, vertices=other.vertices + np.array(offset)))
    assert closed(both).terrain is both


@pytest.mark.parametrize("step", [0.002, 0.01, -0.015])
def test_a_step_between_two_surfaces_stays_open(step):
    """On a slope, the vertices of each surface lie near the sides of the other one, but no side fits another one."""
    ground = rough_grid(4, 20.0, 0.0, 2.0)
    left = ground.vertices[ground.triangles].mean(axis=1)[:, 0] < 10.0
    upper = without_facets(ground, *np.flatnonzero(left))
    raised = replace(upper, vertices=upper.vertices + np.array([0.0, 0.0, step]))
    both = joined(without_facets(ground, *np.flatnonzero(~left)), raised)
    assert closed(both).terrain is both


def test_a_strip_whose_whole_rim_lies_inside_a_side_is_joined():
    corners = [(0, 0, 0), (0, 30, 0), (-9, 15, 0), (0.001, 8, 0), (0, 12, 0.001), (-0.001, 16, 0), (9, 12, 0)]
    found = closed(terrain_of(corners, [(0, 1, 2), (3, 6, 4), (4, 6, 5)]))
    assert found.seams.closed == 3
    uses = sides_of(found.terrain.triangles)
    assert (uses[3, 4], uses[4, 5]) == (2, 2)


def test_surfaces_that_cross_are_not_joined():
    level = rough_grid(4, 20.0, 0.0, 0.0)
    steep = rough_grid(6, 30.0, 0.8, 0.0)
    both = joined(level, replace(steep, vertices=steep.vertices + np.array([-3.0, -5.0, 4.0])))
    assert closed(both).terrain is both


def test_a_vertex_far_above_a_side_is_not_near_it():
    terrain = t_junction((0.001, 5, 3.0))
    assert closed(terrain).terrain is terrain


def test_a_part_that_would_face_down_is_not_made():
    """The vertex lies 1 mm beyond the other side of a needle at its tip."""
    needle = terrain_of(
        [(0, 0, 0), (10, 0, 0), (10, 0.01, 0), (0.5, 0.0015, 0.0), (5, -8, 0)],
        [(0, 1, 2), (0, 4, 3), (3, 4, 1)],
    )
    found = closed(needle)
    assert (areas_in_plan(found.terrain) > -1e-12).all()
    assert found.seams.closed == 0


# --- rocks ------------------------------------------------------------------------------------------------------------


def rocks_on_seams(seed: int, terrain: Terrain, rocks: int) -> Case:
    """Return a case with rocks that are dropped on the free sides of a terrain, or start there at rest."""
    draw = np.random.default_rng(seed)
    free = np.array([side for side, uses in sides_of(terrain.triangles).items() if uses == 1])
    ends = terrain.vertices[free[draw.integers(0, len(free), rocks)]]
    share = draw.choice([0.0, 1.0, 0.3, 0.7], rocks)[:, None]
    x = (1.0 - share) * ends[:, 0] + share * ends[:, 1] + draw.normal(0.0, 0.001, (rocks, 3))
    x[:, 2] += 0.01 + draw.choice([0.0, 0.5, 3.0], rocks)
    surface = Surface(float(draw.uniform(0.0, 0.9)), 0.8, float(draw.choice([0.1, 0.6])), 0.2, 0.0)
    flight = Flight(
        materials_of([surface]), Settings(max_impacts=400, max_time=20.0), models_called("constant", "sliding")
    )
    return Case("rough", seed, terrain, x, np.zeros((rocks, 3)), flight, "sliding", f"seams, seed {seed}")


def lost(case: Case, size: float) -> int:
    """Return the number of rocks that end where no rock can: off the terrain, but over its plan, or without contact.

    size : m, of the sides of the square terrain
    """
    flights = fly_ensemble(engine_over("compiled", case.terrain), case.flight, released(case.x, case.v), threads=1)
    ends, outcome = flights.deposits.x[:, :2], flights.deposits.outcome
    inside = ((ends > 0.02) & (ends < size - 0.02)).all(axis=1)
    gone = inside & (outcome == Outcome.LEFT_TERRAIN)
    stuck = (outcome == Outcome.UNRESOLVED_CONTACT) | (outcome == Outcome.FELL_THROUGH)
    below = np.zeros(len(gone), bool)
    below[fallen(case, flights)], below[in_the_air(case, flights)] = True, True
    return int((gone | stuck | below).sum())


@pytest.mark.parametrize("seed", range(4))
def test_no_rock_falls_through_a_closed_seam(seed):
    terrain = seamed(seed, 8.0, 3)
    case = rocks_on_seams(seed, terrain, 200)
    assert lost(case, 8.0) > 10
    assert lost(replace(case, terrain=closed(terrain).terrain), 8.0) == 0


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_lands_in_a_seam_of_a_level_floor(engine):
    """The slit is 1 mm wide, and the rock falls straight into it; without closing, it leaves the terrain."""
    terrain = t_junction((0.001, 5, 0))
    flight = replace(rocks_on_seams(0, terrain, 1).flight, materials=materials_of([Surface(0.4, 0.8, 0.6, 0.5, 0.0)]))
    rock = released(np.array([[0.0004, 5.0, 1.0]]), np.zeros((1, 3)))
    ends = [
        fly_ensemble(engine_over(engine, each), flight, rock).deposits for each in (terrain, closed(terrain).terrain)
    ]
    assert [Outcome(each.outcome[0]) for each in ends] == [Outcome.LEFT_TERRAIN, Outcome.STOPPED]
    assert abs(ends[1].x[0, 2]) < 1e-6
