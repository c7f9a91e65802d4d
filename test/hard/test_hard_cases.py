"""Hard cases: contacts at edges, vertices, corners and walls, faulty meshes, and coefficients at their limits.

One sentence each. Wherever a closed form exists it is compared with; elsewhere the rock must end where it can, above
the ground, with an outcome, on both engines.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes_of_facets import (
    ENGINES,
    box,
    cone,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    gully,
    incline,
    joined,
    rough_grid,
    same_bits,
    specific_energy,
    strip,
    surface,
    terrain_of,
    without_facets,
)

from rpf3d_core.ensemble.releases import Releases, check_above_ground
from rpf3d_core.errors import InputError
from rpf3d_core.materials.library import Surface
from rpf3d_core.terrain.edges import edges_of
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.winding import repair_winding
from rpf3d_core.values import Mode, Outcome

G = 9.81
NEAR = 1e-6
"""m: far above the contact tolerance (1e-11 m here), far below anything of interest."""
BOTH = pytest.mark.parametrize("engine", ENGINES)
MODELS = pytest.mark.parametrize("model", ["none", "sliding"])


def as_loaded(terrain):
    """The terrain with its winding repaired, as every terrain that is read from a file."""
    winding = repair_winding(terrain.vertices, terrain.triangles, edges_of(terrain.triangles, len(terrain.vertices)))
    return replace(terrain, triangles=winding.triangles)


def lies_on(engine, flights):
    """Whether every rock that stopped has ground within NEAR below it."""
    x = flights.deposits.x[flights.deposits.outcome == Outcome.STOPPED] + (0, 0, NEAR)
    below = engine.ground_below(x)
    return bool(np.all(below[:, 1] >= 0) and np.all(below[:, 0] <= 2 * NEAR))


# --- releases on the ground -------------------------------------------------------------------------------------------

SPOTS = {
    "inside a facet": (1.3, 0.4),
    "on an edge": (1.0, 0.25),
    "on a diagonal": (0.5, 0.5),
    "on a vertex": (1.0, 1.0),
}


@BOTH
@MODELS
@pytest.mark.parametrize("spot", SPOTS.values(), ids=SPOTS)
def test_a_rock_released_at_rest_exactly_on_level_ground_stays_there(engine, model, spot):
    over = engine_over(engine, floor(4.0, z=3.0, cells=8))
    flights = fly(over, flight(surface(stop_speed=0.0), model), (*spot, 3.0))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    np.testing.assert_array_equal(flights.deposits.x[0], (*spot, 3.0))
    assert flights.deposits.impacts[0] == 0


@BOTH
@pytest.mark.parametrize("spot", SPOTS.values(), ids=SPOTS)
def test_a_rock_released_at_rest_on_a_steep_slope_slides_off_it_wherever_it_lies(engine, spot):
    over = engine_over(engine, rough_grid(8, 8.0, 1.0, 0.0))
    flights = fly(over, flight(surface(friction_angle=20.0)), (*spot, -spot[0]))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    a = G * (math.sin(math.pi / 4) - math.tan(math.radians(20)) * math.cos(math.pi / 4))
    way = (8.0 - spot[0]) * math.sqrt(2.0)
    assert flights.deposits.t[0] == pytest.approx(math.sqrt(2 * way / a), rel=1e-5)
    assert flights.deposits.x[0, 1] == pytest.approx(spot[1], abs=NEAR)


@BOTH
@pytest.mark.parametrize("along", [0.0, 0.1, 0.37, 1.0, 2.9, 6.1])
def test_a_rock_that_moves_along_the_slope_it_is_released_on_slides_from_the_start(engine, along):
    """Its coordinates are rounded, so it lies a hair above or below the plane: that must not make it an impact."""
    for angle in (13.0, 31.0, 44.0, 58.0):
        descent, _ = down_the_slope(angle, 21.0)
        over = engine_over(engine, incline(angle, 21.0))
        flights = fly(over, flight(surface(0.5, 0.8, 60.0, 0.0)), along * descent, 3.0 * descent)
        way = 9.0 / (
            2 * G * (math.tan(math.radians(60)) * math.cos(math.radians(angle)) - math.sin(math.radians(angle)))
        )
        assert flights.deposits.impacts[0] == 0
        assert flights.deposits.path[0] == pytest.approx(way, rel=1e-6)


@BOTH
def test_a_rock_under_the_ground_is_refused_by_name_place_and_depth(engine):
    over = engine_over(engine, floor(4.0, z=3.0))
    ones = np.ones(1)
    zeros = np.zeros(1, dtype=int)
    releases = Releases(zeros, zeros, np.array([[1.0, 0.5, 2.75]]), np.zeros((1, 3)), ones, ones)
    with pytest.raises(InputError, match=r"'crest'.*rock 0 at \(11\.000, 20\.500, 32\.750\).*0\.25 m under"):
        check_above_ground(releases, ["crest"], over, Frame((10.0, 20.0, 30.0)))


# --- falls on edges, walls and overhangs ------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("spot", SPOTS.values(), ids=SPOTS)
def test_a_vertical_drop_on_level_ground_bounces_in_place(engine, spot):
    flights = fly(engine_over(engine, floor(4.0, cells=8)), flight(surface(0.6, 0.8), "none"), (*spot, 2.0))
    t0 = math.sqrt(4.0 / G)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.t[0] == pytest.approx(t0 * 1.6 / 0.4, rel=1e-12)
    np.testing.assert_array_equal(flights.deposits.x[0], (*spot, 0.0))
    np.testing.assert_allclose(flights.impacts.speed_out, 0.6 * flights.impacts.speed_in, rtol=1e-12)


@BOTH
def test_a_rock_thrown_at_a_vertical_wall_comes_back_from_it(engine):
    flights = fly(engine_over(engine, box()), flight(surface(0.5, 0.8)), (0.0, 0.3, 8.0), (10.0, 0.0, 0.0))
    hit = flights.impacts
    assert (hit.t[0], *hit.x[0]) == pytest.approx((0.5, 5.0, 0.3, 8.0 - 0.125 * G), rel=1e-12)
    assert tuple(flights.paths.v[1]) == pytest.approx((-5.0, 0.0, -0.5 * G * 0.8), rel=1e-12)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0, 2] == pytest.approx(0.0, abs=NEAR)


@BOTH
@pytest.mark.parametrize("R_n", [0.0, 0.5, 1.0])
def test_a_rock_in_a_box_never_leaves_it(engine, R_n):
    draw = np.random.default_rng(1)
    x, v = draw.uniform(-4.9, 4.9, (20, 3)), draw.normal(size=(20, 3)) * 6
    x[:, 2] = draw.uniform(0.1, 2.0, 20)
    v[:, 2] = draw.uniform(-5, 5, 20)
    over = engine_over(engine, box())
    flights = fly(over, flight(surface(R_n, 0.9 if R_n < 1 else 1.0), max_impacts=200), x, v)
    assert set(flights.deposits.outcome) == ({Outcome.STOPPED} if R_n < 1 else {Outcome.MAX_IMPACTS})
    assert np.all(np.abs(flights.paths.x[:, :2]) <= 5.0 + NEAR) and np.all(flights.paths.x[:, 2] >= -NEAR)


@BOTH
def test_a_rock_thrown_up_at_an_overhang_rebounds_from_its_underside(engine):
    roof = terrain_of([(-5, -5, 4), (5, -5, 4), (5, 5, 4), (-5, 5, 4)], [(0, 2, 1), (0, 3, 2)])  # faces down
    over = engine_over(engine, joined(floor(), roof))
    flights = fly(over, flight(surface(0.5, 0.8)), (0.2, 0.3, 1.0), (0.0, 0.0, 9.0))
    up = math.sqrt(81.0 - 2 * G * 3.0)
    assert (flights.impacts.x[0, 2], flights.impacts.normal[0, 2]) == pytest.approx((4.0, -1.0))
    assert flights.paths.v[1, 2] == pytest.approx(-0.5 * up, rel=1e-12)
    assert flights.impacts.speed_in[1] == pytest.approx(math.sqrt(0.25 * up**2 + 8 * G), rel=1e-12)
    assert flights.deposits.outcome[0] == Outcome.STOPPED and abs(flights.deposits.x[0, 2]) < NEAR


@BOTH
def test_a_rock_that_flies_up_into_the_back_of_a_sheet_rebounds_from_it(engine):
    """Contact is two-sided (design.md, section 4): an upper bench without thickness is no trapdoor."""
    over = engine_over(engine, joined(floor(), floor(5.0, z=4.0)))
    flights = fly(over, flight(surface(0.5, 0.8)), (0.2, 0.3, 1.0), (0.0, 0.0, 9.0))
    assert flights.impacts.x[0, 2] == pytest.approx(4.0) and flights.impacts.normal[0, 2] == -1.0
    assert flights.deposits.outcome[0] == Outcome.STOPPED and abs(flights.deposits.x[0, 2]) < NEAR


@BOTH
@pytest.mark.parametrize(("start", "end"), [(5.0, 4.0), (3.0, 0.0)])
def test_of_two_terrains_one_above_another_a_rock_lands_on_the_one_below_it(engine, start, end):
    over = engine_over(engine, joined(floor(), floor(5.0, z=4.0)))
    flights = fly(over, flight(surface()), (0.2, 0.3, start))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0, 2] == pytest.approx(end, abs=NEAR)


@BOTH
def test_a_rock_that_slides_off_an_upper_sheet_lands_on_the_lower_one(engine):
    over = engine_over(engine, joined(floor(), floor(5.0, z=4.0)))
    flights = fly(over, flight(surface(0.3, 0.8, 10.0)), (0.0, 0.3, 4.0), (7.0, 0.0, 0.0))
    speed = math.sqrt(49.0 - 2 * math.tan(math.radians(10)) * G * 5.0)
    assert flights.impacts.x[0, 0] == pytest.approx(5.0 + speed * math.sqrt(8.0 / G), rel=1e-6)
    assert flights.deposits.outcome[0] == Outcome.STOPPED


# --- valleys, corners, pits -------------------------------------------------------------------------------------------


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
    assert set(flights.deposits.outcome) <= allowed
    depth = flights.paths.x[:, 2] + math.tan(math.radians(2)) * flights.paths.x[:, 0]
    assert depth.min() > -NEAR
    assert lies_on(over, flights)


@BOTH
@MODELS
@pytest.mark.parametrize("sides", [3, 4, 6, 7])
def test_a_rock_comes_to_rest_at_the_bottom_of_a_pit_with_one_vertex(engine, sides, model):
    draw = np.random.default_rng(sides)
    x = np.concatenate([draw.uniform(-0.8, 0.8, (20, 2)), draw.uniform(3, 4, (20, 1))], 1)
    x[0, :2] = 0.0
    over = engine_over(engine, cone(sides))
    flights = fly(over, flight(surface(0.4, 0.6, 20.0, 0.3), model), x)
    assert lies_on(over, flights)
    assert set(flights.deposits.outcome) <= {
        Outcome.STOPPED,
        *([Outcome.UNRESOLVED_CONTACT] if model == "none" else []),
    }
    if model == "sliding":  # 45 degrees or so against 20 of friction: only the edges' wedging or the vertex can hold it
        assert np.all(flights.deposits.x[:, 2] < 3.0)


@BOTH
def test_a_rock_laid_exactly_on_the_vertex_of_a_pit_stays_there(engine):
    flights = fly(engine_over(engine, cone(5)), flight(surface(friction_angle=10.0, stop_speed=0.0)), (0.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert np.linalg.norm(flights.deposits.x[0]) < NEAR


@BOTH
def test_a_rock_laid_exactly_on_a_summit_slides_down_or_stays_as_friction_says(engine):
    ends = [
        fly(engine_over(engine, cone(5, height=-2.0)), flight(surface(friction_angle=f)), (0.0, 0.0, 0.0)).deposits
        for f in (40.0, 10.0)
    ]
    assert [end.outcome[0] for end in ends] == [Outcome.STOPPED, Outcome.LEFT_TERRAIN]


@BOTH
def test_a_rock_dropped_into_a_corner_of_three_facets_stops_in_it(engine):
    """A cube's corner, standing on its tip: every rebound sends the rock on into the next facet."""
    tips = np.array(
        [[math.cos(a), math.sin(a), math.sqrt(0.5)] for a in (0.1, 0.1 + 2 * math.pi / 3, 0.1 + 4 * math.pi / 3)]
    )
    over = engine_over(engine, terrain_of([(0, 0, 0), *(10 * tips)], [(0, 1, 2), (0, 2, 3), (0, 3, 1)]))
    draw = np.random.default_rng(4)
    x = np.concatenate([draw.uniform(-1, 1, (50, 2)), draw.uniform(4, 6, (50, 1))], 1)
    flights = fly(over, flight(surface(0.5, 0.8, 30.0, 0.5)), x)
    assert set(flights.deposits.outcome) == {Outcome.STOPPED}
    assert flights.paths.x[:, 2].min() > -NEAR
    assert lies_on(over, flights)


# --- coefficients at their limits -------------------------------------------------------------------------------------


@BOTH
@MODELS
@pytest.mark.parametrize("R_t", [0.0, 0.8, 1.0])
def test_without_normal_restitution_a_rock_stays_on_what_it_hits(engine, model, R_t):
    over = engine_over(engine, incline(35.0, cells=(10, 3)))
    flights = fly(over, flight(surface(0.0, R_t, 50.0), model), (0.3, 0.2, 5.0), (1.0, 0.0, 0.0))
    assert flights.deposits.impacts[0] == 1
    expected = Outcome.UNRESOLVED_CONTACT if model == "none" and R_t > 0.0 else Outcome.STOPPED
    assert flights.deposits.outcome[0] == expected
    assert lies_on(over, flights)


@BOTH
def test_an_inelastic_impact_keeps_the_speed_along_the_ground_that_r_t_leaves_it(engine):
    """R_n = 0: there is one impact and no bouncing, so R_t takes its share once."""
    flights = fly(engine_over(engine, floor()), flight(surface(0.0, 0.8, 30.0)), (-9.0, 0.3, 2.0), (5.0, 0.0, 0.0))
    assert flights.deposits.ground_speed[0] == pytest.approx(4.0, rel=1e-12)


@BOTH
@pytest.mark.parametrize("place", ["box", "gully", "cone", "level"])
def test_without_losses_a_thousand_bounces_keep_the_energy(engine, place):
    terrain = {
        "box": box(),
        "gully": gully(40.0, 50.0, 0.0, side=50.0, length=1e4),
        "cone": cone(5, 50.0, 40.0),
        "level": floor(cells=4),
    }[place]
    start, v = {"box": ((1.0, 0.3, 3.0), (2.0, 1.0, 0.0))}.get(place, ((0.3, 0.2, 5.0), (0.0, 0.0, 0.0)))
    flights = fly(engine_over(engine, terrain), flight(surface(1.0, 1.0), max_impacts=1000), start, v)
    energy, _ = specific_energy(flights)
    assert flights.deposits.outcome[0] == Outcome.MAX_IMPACTS and flights.deposits.impacts[0] == 1000
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


@BOTH
def test_without_losses_a_rock_dropped_on_level_ground_comes_back_to_its_height(engine):
    flights = fly(engine_over(engine, floor()), flight(surface(1.0, 1.0), max_impacts=1000), (0.1, 0.3, 2.0))
    np.testing.assert_allclose(np.diff(flights.impacts.t), 2 * math.sqrt(4.0 / G), rtol=1e-9)


# --- faulty and awkward meshes ----------------------------------------------------------------------------------------


@BOTH
def test_a_slide_over_coplanar_facets_and_a_needle_among_them_is_one_slide(engine):
    thin = 1e-7
    vertices = [(-10, -5, 0), (0, -5, 0), (0, 5, 0), (-10, 5, 0), (10, -5, 0), (10, 5, 0), (thin, 5, 0)]
    triangles = [(0, 1, 2), (0, 2, 3), (1, 6, 2), (1, 4, 5), (1, 5, 6)]
    flights = fly(
        engine_over(engine, terrain_of(vertices, triangles)),
        flight(Surface(0.5, 0.8, 0.3, 0.0)),
        (-3.0, 0.7, 0.0),
        (6.0, 0.5, 0.0),
    )
    way = 36.25 / (2 * 0.3 * G)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert np.linalg.norm(flights.deposits.x[0] - (-3.0, 0.7, 0.0)) == pytest.approx(way, rel=1e-6)


@BOTH
@MODELS
@pytest.mark.parametrize("fault", ["zero area", "duplicate", "turned duplicate", "needle", "zero length"])
def test_a_faulty_facet_changes_nothing(engine, model, fault):
    good = rough_grid(6, 12.0, 0.5, 0.2, seed=3)
    first = good.triangles[20].tolist()
    vertices, triangles = good.vertices.tolist(), good.triangles.tolist()
    if fault == "zero area":
        vertices.append((0.5 * (good.vertices[first[0]] + good.vertices[first[1]])).tolist())
        triangles.append([first[0], first[1], len(vertices) - 1])
    elif fault == "needle":
        vertices.append((0.5 * (good.vertices[first[0]] + good.vertices[first[1]]) + (0, 0, -1e-14)).tolist())
        triangles.append([first[0], first[1], len(vertices) - 1])
    elif fault == "zero length":
        triangles.append([first[0], first[0], first[0]])
    else:
        triangles.append(first if fault == "duplicate" else first[::-1])
    draw = np.random.default_rng(6)
    x = np.concatenate([draw.uniform(1, 11, (60, 2)), np.full((60, 1), 2.0)], 1)
    x[:6, :2] = good.vertices[first].mean(0)[:2] + draw.uniform(-0.3, 0.3, (6, 2))
    physics = flight(surface(0.4, 0.8, 20.0), model)
    plain, faulty = (
        fly(engine_over(engine, t), physics, x) for t in (good, as_loaded(terrain_of(vertices, triangles)))
    )
    np.testing.assert_allclose(faulty.deposits.x, plain.deposits.x, atol=NEAR)
    np.testing.assert_array_equal(faulty.deposits.outcome, plain.deposits.outcome)


@BOTH
def test_roughness_of_a_nanometre_changes_nothing_a_survey_could_see(engine):
    """Slope 20 degrees, friction 30: bouncing, then a slide of some 14 m over facets of 1 m whose kinks are 1e-9."""
    ends = []
    for amplitude in (0.0, 1e-9):
        over = engine_over(engine, rough_grid(40, 40.0, math.tan(math.radians(20)), amplitude, seed=8))
        ends.append(fly(over, flight(surface(0.5, 1.0, 30.0, 0.2)), (2.03, 10.21, 2.0), (1.0, 0.1, 0.0)).deposits)
    assert ends[0].outcome[0] == ends[1].outcome[0] == Outcome.STOPPED
    np.testing.assert_allclose(ends[0].x, ends[1].x, atol=1e-5)


@BOTH
def test_a_rock_that_lands_on_an_edge_of_a_terrain_is_not_lost_inside_it(engine):
    """Drops on every vertex, edge and diagonal of a rough grid: each must hit, none falls between two facets."""
    terrain = rough_grid(6, 6.0, 0.3, 0.4, seed=9)
    inner = terrain.vertices[((terrain.vertices[:, :2] > 0.5) & (terrain.vertices[:, :2] < 5.5)).all(1)]
    spots = [np.add(inner, (0, 0, 3))]
    for t in terrain.triangles:
        for a, b in ((0, 1), (1, 2), (2, 0)):
            for share in (0.5, 0.3):
                spots.append((share * terrain.vertices[t[a]] + (1 - share) * terrain.vertices[t[b]] + (0, 0, 3))[None])
    x = np.concatenate(spots)
    x = x[((x[:, :2] > 0.1) & (x[:, :2] < 5.9)).all(1)]
    flights = fly(engine_over(engine, terrain), flight(surface(), max_impacts=1), x)
    assert np.all(flights.deposits.impacts == 1)


@BOTH
def test_a_rock_over_a_hole_falls_through_it_and_one_beside_it_does_not(engine):
    whole = floor(6.0, cells=6)
    a, b = 14, 14 + 36
    holed = without_facets(whole, a, b)
    x = whole.vertices[whole.triangles[[a, a + 1]]].mean(1)
    x[:, 2] += 2.0
    ends = fly(engine_over(engine, holed), flight(surface()), x).deposits
    assert list(ends.outcome) == [Outcome.LEFT_TERRAIN, Outcome.STOPPED]


@BOTH
def test_a_rock_leaves_a_terrain_sideways_at_its_very_edge(engine):
    over = engine_over(engine, floor(6.0))
    flights = fly(over, flight(surface(0.9, 1.0)), (0.0, 0.3, 2.0), (7.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert flights.deposits.x[0, 0] == pytest.approx(6.0, abs=NEAR)


@BOTH
def test_a_rock_on_a_single_facet_stops_on_it_or_leaves_it(engine):
    over = engine_over(engine, terrain_of([(-5, -5, 0), (5, -5, 0), (0, 5, 0)], [(0, 1, 2)]))
    ends = fly(over, flight(surface()), [(0.0, 0.0, 2.0), (4.0, 4.0, 2.0)]).deposits
    assert list(ends.outcome) == [Outcome.STOPPED, Outcome.LEFT_TERRAIN]


@BOTH
@pytest.mark.parametrize("steps", [3, 40])
def test_a_rock_sliding_down_a_staircase_of_kinks_in_the_gully_of_a_mesh_is_never_wedged_at_speed(engine, steps):
    """A level gully whose line has vertices: the rock must pass each of them."""
    over = engine_over(engine, gully(30.0, 10.0, 0.0, length=30.0, cells=steps))
    flights = fly(over, flight([Surface(0.5, 0.8, 0.05, 0.0)] * 2), (0.0, 0.0, 0.0), (5.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] in (Outcome.STOPPED, Outcome.LEFT_TERRAIN)
    assert flights.deposits.x[0, 0] > 10.0


@pytest.mark.parametrize("model", ["none", "sliding"])
def test_hard_places_give_the_same_bits_on_both_engines(model):
    parts = joined(box(), floor(4.0, z=-3.0, cells=3))
    draw = np.random.default_rng(10)
    x, v = draw.uniform(-4, 4, (80, 3)), draw.normal(size=(80, 3)) * 4
    x[:, 2] = draw.uniform(0.0, 3.0, 80)
    flown = [
        fly(engine_over(name, parts), flight(surface(0.5, 0.9, 15.0), model, max_impacts=500), x, v) for name in ENGINES
    ]
    assert same_bits(*flown)
    assert Mode.FLIGHT in flown[0].paths.mode


@BOTH
def test_a_profile_of_vertical_risers_and_level_treads_lets_no_rock_through(engine):
    stairs = [(0.0, 10.0), (5.0, 10.0), (5.0, 7.0), (10.0, 7.0), (10.0, 3.0), (15.0, 3.0), (15.0, 0.0), (40.0, 0.0)]
    over = engine_over(engine, strip(stairs, across=3))
    draw = np.random.default_rng(11)
    x = np.stack([draw.uniform(0.5, 14, 60), draw.uniform(-4, 4, 60), np.full(60, 12.0)], 1)
    x[:4, 0] = (5.0, 10.0, 15.0, 5.0)
    flights = fly(over, flight(surface(0.5, 0.8, 25.0)), x, (1.0, 0.0, 0.0))
    assert set(flights.deposits.outcome) <= {Outcome.STOPPED, Outcome.LEFT_TERRAIN}
    assert flights.paths.x[:, 2].min() > -NEAR
    assert lies_on(over, flights)
