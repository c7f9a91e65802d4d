"""Tests that a rolling sphere gains no energy or spin: near the dip, around edges, without friction, and at a net."""

import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH
from flights.rolling_spheres import clearance, roll, spheres
from flights.scenes_of_facets import engine_over, joined, rough_grid, strip, terrain_of

from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Mode, Outcome

G, RADIUS = 9.81, 0.5


def on_the_slope(x: float, y: float, fall: float) -> np.ndarray:
    """Return the centre (3,) m of a sphere that lies on a plane with a fall along x (m per m in plan)."""
    return np.array([x, y, -fall * x]) + RADIUS * np.array([fall, 0.0, 1.0]) / math.hypot(1.0, fall)


def energies(batch) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Return the total energy (N,) J/kg at the start of each path segment of one sphere."""
    v, w, z = batch.pieces[:, 4:7], batch.pieces[:, 10], batch.pieces[:, 3]
    return np.asarray(0.5 * (v**2).sum(1) + 0.2 * RADIUS**2 * w**2 + G * z)


def watched(engine: str, terrain, physics, x, v):  # type: ignore[no-untyped-def]
    """Fly one sphere; return its flights and the batch of its path segments."""
    batches = []

    def watch(batch, rocks):  # type: ignore[no-untyped-def]
        batches.append(batch)
        return np.zeros(len(batch.rows))

    return roll(engine_over(engine, terrain), physics, RADIUS, x, v, watch=watch, threads=1), batches[0]


@BOTH
@pytest.mark.parametrize("degrees", [0.0, 1e-4, 0.01, 0.1, 0.5, 1.0, 2.0, 3.0])
def test_rolling_friction_stops_a_sphere_at_any_small_angle_to_the_dip(engine, degrees):
    """The path is nearly as long as straight down the dip, where the direction of friction is constant."""
    fall, speed = 0.16, 5.0
    angle, slope = math.radians(degrees), math.atan(fall)
    dip, strike = np.array([math.cos(slope), 0.0, -math.sin(slope)]), np.array([0.0, 1.0, 0.0])
    x, physics = on_the_slope(50.0, 150.0, fall), spheres(Surface(0.3, 0.8, 1.0, 0.05, 0.3), max_time=600.0)
    v = speed * np.stack([dip, math.cos(angle) * dip + math.sin(angle) * strike])
    flights = roll(engine_over(engine, rough_grid(1, 400.0, fall, 0.0)), physics, RADIUS, np.stack([x, x]), v)
    straight, path = flights.deposits.path
    assert (flights.deposits.outcome == Outcome.STOPPED).all()
    assert path == pytest.approx(straight, rel=0.01)
    assert flights.deposits.max_speed.max() == pytest.approx(speed)


@BOTH
@pytest.mark.parametrize("degrees", [5.0, 12.0, 25.0])
@pytest.mark.parametrize("mu", [0.18, 0.25])
def test_a_sphere_that_turns_on_a_steep_slope_goes_down_it(engine, mu, degrees):
    """Friction does not hold the sphere: it comes down with g sin - mu g cos, also if it first moved uphill.

    degrees : angle of the velocity to straight uphill; at the turn, the resistance is lower than on the way up
    """
    fall, angle, ends = 0.3, math.radians(degrees), 3.0
    slope = math.atan(fall)
    uphill, strike = np.array([-math.cos(slope), 0.0, math.sin(slope)]), np.array([0.0, 1.0, 0.0])
    x, v = on_the_slope(50.0, 50.0, fall), 0.06 * (math.cos(angle) * uphill + math.sin(angle) * strike)
    physics = spheres(Surface(0.3, 0.8, mu, 0.05, 0.6), max_time=ends)
    flights, batch = watched(engine, rough_grid(1, 100.0, fall, 0.0), physics, x, v)
    assert np.diff(energies(batch)).max() < 1e-9, "J/kg"
    down = G * (math.sin(slope) - mu * math.cos(slope)) * ends
    assert np.linalg.norm(flights.paths.v_end[-1]) == pytest.approx(down, rel=0.03)
    assert flights.paths.v_end[-1, 2] < 0.0


@BOTH
@pytest.mark.parametrize("speed", [1.0, 3.0, 10.0])
def test_a_sphere_that_tips_over_an_edge_while_it_rolls_along_it_gains_no_energy(engine, speed):
    """The spin about the normal grows while the speed along the edge falls, as for a ball on a cylinder of radius 0."""
    terrain = strip([(-10.0, 0.0), (0.0, 0.0), (1e-3, -20.0), (40.0, -20.0)], half_width=60.0)
    physics = spheres(Surface(0.0, 0.8, 1.0, 0.0, 0.0), max_time=12.0)
    _, batch = watched(engine, terrain, physics, (-0.6, -50.0, RADIUS), (0.15, speed, 0.0))
    total, x = energies(batch), batch.pieces[:, 1]
    edge = int(np.flatnonzero(x >= 0.0)[0])
    leaves = next(i for i in range(edge, len(x)) if batch.modes[i] == Mode.FLIGHT)
    assert total[edge : leaves + 1].max() < total[edge] * (1.0 + 1e-3)
    assert batch.pieces[leaves, 5] == pytest.approx(exact_speed_along(batch.pieces[edge]), rel=0.03)


def exact_speed_along(piece: np.ndarray) -> float:
    """Return the speed (m/s) along the edge at which a sphere leaves the edge, by small steps of its motion.

    piece : path segment at the start of the turn about the edge. Equations of motion until the edge carries no force:

    du/dt = 2/7 R w_n dphi/dt,  dw_n/dt = -u/R dphi/dt,  d2phi/dt2 = 5/7 g/R sin(phi)
    """
    phi, rate, along, about, dt = 0.0, math.hypot(piece[4], piece[6]) / RADIUS, float(piece[5]), 0.0, 1e-5
    while G * math.cos(phi) > RADIUS * rate * rate:
        along, about = along + 2.0 / 7.0 * RADIUS * about * rate * dt, about - along / RADIUS * rate * dt
        rate += 5.0 / 7.0 * G / RADIUS * math.sin(phi) * dt
        phi += rate * dt
    return along


@BOTH
@pytest.mark.parametrize("reach", [0.05, 0.2])
def test_a_sphere_that_tips_over_an_edge_comes_to_a_wall_as_it_passes_this_place_without_the_wall(engine, reach):
    """At the wall, the centre is one radius from the edge and from the wall; only the edge turns normal and spin.

    reach : distance (m) of the centre beyond the edge when the sphere touches the wall
    """
    slope = strip([(-10.0, 0.0), (0.0, 0.0), (20.0, -11.5)], half_width=30.0)
    wall = strip([(reach + RADIUS, -1.0), (reach + RADIUS + 1e-6, 5.0)], half_width=30.0)
    physics, start = spheres(Surface(0.0, 0.8, 1.0, 0.0, 0.0), max_time=4.0), (-0.3, -25.0, RADIUS)
    free, stopped = (roll(engine_over(engine, terrain), physics, RADIUS, start, (0.6, 5.0, 0.0))
                     for terrain in (slope, joined(slope, wall)))  # fmt: skip
    assert stopped.impacts.facet[0] == len(slope.triangles), "the wall"
    passing = float(np.interp(reach, free.paths.x[:, 0], np.linalg.norm(free.paths.v, axis=1)))
    assert stopped.impacts.speed_in[0] == pytest.approx(passing, rel=0.01)


@BOTH
def test_a_sphere_whose_slip_has_turned_gains_no_energy_when_it_begins_to_roll(engine):
    """On rough ground, spheres skid in a direction that turns; when they start to roll, friction removes the rest."""
    slope, physics = rough_grid(30, 60.0, 0.3, 0.4, seed=3), spheres(Surface(0.2, 0.8, 0.25, 0.0, 0.0))
    for number in (0, 3, 18):
        random = np.random.default_rng([3, number])
        x, v = (5.0, random.uniform(10.0, 50.0), 4.0), (random.uniform(0.0, 9.0), random.uniform(-6.0, 6.0), 0.0)
        _, batch = watched(engine, slope, physics, x, v)
        on_ground = (batch.modes[:-1] == Mode.SLIDING) & (batch.modes[1:] == Mode.SLIDING)
        assert np.diff(energies(batch))[on_ground].max() < 1e-9, "J/kg"


@BOTH
def test_without_friction_a_sphere_never_spins(engine):
    """The sphere skids up a slope of several facets and down again."""
    physics = spheres(Surface(0.0, 0.8, 0.0, 0.0, 0.0), max_time=30.0)
    _, batch = watched(
        engine, rough_grid(10, 100.0, 0.2, 0.0), physics, on_the_slope(60.0, 50.0, 0.2), (-12.0, 0.0, 2.4)
    )
    assert batch.pieces[:, 10].max() == 0.0
    np.testing.assert_allclose(energies(batch), energies(batch)[0], atol=1e-6)


@BOTH
def test_a_sphere_meets_an_edge_only_where_the_edge_is(engine):
    """The sphere bounces along the ridge of a roof; beyond the end of the ridge it must fall to the floor."""
    roof = [(x, y, -abs(y) / 0.6) for x in (0.0, 10.0) for y in (-6.0, 0.0, 6.0)]
    floor = [(40.0, -6.0, -12.0), (40.0, 6.0, -12.0)]
    terrain = terrain_of(roof + floor, [(0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (3, 6, 7), (3, 7, 5)])
    over, physics = engine_over(engine, terrain), spheres(Surface(0.9, 0.8, 0.3, 0.05, 0.0), max_time=20.0)
    flights = roll(over, physics, RADIUS, (7.0, 0.0, 1.5), (6.0, 0.0, 0.0))
    places = flights.impacts.x[flights.impacts.facet >= 0]
    assert len(places) >= 3
    np.testing.assert_allclose(clearance(over, places), RADIUS, atol=1e-6)


@BOTH
@pytest.mark.parametrize("height", [5.0, 30.0])
@pytest.mark.parametrize("centre", [0.05, 0.3, 0.49])
def test_a_sphere_released_in_a_wall_is_moved_off_it_and_not_up_it(engine, height, centre):
    terrain = strip([(-20.0, height), (0.0, height), (0.0, 0.0), (20.0, 0.0)], half_width=20.0)
    over = engine_over(engine, terrain)
    flights = roll(over, spheres(Surface(0.3, 0.8, 0.6, 0.05, 0.05), max_time=0.01), RADIUS, (centre, 0.3, 0.501))
    released = flights.paths.x[0]
    assert released[2] == pytest.approx(0.501, abs=1e-9)
    np.testing.assert_allclose(clearance(over, released[None]), RADIUS, atol=2e-3)
