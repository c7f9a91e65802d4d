"""Tests of a rigid sphere over facets: contact with facets, edges and vertices, rolling, sizes, and stops."""

import math

import numpy as np
import pytest
from flights.obstacles_made import fence, with_effects
from flights.rolling_spheres import clearance, places_of, roll, spheres
from flights.scenes_of_facets import (
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
    rough_grid,
    same_bits,
    strip,
    surface,
    terrain_of,
)

from rpf3d_core.kinetics import sphere_ground
from rpf3d_core.kinetics.coulomb_sphere import CoulombSphere
from rpf3d_core.kinetics.ground import NoGround
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Outcome

G = 9.81
ROUNDED = 1e-9
"""Largest error (m and s) of contacts, whose tolerance is 1e-10 m on terrains of 100 m."""
NEAR = 1e-6
"""Length (m) far above the contact tolerance and far below any length that matters in these tests."""
BOTH = pytest.mark.parametrize("engine", ENGINES)
BAD = {Outcome.FAILED, Outcome.UNRESOLVED_CONTACT, Outcome.MAX_IMPACTS}


def ground(e=0.3, mu=0.5, mu_r=0.1, stop_speed=0.3):
    return Surface(e, 0.8, mu, stop_speed, mu_r)


# --- contact ----------------------------------------------------------------------------------------------------------


@pytest.mark.long
@BOTH
@pytest.mark.parametrize("radius", [0.01, 0.5, 7.0])
def test_a_sphere_touches_a_floor_when_its_centre_is_a_radius_above_it(engine, radius):
    over = engine_over(engine, floor(40.0, cells=5))
    first = roll(over, spheres(ground()), radius, (0.3, 0.7, 20.0), (2.0, 1.0, 0.0)).impacts
    t = math.sqrt(2.0 * (20.0 - radius) / G)
    assert first.t[0] == pytest.approx(t, abs=ROUNDED)
    assert first.x[0] == pytest.approx((0.3 + 2.0 * t, 0.7 + t, radius), abs=ROUNDED)


def ridge(slope=1.0):
    """Return a roof along y whose ridge, an edge, passes through the origin; slope : fall (m/m) of both sides."""
    return strip([(-30.0, -30.0 * slope), (0.0, 0.0), (30.0, -30.0 * slope)], half_width=30.0, across=4)


@BOTH
@pytest.mark.parametrize("offset", [0.0, 0.2, 0.69])
def test_a_sphere_dropped_on_an_edge_touches_it_beside_its_middle(engine, offset):
    """At a distance d < R sin 45 from the ridge, the centre is sqrt(R^2 - d^2) above the edge at contact."""
    over = engine_over(engine, ridge())
    first = roll(over, spheres(ground()), 1.0, (offset, 1.3, 5.0)).impacts
    height = math.sqrt(1.0 - offset**2)
    assert first.x[0, 2] == pytest.approx(height, abs=ROUNDED)
    assert first.normal[0] == pytest.approx((offset, 0.0, height), abs=1e-8)


@BOTH
def test_a_sphere_dropped_beside_an_edge_touches_the_face(engine):
    over = engine_over(engine, ridge())
    first = roll(over, spheres(ground()), 1.0, (0.8, 1.3, 5.0)).impacts
    assert first.x[0, 2] == pytest.approx(math.sqrt(2.0) - 0.8, abs=ROUNDED)
    assert first.normal[0] == pytest.approx((math.sqrt(0.5), 0.0, math.sqrt(0.5)), abs=1e-12)


@BOTH
@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.3, 0.1), (-0.2, 0.5)])
def test_a_sphere_dropped_on_a_corner_touches_it_there(engine, offset):
    over = engine_over(engine, cone(7, 20.0, -20.0))
    first = roll(over, spheres(ground()), 1.0, (*offset, 9.0)).impacts
    height = math.sqrt(1.0 - offset[0] ** 2 - offset[1] ** 2)
    assert first.x[0, 2] == pytest.approx(height, abs=ROUNDED)
    assert first.normal[0] == pytest.approx((*offset, height), abs=1e-8)


@BOTH
def test_an_arc_that_passes_a_corner_by_less_than_the_radius_hits_it_and_by_more_does_not(engine):
    over = engine_over(engine, cone(7, 20.0, -60.0))
    for height, hits in ((0.999, True), (1.001, False)):
        t = 1.0
        x = (-20.0 * t, 0.0, height + 0.5 * G * t * t)
        flights = roll(over, spheres(ground()), 1.0, (x[0], 0.0, height), (20.0, 0.0, 0.0))
        near = clearance(over, places_of(flights)).min()
        assert near >= 1.0 - NEAR
        assert (flights.impacts.t[0] < 1.0) if hits or len(flights.impacts.t) else True


@BOTH
def test_a_small_sphere_without_friction_hits_where_a_point_does(engine):
    terrain = rough_grid(10, 40.0, 0.5, 0.8, seed=2)
    over, x = engine_over(engine, terrain), np.array([[3.0 + k, 20.0 - k, 12.0] for k in range(6)])
    point = fly(over, flight(surface(0.5, 1.0), "none"), x, (2.0, 1.0, 0.0)).impacts
    gaps = []
    for radius in (1e-3, 1e-5):
        tiny = roll(over, spheres(Surface(0.5, 1.0, 0.0, 0.5)), radius, x, (2.0, 1.0, 0.0)).impacts
        first = [[impacts.x[np.argmax(impacts.row == k)] for k in range(6)] for impacts in (point, tiny)]
        second = [[impacts.x[np.argmax(impacts.row == k) + 1] for k in range(6)] for impacts in (point, tiny)]
        assert np.allclose(first[0], first[1], atol=3.0 * radius)
        gaps.append(np.abs(np.subtract(second[0], second[1])).max())
    assert gaps[1] < 0.05 * gaps[0] and gaps[1] < 1e-3


# --- rolling ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mu_r", [0.3, 5.0])
def test_no_rolling_friction_brakes_a_sphere_more_than_a_block_that_slides(mu_r):
    """Skidding decelerates by mu g, rolling by at most mu g, so s = (v^2 - v_stop^2) / (2 mu g)."""
    mu, v, stop = 0.1, 10.0, 0.3
    over, physics = engine_over("reference", floor(200.0)), spheres(ground(mu=mu, mu_r=mu_r))
    flights = roll(over, physics, 0.5, (-90.0, 0.3, 0.5), (v, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0, 0] + 90.0 == pytest.approx((v * v - stop * stop) / (2.0 * mu * G), rel=1e-9)


def test_a_slope_steeper_than_its_friction_angle_holds_no_sphere_however_hard_it_rolls():
    """At 30 degrees and mu = 0.4, a = g (sin - mu cos), although 2/7 tan < mu and mu_r > tan."""
    slope, mu, t = math.radians(30.0), 0.4, 1.0
    over = engine_over("reference", incline(30.0))
    lies = over.ground_below(np.array([[-1.0, 0.3, 100.0]]))
    x = (-1.0, 0.3, 100.0 - lies[0, 0] + 0.5 / math.cos(slope))
    end = roll(over, spheres(ground(mu=mu, mu_r=1.2), max_time=t), 0.5, x).deposits
    assert end.outcome[0] == Outcome.MAX_TIME
    a = G * (math.sin(slope) - mu * math.cos(slope))
    assert np.linalg.norm(np.subtract(end.x[0], x)) == pytest.approx(0.5 * a * t * t, rel=1e-6)


@BOTH
@pytest.mark.parametrize("v", [(0.0, 0.0, 0.0), (-3.0, 0.0, 1.2), (0.0, 3.0, 0.0)])
@pytest.mark.parametrize("friction", [12.0, 19.0])
def test_a_slope_steeper_than_its_friction_angle_stops_no_sphere_that_rolls_uphill_or_across(engine, v, friction):
    """A moving sphere may have more rolling resistance than one at rest: only the latter decides whether it stays."""
    over = engine_over(engine, incline(22.0))
    lies = over.ground_below(np.array([[0.0, 0.3, 100.0]]))
    x = (0.0, 0.3, 100.1 - lies[0, 0] + 0.5 / math.cos(math.radians(22.0)))
    ground_there = ground(mu=math.tan(math.radians(friction)), mu_r=0.8, stop_speed=0.0)
    assert roll(over, spheres(ground_there), 0.5, x, v).deposits.outcome[0] == Outcome.LEFT_TERRAIN


def test_a_sphere_that_strikes_a_wall_just_where_a_net_stands_breaks_the_net_once():
    """The centre comes no nearer to the wall than R, so a net at this distance is met together with the wall."""
    terrain = strip([(-12.0, 0.0), (3.0, 0.0), (3.0, 6.0)], half_width=8.0, across=4)
    net = fence(terrain, [(2.5, -7.0), (2.5, 7.0)], 3.0, 4e3)
    for z, v in ((0.5, (8.0, 0.0, 0.0)), (1.3, (12.0, 0.0, 1.0))):
        flights = roll(engine_over("reference", terrain), with_effects(spheres(ground()), net), 0.5, (-2.0, 0.3, z), v)
        struck = flights.impacts.x[:, 0] > 2.4
        assert struck.sum() == 2 and np.sum(flights.impacts.facet[struck] < 0) == 1, "the net, and the wall"


TABLE = {22: (2.624922, 2.765323), 40: (4.504105, 5.554257), 50: (5.367783, 6.884321), 59: (6.006294, 7.903559)}


@pytest.mark.parametrize("x", [0.0, 0.05, 0.1])
def test_a_sphere_that_breaks_a_net_while_it_goes_around_an_edge_keeps_the_energy_that_is_left(x):
    """Around an edge, the ground's normal is not that of a facet; the facet's normal would brake the sphere again."""
    terrain = strip([(-12.0, 0.0), (0.0, 0.0), (12.0, -4.4)], half_width=8.0, across=4)
    net = fence(terrain, [(x, -7.0), (x, 7.0)], 3.0, 100.0)
    over, physics = engine_over("reference", terrain), with_effects(spheres(ground(mu_r=0.05)), net)
    impacts = roll(over, physics, 0.5, (-2.0, 0.3, 0.5), (2.2, 0.0, 0.0)).impacts
    before, after = impacts.speed_in[0], impacts.speed_out[0]
    assert impacts.facet[0] < 0 and impacts.x[0, 0] == pytest.approx(x, abs=NEAR)
    assert after == pytest.approx(math.sqrt(before * before - 2.0 * 100.0 / 1000.0), rel=1e-4)


@BOTH
@pytest.mark.parametrize("angle", TABLE)
@pytest.mark.parametrize("strike", [0.0, 37.0])
def test_a_sphere_rolls_or_slips_down_a_slope_as_tabulated(engine, angle, strike):
    """The sphere rolls with mu above 2/7 tan and slips with mu = 0.1 (section 2.5 of the validation reference)."""
    descent, n = down_the_slope(angle, strike)
    over = engine_over(engine, incline(angle, strike, cells=(5, 3)))
    for mu, a in zip((2 / 7 * math.tan(math.radians(angle)) + 1e-3, 0.1), TABLE[angle], strict=True):
        flights = roll(over, spheres(ground(mu=mu, mu_r=0.0)), 0.5, descent + 0.5 * n)
        down = flights.paths.v_end[:-2] @ descent
        last = int(np.argmax(down))
        way = (flights.paths.x[last + 1] - descent) @ descent
        assert down[last] ** 2 / (2.0 * way) == pytest.approx(a, rel=2e-6)


@BOTH
def test_a_sphere_that_skids_on_the_level_comes_to_roll_as_tabulated(engine):
    """From 10 m/s with mu = 0.3: 0.970827 s, 8.321371 m, then 5/7 of the speed (section 2.5)."""
    over = engine_over(engine, floor(50.0, cells=3))
    paths = roll(over, spheres(ground(mu=0.3, mu_r=0.0)), 0.5, (-40.0, 0.2, 0.5), (10.0, 0.0, 0.0)).paths
    row = int(np.argmax(paths.v[:, 0] < 10.0 * 5.0 / 7.0 + 1e-6))
    assert paths.t[row] == pytest.approx(0.970827, abs=1e-6)
    assert paths.x[row, 0] + 40.0 == pytest.approx(8.321371, abs=1e-6)
    assert paths.v[row, 0] == pytest.approx(7.142857, abs=1e-6)


@BOTH
def test_rolling_friction_stops_a_sphere_where_azzonis_rock_stops(engine):
    """On level ground with mu_r = 0.4, a sphere that rolls at 5 m/s stops after 4.460 m (physics 9.5).

    Before, it skids from 7 m/s to 5 m/s.
    """
    over = engine_over(engine, floor(50.0, cells=3))
    flights = roll(over, spheres(Surface(0.3, 0.8, 0.5, 0.0, 0.4)), 0.5, (-40.0, 0.2, 0.5), (7.0, 0.0, 0.0))
    skid = 12.0 * 49.0 / (49.0 * 0.5 * G)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0, 0] + 40.0 - skid == pytest.approx(4.460, abs=5e-4)


def test_friction_that_turns_is_cut_finely_enough(monkeypatch):
    """If TURN is halved, the error of the end of a path that skids and rolls across a slope is at least halved."""
    descent, n = down_the_slope(12.0)
    v = 7.0 * np.cross(n, descent) - 3.0 * descent
    over = engine_over("reference", incline(12.0, half_width=60.0, up=40.0))
    ends = {}
    for turn in (1 / 8, 1 / 16, 1 / 256):
        monkeypatch.setattr(sphere_ground, "TURN", turn)
        ends[turn] = roll(over, spheres(ground(mu=0.4, mu_r=0.35)), 0.5, 0.5 * n - 30.0 * descent, v).deposits.x[0]
    coarse, usual = (np.linalg.norm(ends[turn] - ends[1 / 256]) for turn in (1 / 8, 1 / 16))
    assert usual < 0.02 and usual < coarse / 2.0


@pytest.mark.parametrize("speed", [1.8, 2.0])
def test_a_sphere_rolls_over_an_edge_with_little_loss(speed):
    """The sphere rolls slowly up to a ridge and pivots over the edge; it loses less energy than in a fall of 5 cm."""
    over = engine_over("reference", strip([(-30.0, -1.0), (0.0, 0.0), (30.0, -12.0)], half_width=8.0))
    flights = roll(over, spheres(ground(mu=2.0, mu_r=0.0)), 1.0, (-3.0, 0.2, 1.0 + 0.05), (speed, 0.0, 0.0))
    paths = flights.paths
    total = 0.7 * (paths.v**2).sum(1) + G * paths.x[:, 2]
    rolled, at = (int(np.flatnonzero(paths.x[:, 0] > x)[0]) for x in (-0.5, 2.0))
    assert total[rolled] - total[at] < 0.05 * G and total[at] <= total[rolled] + 1e-6


# --- size, and hard places --------------------------------------------------------------------------------------------


def washboard(pitch=0.5, depth=0.25):
    """Return a slope with grooves across it, `pitch` (m) between vertices and `depth` (m) deep."""
    steps = 80
    profile = [(0.5 * pitch * k, -0.1 * pitch * k - (depth if k % 2 else 0.0)) for k in range(steps)]
    return strip(profile, half_width=6.0)


@BOTH
def test_a_large_sphere_rides_over_roughness_that_stops_a_small_one(engine):
    over = engine_over(engine, washboard())
    x = np.array([[2.1, 0.3, 3.0], [2.1, 0.3, 3.0]])
    flights = roll(over, spheres(ground(mu_r=0.02)), np.array([0.08, 2.0]), x, (2.0, 0.0, 0.0))
    small, large = flights.deposits.x[:, 0]
    assert small < 6.0 and large > 15.0
    assert flights.deposits.outcome[0] == Outcome.STOPPED


def needle_pit():
    """Return a level floor with a pit of 0.3 m by 0.3 m, 5 m deep."""
    ticks = [-6.0, -0.15, 0.15, 6.0]
    vertices = [(x, y, 0.0) for x in ticks for y in ticks]
    vertices += [(x, y, -5.0) for x in ticks[1:3] for y in ticks[1:3]]
    top = [4 * i + j for i in (1, 2) for j in (1, 2)]
    bottom = [16, 17, 18, 19]
    triangles = []
    for i in range(3):
        for j in range(3):
            a, b, c, d = 4 * i + j, 4 * i + 4 + j, 4 * i + 5 + j, 4 * i + 1 + j
            if (i, j) != (1, 1):
                triangles += [(a, b, c), (a, c, d)]
    around = [0, 2, 3, 1]
    for k in range(4):
        p, q = around[k], around[(k + 1) % 4]
        triangles += [(top[p], bottom[p], bottom[q]), (top[p], bottom[q], top[q])]
    triangles += [(16, 18, 19), (16, 19, 17)]
    return terrain_of(vertices, triangles)


HARD = {
    "V-gully": (gully(50.0, 50.0, 0.0), (5.0, 1.0, 5.0), (0.5, 0.0, 0.0)),
    "steep V-gully": (gully(75.0, 80.0, 0.0, side=3.0), (5.0, 0.4, 8.0), (0.5, 0.0, 0.0)),
    "needle pit": (needle_pit(), (0.02, -0.03, 4.0), (0.0, 0.0, 0.0)),
    "beside the needle pit": (needle_pit(), (0.1, -0.03, 4.0), (0.0, 0.0, 0.0)),
    "wall and floor": (box(), (2.0, 0.3, 3.0), (6.0, 0.0, 0.0)),
    "corner of a box": (box(), (2.0, 2.3, 3.0), (6.0, 5.5, 0.0)),
    "cone": (cone(5), (0.4, 0.3, 8.0), (0.0, 0.0, 0.0)),
}


@pytest.mark.long
@pytest.mark.parametrize("name", HARD)
@pytest.mark.parametrize("radius", [0.05, 0.4, 1.0])
def test_in_hard_places_a_sphere_comes_to_rest_outside_the_ground(name, radius):
    if "needle" in name and radius < 0.4:
        pytest.skip("it fits into the pit, whose walls only bounce it on")
    terrain, x, v = HARD[name]
    flights = {}
    for engine in ENGINES:
        over = engine_over(engine, terrain)
        flights[engine] = roll(over, spheres(ground(), max_impacts=20_000), radius, x, v)
        end = flights[engine].deposits
        assert Outcome(end.outcome[0]) in (Outcome.STOPPED, Outcome.LEFT_TERRAIN)
        assert clearance(over, places_of(flights[engine])).min() > radius - NEAR
        if end.outcome[0] == Outcome.STOPPED:
            assert clearance(over, end.x)[0] == pytest.approx(radius, abs=NEAR)
    assert same_bits(*flights.values())


@pytest.mark.long
def test_a_sphere_wider_than_a_pit_rests_on_its_rim():
    over = engine_over("reference", needle_pit())
    flights = roll(over, spheres(ground(e=0.0), max_impacts=20_000), 0.4, (0.01, -0.005, 0.45))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0] == pytest.approx((0.0, 0.0, math.sqrt(0.16 - 0.15**2)), abs=0.03)


ROUGH = [(seed, slope, radius) for seed, slope in ((0, 0.0), (1, 0.3), (2, 0.8)) for radius in (0.03, 0.3, 4.0)]


@pytest.mark.long
@pytest.mark.parametrize(("seed", "slope", "radius"), ROUGH)
def test_on_rough_ground_no_sphere_goes_into_it_and_every_one_ends(seed, slope, radius):
    """Facets are 2 m wide, radii much smaller or larger; both engines must agree to the last bit."""
    terrain = rough_grid(9, 18.0, slope, 0.5, seed=seed)
    x = np.array([[3.0 + 1.1 * k, 6.0 + 1.3 * k, 5.0 + radius] for k in range(5)])
    flights = [
        roll(engine_over(name, terrain), spheres(ground(), max_impacts=20_000), radius, x, (1.0, 0.3, 0.0))
        for name in ENGINES
    ]
    assert same_bits(*flights)
    assert not BAD.intersection(Outcome(o) for o in flights[0].deposits.outcome)
    over = engine_over("reference", terrain)
    assert clearance(over, places_of(flights[0], 1)).min() > radius - NEAR
    assert_no_energy_gained(flights[0])


def assert_no_energy_gained(flights):
    """Assert that the energy of the centre, without spin, never exceeds that at the release."""
    paths = flights.paths
    centre = 0.5 * (paths.v**2).sum(1) + G * paths.x[:, 2]
    first = np.searchsorted(paths.row, paths.row)
    assert np.all(centre <= centre[first] + 1e-9 * np.abs(centre).max())


@BOTH
def test_a_sphere_released_in_the_ground_is_lifted_until_it_touches(engine):
    over = engine_over(engine, floor(10.0, cells=3))
    flights = roll(over, spheres(ground()), 0.5, (1.0, 2.0, 0.2))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0] == pytest.approx((1.0, 2.0, 0.5), abs=ROUNDED)


@BOTH
@pytest.mark.parametrize("above", [-1e-12, 0.0, 1e-12, 0.01])
@pytest.mark.parametrize("angle", [0.0, 45.0, 87.0])
def test_a_sphere_released_on_a_facet_however_wide_and_steep_is_lifted_until_it_touches(engine, above, angle):
    """The lift is R / cos(slope), minus the initial height; only one facet is within reach of the sphere."""
    over = engine_over(engine, incline(angle, down=60.0, up=60.0, half_width=40.0))
    flights = roll(over, spheres(ground(), max_time=0.1), 0.5, (0.0, 3.0, above))
    high = 0.5 / math.cos(math.radians(angle))
    assert flights.paths.x[0] == pytest.approx((0.0, 3.0, high), abs=1e-7)
    assert clearance(over, flights.paths.x) == pytest.approx(0.5, abs=ROUNDED)


@BOTH
def test_a_sphere_released_in_a_slot_narrower_than_itself_is_not_moved_through_a_wall_of_the_slot(engine):
    """The walls are steeper than 87 degrees, so each step moves the sphere away from a wall, not up.

    The centre once came to lie in the ground, a radius behind the other wall, and fell.
    """
    profile = np.array([(-9.0, 0.0), (-0.05, 0.0), (0.0, -3.0), (0.05, 0.0), (9.0, 0.0)])
    vertices = [(x, y, z) for x, z in profile for y in (-5.0, 5.0)]
    slot = terrain_of(vertices, [t for a in range(0, 8, 2) for t in ((a, a + 2, a + 3), (a, a + 3, a + 1))])
    starts = np.array([(0.01, 1.0, -0.5), (-0.01, 1.0, -1.0), (0.0, 1.0, -0.2)])
    ends = roll(engine_over(engine, slot), spheres(ground(), max_time=5.0), 0.4, starts).deposits
    for x, outcome in zip(ends.x, ends.outcome, strict=True):
        assert outcome == Outcome.UNRESOLVED_CONTACT or x[2] > 0.4 - 1e-6


@pytest.mark.long
@BOTH
def test_without_a_ground_model_a_sphere_stops_by_its_speed_alone(engine):
    over = engine_over(engine, floor(30.0, cells=3))
    for speed, outcome in ((0.2, Outcome.STOPPED), (9.0, Outcome.UNRESOLVED_CONTACT)):
        end = roll(over, spheres(ground(), on_ground=NoGround()), 0.5, (0.0, 0.3, 2.0), (speed, 0.0, 0.0)).deposits
        assert end.outcome[0] == outcome


@BOTH
def test_a_ball_that_loses_nothing_bounces_as_high_as_it_fell(engine):
    over = engine_over(engine, floor(30.0))
    model = CoulombSphere(0.0, 0.0)
    flights = roll(over, spheres(ground(1.0), model, max_impacts=20), 0.5, (1.0, 2.0, 3.5))
    assert flights.deposits.outcome[0] == Outcome.MAX_IMPACTS
    assert flights.impacts.t[1] - flights.impacts.t[0] == pytest.approx(2.0 * math.sqrt(6.0 / G), rel=1e-9)


@pytest.mark.parametrize("across", [1e-3, 0.03, 0.5])
@pytest.mark.parametrize("slip", [0.05, 0.2, 5.0])
def test_friction_pushes_a_skidding_sphere_at_most_as_far_across_as_gravity(slip, across):
    """Over the whole segment, most of the gravity across is left: friction never turns its direction round."""
    down, mu, push = np.array([4.887, across, 0.0]), 0.1763, 8.506
    piece = sphere_ground.rolling_piece(
        (9.0, 0.0, 0.0), (slip, 0.0, 0.0), (0.0, 0.0, 1.0), tuple(down), push, ground(mu=mu, mu_r=0.2), 1.5
    )
    assert 0.5 * across < piece.a[1] <= across
    assert piece.a[0] == pytest.approx(down[0] - mu * push, rel=3e-3)
