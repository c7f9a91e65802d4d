"""Tests that effects and the rigid sphere never leave a rock stuck, hovering without end, or faster than before."""

import dataclasses
import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, G, loses_energy
from flights.rolling_spheres import roll, spheres
from flights.scenes_of_facets import down_the_slope, engine_over, flight, floor, fly, incline, surface

from rpf3d_core.effects.drag import Drag
from rpf3d_core.effects.drag_layer import DragLayer
from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.effects.roughness import RocfallRoughness
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.materials.library import Surface
from rpf3d_core.simulation.march import STRETCHES
from rpf3d_core.values import ZERO, Outcome

ROUGH = RocfallRoughness(0.14)
ROLLED = 1e-6
"""Largest error (m) over 40 m of rolling: corrections of the centre's distance, each about 1e-9 m, add up."""


def over_ground(effect: object, R_n: float, R_t: float, **settings: float) -> Flight:
    """Return the physics of a ground with one effect; without effects if `effect` is None."""
    physics = flight(surface(R_n, R_t), **settings)
    return dataclasses.replace(physics, models=physics.models._replace(effects=chain_of([effect] if effect else [])))


# --- rough ground -----------------------------------------------------------------------------------------------------


@BOTH
def test_rocks_that_come_in_flat_on_rough_ground_bounce_off_it_whichever_way_it_is_tilted(engine):
    """Rocks arrive at 3 degrees on ground tilted by up to 8: half of the tilts would send them into the ground."""
    x = np.array([(-100.0, 0.2 * k, 1e-3) for k in range(40)])
    paths = fly(engine_over(engine, floor(200.0)), over_ground(ROUGH, 0.5, 0.8), x, (20.0, 0.0, -1.0)).paths
    after = paths.v[np.searchsorted(paths.row, np.arange(len(x))) + 1]
    assert after[:, 2].min() > 0.0


@pytest.mark.parametrize("engine", ["reference"])
def test_rocks_that_skim_a_rough_floor_are_thrown_up_and_those_on_a_smooth_floor_settle(engine):
    """At 12 m/s along and 0.1 m/s into the floor, a bounce is 0.1 mm high; a tilt of 1 degree adds 0.2 m/s normal."""
    over, v = engine_over(engine, floor(400.0)), (12.0, 0.0, -0.1)
    x = np.array([(-300.0, 0.3 + k, 1e-4) for k in range(20)])
    ups = []
    for effect in (None, ROUGH):
        physics = over_ground(effect, 0.5, 0.8)
        flights = fly(over, physics, x, v)
        assert np.all(flights.deposits.outcome == Outcome.STOPPED)
        ups.append(np.array([flights.paths.v[flights.paths.row == k, 2].max() for k in range(len(x))]))
    assert np.all(ups[0] < 0.1) and np.sum(ups[1] > 0.5) > 10


# --- air --------------------------------------------------------------------------------------------------------------


@BOTH
def test_air_gives_nothing_back_to_a_rock_that_lands_early_in_a_stretch(engine):
    """Bounces without loss in dense air; the accuracy allows time steps much longer than the bounces."""
    thick = Drag(2.0, 60.0, 10.0, G)
    physics = over_ground(thick, 1.0, 1.0, max_impacts=20)
    flights = fly(engine_over(engine, floor(50.0)), physics, (0.0, 0.3, 0.2), (9.0, 0.0, 0.0))
    assert len(flights.impacts.t) == 20 and loses_energy(flights)


def test_a_rock_that_hovers_comes_to_an_end_that_says_so():
    """A rock of 1 kg in a layer of 500 kg/s sinks at 2 cm/s in steps of 1 ms: 25 min and 1.5 million steps for 30 m."""
    physics = over_ground(DragLayer(500.0, 30.0, 0.01, G, np.empty((0, 4))), 0.5, 0.8, max_impacts=50, max_time=20.0)
    one, none = np.ones(1), np.zeros(1, dtype=np.int64)
    release = Releases(none, none, np.array([(0.3, 0.2, 20.0)]), np.array([ZERO]), one, 0.4 * one)
    flights = fly_ensemble(engine_over("reference", floor(50.0)), physics, release)
    assert flights.deposits.outcome[0] == Outcome.MAX_IMPACTS
    assert len(flights.paths.t) <= STRETCHES + 2
    assert 19.0 < flights.deposits.x[0, 2] < 20.0


# --- the sphere -------------------------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("angle", [22.0, 40.0])
def test_a_sphere_that_slips_over_the_edges_in_a_plane_feels_none_of_them(engine, angle):
    """With mu = 0.1 the sphere slips with a = g (sin - mu cos), without an impact, as long as it is on the plane."""
    descent, n = down_the_slope(angle, 37.0)
    t = math.sqrt(2.0 * 40.0 / (G * (math.sin(math.radians(angle)) - 0.1 * math.cos(math.radians(angle)))))
    over = engine_over(engine, incline(angle, 37.0, cells=(5, 3)))
    flights = roll(over, spheres(Surface(0.3, 0.8, 0.1, 0.3, 0.0), max_time=t), 0.5, descent + 0.5 * n)
    assert len(flights.impacts.t) == 0
    assert (flights.deposits.x[0] - descent - 0.5 * n) @ descent == pytest.approx(40.0, abs=ROLLED)
