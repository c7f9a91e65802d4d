"""Properties of every flight over random terrains, sources and coefficients (Hypothesis, always the same draws)."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from flights.any_rock import ANY_ROCK
from flights.scenes_of_facets import (
    ENGINES,
    engine_over,
    flight,
    fly,
    rough_grid,
    same_bits,
    specific_energy,
    terrain_of,
    turned,
)
from hypothesis import example, given
from hypothesis import strategies as st
from suite.property_budget import examples

from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import given_columns
from rpf3d_core.kinetics.rebound import ConstantRestitution, rebound
from rpf3d_core.materials.library import Surface
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.values import ZERO, Mode, Motion, Outcome

SIZE, CELLS, ROCKS = 16.0, 8, 6
BELOW = 1e-7
"""Largest depth (m) below the ground, due to the contact tolerance and to rounding of points on arcs."""
RISE = 1e-9
"""Largest growth of the energy over the largest energy of a flight: rounding of some hundred events."""
INTO = 1e-14
"""Largest normal velocity into the ground after an impact, over the speed before it: rounding of the velocity.

The speed after the impact is no measure, because it may be much smaller than the rounded numbers.
"""
FEW = 4
"""Number of events for which two differently rounded flights are compared.

On rough ground each event multiplies a difference by about ten, so 1e-14 m stays below 1e-6 m.
"""
SAME_PLACE = 1e-6

modest = examples(25)
shares = st.one_of(st.sampled_from([0.0, 1.0, 0.5]), st.floats(0.0, 1.0))


class Case(NamedTuple):
    """The numbers from which a scene is built, which a failure prints."""

    slope: float
    amplitude: float
    terrain_seed: int
    R_n: float
    R_t: float
    mu: float
    stop_speed: float
    model: str
    rocks_seed: int
    on_vertices: bool
    drop: float
    speed: float


def cases(lossy: bool = True) -> st.SearchStrategy[Case]:
    """Return a strategy for cases with all kinds of ground and coefficients. lossy : normal restitution below 1"""
    return st.builds(
        Case,
        st.sampled_from([0.0, 0.3, 1.0, 2.5]),
        st.sampled_from([0.0, 1e-9, 1e-3, 0.05, 0.5, 2.0]),
        st.integers(0, 10**6),
        shares.map(lambda share: min(share, 0.95)) if lossy else shares,
        shares,
        st.sampled_from([0.0, 0.2, 0.577, 1.5]),
        st.sampled_from([0.0, 0.05, 0.5]),
        st.sampled_from(["none", "sliding"]),
        st.integers(0, 10**6),
        st.booleans(),
        st.sampled_from([1e-3, 4.0]),
        st.sampled_from([0.0, 1.0, 8.0]),
    )


ALONG_AN_EDGE = Case(2.5, 1e-9, 41358, 0.171145737, 0.5, 0.577, 0.0, "sliding", 506, True, 0.001, 0.0)
"""Case in which a rock slides along an edge of almost coplanar facets, over a vertex; it once fell through both."""
AT_REST_ON_AN_EDGE = Case(2.5, 1e-9, 175399, 0.0, 0.199706179, 0.577, 0.05, "sliding", 175399, True, 4.0, 0.0)
"""Case in which a rock stops on an edge that does not hold it; it once fell through both facets."""
ALONG_AN_EDGE_OF_A_PLANE = Case(1.0, 0.0, 47497, 0.0, 0.0, 0.0, 0.05, "sliding", 378, True, 4.0, 0.0)
"""Case in which a rock slides along edges of coplanar facets; the path once depended on the facet numbers."""
AT_A_CORNER_OF_A_PLANE = Case(1.0, 0.0, 47497, 0.3400190781409787, 0.5, 0.0, 0.05, "sliding", 111730, True, 4.0, 0.0)
"""Case in which a rock reaches a vertex of coplanar facets; its last facet once depended on the facet numbers."""
SLOW_ALONG_THE_GROUND = Case(
    0.3, 2.0, 65567, 1.0, 6.103515625e-05, 0.577, 0.0, "none", 324, True, 0.001, 1.0
)  # fmt: skip
"""Case in which a rock keeps 6e-5 of its speed along the ground, which is as small as other rounding errors."""
OVER_A_RIM_VERTEX = Case(2.5, 0.5, 331735, 0.0, 0.0, 0.0, 0.05, "sliding", 205, True, 0.001, 0.0)
"""Case in which a rock loses all speed exactly on the border of the terrain, on a slope without friction."""


def remembered(test: Callable[..., None]) -> Callable[..., None]:
    """Return the test with the cases that once failed as additional examples."""
    for case in (ALONG_AN_EDGE, AT_REST_ON_AN_EDGE):
        test = example(case=case)(test)
    return test


def built(case: Case) -> tuple[Terrain, Flight, np.ndarray, np.ndarray]:
    """Return the terrain, physics, positions (R, 3) m and velocities (R, 3) m/s of a case."""
    terrain = rough_grid(CELLS, SIZE, case.slope, case.amplitude, seed=case.terrain_seed)
    ground = Surface(case.R_n, case.R_t, case.mu, case.stop_speed)
    random = np.random.default_rng(case.rocks_seed)
    x = random.uniform(1.0, SIZE - 1.0, (ROCKS, 3))
    if case.on_vertices:
        x[: ROCKS // 2, :2] = 2.0 * np.round(0.5 * x[: ROCKS // 2, :2])  # exactly over vertices
        x[0, 0] += 0.5  # over an edge
    x[:, 2] = height(terrain, x) + random.uniform(0.0, case.drop, ROCKS)
    return (
        terrain,
        flight(ground, case.model, max_impacts=400, max_time=200.0),
        x,
        case.speed * random.normal(size=(ROCKS, 3)),
    )


def height(terrain: Terrain, x: np.ndarray) -> np.ndarray:
    """Return the height (N,) m of the grid below points (N, 3), computed without the engines; -inf outside."""
    z = terrain.vertices[:, 2].reshape(CELLS + 1, CELLS + 1)
    plan = x[:, :2] / (SIZE / CELLS)
    i = np.clip(np.floor(plan).astype(int), 0, CELLS - 1)
    s, t = (plan - i).T
    a, b, c, d = (z[i[:, 0] + p, i[:, 1] + q] for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
    found = np.where(s >= t, a + s * (b - a) + t * (c - b), a + t * (d - a) + s * (c - d))
    return np.where((x[:, :2] >= 0).all(1) & (x[:, :2] <= SIZE).all(1), found, -np.inf)


def along_paths(flights, samples=7):
    """Return points (N, 3) m along all flights, including all events. samples : points per arc"""
    p = flights.paths
    going = np.flatnonzero(p.mode[:-1] == Mode.FLIGHT)
    share = np.linspace(0.0, 1.0, samples)[:, None, None]
    t = share * (p.t[going + 1] - p.t[going])[:, None]
    arcs = p.x[going] + p.v[going] * t - 0.5 * t * t * np.array([0, 0, 9.81])
    return np.concatenate([p.x, arcs.reshape(-1, 3)])


@pytest.mark.parametrize("engine", ENGINES)
@modest
@given(case=cases(lossy=False))
def test_every_rock_ends_with_an_outcome_at_a_place_and_a_time(engine, case):
    terrain, physics, x, v = built(case)
    flights = fly(engine_over(engine, terrain), physics, x, v)
    d = flights.deposits
    assert set(d.outcome) <= set(Outcome)
    assert all(np.isfinite(a).all() for a in (d.x, d.t, d.path, d.max_speed, *given_columns(flights.impacts).values()))
    assert all(np.isfinite(a).all() for a in given_columns(flights.paths).values())
    assert np.all(np.diff(flights.paths.t)[np.diff(flights.paths.row) == 0] >= 0.0)
    assert np.all(d.path >= np.linalg.norm(d.x - x, axis=1) * (1 - 1e-9) - 1e-9)


@pytest.mark.parametrize("engine", ENGINES)
@modest
@remembered
@given(case=cases(lossy=False))
def test_no_rock_is_ever_below_the_ground(engine, case):
    terrain, physics, x, v = built(case)
    flights = fly(engine_over(engine, terrain), physics, x, v)
    points = along_paths(flights)
    assert np.all(points[:, 2] >= height(terrain, points) - BELOW)


@pytest.mark.parametrize("engine", ENGINES)
@modest
@remembered
@given(case=cases(lossy=False))
def test_a_rock_leaves_the_terrain_only_over_its_edge(engine, case):
    terrain, physics, x, v = built(case)
    d = fly(engine_over(engine, terrain), physics, x, v).deposits
    ends = d.x[d.outcome == Outcome.LEFT_TERRAIN]
    inside = ((ends[:, :2] > 1e-6) & (ends[:, :2] < SIZE - 1e-6)).all(1)
    assert not inside.any()


@pytest.mark.parametrize("engine", ENGINES)
@modest
@remembered
@given(case=cases())
def test_a_rock_that_stopped_lies_on_the_ground(engine, case):
    terrain, physics, x, v = built(case)
    d = fly(engine_over(engine, terrain), physics, x, v).deposits
    stopped = d.x[d.outcome == Outcome.STOPPED]
    np.testing.assert_allclose(stopped[:, 2], height(terrain, stopped), atol=BELOW)
    assert np.all(d.ground_speed[d.outcome == Outcome.STOPPED] >= 0.0)


@pytest.mark.parametrize("engine", ENGINES)
@modest
@remembered
@given(case=cases(lossy=False))
def test_energy_never_rises_on_the_way(engine, case):
    terrain, physics, x, v = built(case)
    flights = fly(engine_over(engine, terrain), physics, x, v)
    after, end = specific_energy(flights)
    same = np.diff(flights.paths.row) == 0
    room = RISE * np.abs(after).max() + 1e-9
    assert np.all((end[:-1] - after[:-1])[same] <= room)
    assert np.all((after[1:] - end[:-1])[same] <= room)


@pytest.mark.parametrize("engine", ENGINES)
@modest
@example(case=SLOW_ALONG_THE_GROUND)
@given(case=cases(lossy=False))
def test_no_impact_makes_a_rock_faster_or_sends_it_into_the_ground(engine, case):
    terrain, physics, x, v = built(case)
    flights = fly(engine_over(engine, terrain), physics, x, v)
    hit, paths = flights.impacts, flights.paths
    assert np.all(hit.speed_out <= hit.speed_in * (1 + 1e-12))
    np.testing.assert_allclose(np.linalg.norm(hit.normal, axis=1), 1.0, rtol=1e-12)
    for row, t, at, n, speed_in in zip(hit.row, hit.t, hit.x, hit.normal, hit.speed_in, strict=True):
        begins = np.flatnonzero((paths.row == row) & (paths.t == t) & (np.abs(paths.x - at) <= BELOW).all(1))
        assert (paths.v[begins] @ n).max() >= -INTO * speed_in


@examples(300)
@given(
    n=st.tuples(*3 * [st.floats(-1, 1)]).filter(lambda n: math.hypot(*n) > 1e-3),
    v=st.tuples(*3 * [st.floats(-1e3, 1e3)]),
    R_n=shares,
    R_t=shares,
)
def test_a_rebound_takes_energy_and_points_away_from_the_ground(n, v, R_n, R_t):
    n = np.array(n) / math.hypot(*n)
    if v @ n > 0:
        n = -n
    n = tuple(map(float, n))
    after = rebound(ConstantRestitution(), Surface(R_n, R_t, 0.5, 0.5), Motion(0.0, ZERO, v, ZERO), n, ANY_ROCK).v
    assert np.dot(after, n) >= -1e-15 * math.hypot(*v) * 4
    assert math.hypot(*after) <= math.hypot(*v) * (1 + 1e-15 * 4)


@examples(40)
@remembered
@given(case=cases(lossy=False))
def test_both_engines_give_the_same_bits(case):
    terrain, physics, x, v = built(case)
    assert same_bits(*(fly(engine_over(name, terrain), physics, x, v) for name in ENGINES))


@pytest.mark.parametrize("engine", ENGINES)
@modest
@example(case=AT_A_CORNER_OF_A_PLANE, seed=378)
@example(case=ALONG_AN_EDGE_OF_A_PLANE, seed=378)
@given(case=cases(), seed=st.integers(0, 10**6))
def test_the_order_of_the_facets_decides_nothing(engine, case, seed):
    terrain, physics, x, v = built(case)
    order = np.random.default_rng(seed).permutation(len(terrain.triangles))
    shuffled = terrain_of(terrain.vertices, terrain.triangles[order])
    one, other = (fly(engine_over(engine, t), physics, x, v).deposits for t in (terrain, shuffled))
    np.testing.assert_array_equal(one.x, other.x)
    np.testing.assert_array_equal(one.t, other.t)
    np.testing.assert_array_equal(one.outcome, other.outcome)
    hit = one.facet >= 0
    np.testing.assert_array_equal(other.facet >= 0, hit)
    normals, facet = facets_of(terrain).normals, order[other.facet[hit]]
    np.testing.assert_array_equal(normals[one.facet[hit]], normals[facet])
    twins = facet != one.facet[hit]  # the rock fell onto the edge between two coplanar facets
    assert all(touches(terrain, f, x) for f, x in zip(facet[twins], one.x[hit][twins], strict=True))


def touches(terrain: Terrain, f: int, x: np.ndarray) -> bool:
    """Return whether x (3,) m lies on facet f or its edges."""
    a, b, c = terrain.vertices[terrain.triangles[f]]
    shares = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), x - a, rcond=None)[0]
    on = np.linalg.norm(a + shares @ np.stack([b - a, c - a]) - x) <= BELOW
    return bool(on and min(*shares, 1.0 - shares.sum()) >= -BELOW)


@pytest.mark.parametrize("engine", ENGINES)
@modest
@given(case=cases())
def test_how_many_rocks_fly_together_decides_nothing(engine, case):
    terrain, physics, x, v = built(case)
    over = engine_over(engine, terrain)
    together = fly(over, physics, x, v).deposits
    for i in (0, ROCKS - 1):
        np.testing.assert_array_equal(fly(over, physics, x[i], v[i]).deposits.x[0], together.x[i])


def compared(engine, case, moved_vertices, moved_x, moved_v, back):
    """Fly a scene and its image for FEW events: the rocks must be in the same places after the way back."""
    terrain, physics, x, v = built(case)
    physics = type(physics)(physics.materials, physics.settings._replace(max_impacts=FEW), physics.models)
    image = terrain_of(moved_vertices, terrain.triangles)
    one = fly(engine_over(engine, terrain), physics, x, v)
    other = fly(engine_over(engine, image), physics, moved_x, moved_v)
    np.testing.assert_array_equal(one.deposits.outcome, other.deposits.outcome)
    stay = one.deposits.outcome != Outcome.LEFT_TERRAIN  # they end at the box around the terrain, which does not turn
    np.testing.assert_allclose(back(other.deposits.x[stay]), one.deposits.x[stay], atol=SAME_PLACE)
    np.testing.assert_allclose(other.deposits.t[stay], one.deposits.t[stay], atol=SAME_PLACE)


def smooth_cases() -> st.SearchStrategy[Case]:
    """Return a strategy for cases in which rounding decides no event: moderate ground, rocks that bounce well."""
    return st.builds(
        Case, st.sampled_from([0.1, 0.5]), st.just(0.1), st.integers(0, 10**6), st.floats(0.2, 0.6), st.just(0.8),
        st.just(0.6), st.just(0.1), st.just("sliding"), st.integers(0, 10**6), st.just(False),
        st.just(4.0), st.just(1.0),
    )  # fmt: skip


@pytest.mark.parametrize("engine", ENGINES)
@modest
@given(case=smooth_cases(), by=st.tuples(*3 * [st.floats(-200.0, 200.0)]))
def test_moving_the_scene_moves_the_answer(engine, case, by):
    terrain, _, x, v = built(case)
    compared(engine, case, terrain.vertices + by, x + by, v, lambda end: end - by)


@pytest.mark.parametrize("engine", ENGINES)
@modest
@given(case=smooth_cases(), angle=st.sampled_from([90.0, 180.0, 270.0, 33.0]))
def test_turning_the_scene_turns_the_answer(engine, case, angle):
    terrain, _, x, v = built(case)
    compared(
        engine,
        case,
        turned(terrain.vertices, angle),
        turned(x, angle),
        turned(v, angle),
        lambda end: turned(end, -angle),
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_at_rest_on_the_rim_of_a_steep_smooth_slope_falls_off_it(engine):
    """Rocks on inner vertices leave the slope, too, because no place on it can hold a rock."""
    terrain, physics, x, v = built(OVER_A_RIM_VERTEX)
    d = fly(engine_over(engine, terrain), physics, x, v).deposits
    assert set(d.outcome) == {Outcome.LEFT_TERRAIN}
