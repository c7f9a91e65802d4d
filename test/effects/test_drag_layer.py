"""Tests of the drag layer of a forest: closed forms of the fall within it, its borders, both engines."""

import dataclasses
import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, loses_energy
from flights.scenes_of_facets import ENGINES, engine_over, flight, floor, rough_grid, same_bits, surface

from rpf3d_core.effects.drag import Drag
from rpf3d_core.effects.drag_layer import DragLayer
from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.values import ZERO

G = 9.81
MASS = 800.0
EVERYWHERE = np.empty((0, 4))
CORNERS = np.array([[0.0, -50.0], [50.0, -50.0], [50.0, 50.0], [0.0, 50.0]])
EAST = np.concatenate([CORNERS, np.roll(CORNERS, -1, axis=0)], axis=1)
"""Edges (N, 4) m of the outline 0 < x < 50, |y| < 50: x, y of both ends."""


def layer(
    coefficient: float = 500.0, height: float = 30.0, accuracy: float = 0.01, edges: np.ndarray = EVERYWHERE
) -> DragLayer:
    return DragLayer(coefficient, height, accuracy, G, edges)


def in_forest(*effects: object, model: str = "none", R_n: float = 0.5, R_t: float = 0.8, **settings: float) -> Flight:
    physics = flight(surface(R_n, R_t), model, **settings)
    return dataclasses.replace(physics, models=physics.models._replace(effects=chain_of(effects)))


def throw(engine: Engine, physics: Flight, x: tuple | list, v: tuple, mass: float = MASS) -> Flights:
    places = np.atleast_2d(np.array(x, dtype=float))
    speeds = np.ascontiguousarray(np.broadcast_to(np.array(v, dtype=float), places.shape))
    numbers, ones = np.arange(len(places)), np.ones(len(places))
    return fly_ensemble(engine, physics, Releases(0 * numbers, numbers, places, speeds, mass * ones, 0.4 * ones))


@pytest.mark.long
@BOTH
@pytest.mark.parametrize("accuracy", [0.1, 1e-3])
def test_a_throw_within_the_layer_follows_the_closed_form(engine, accuracy):
    """With q = c / m: x = v_x (1 - e^-qt) / q and z = z_0 - g t / q + (v_z + g / q) (1 - e^-qt) / q."""
    q, t, v = 500.0 / MASS, 1.5, (9.0, 4.0, 3.0)
    physics = in_forest(layer(accuracy=accuracy), max_time=t)
    end = throw(engine_over(engine, floor(50.0)), physics, (0.3, 0.2, 20.0), v).deposits.x[0]
    gone = (1.0 - math.exp(-q * t)) / q
    exact = (0.3 + v[0] * gone, 0.2 + v[1] * gone, 20.0 - G * t / q + (v[2] + G / q) * gone)
    assert np.linalg.norm(end - exact) <= accuracy


@pytest.mark.parametrize("mass", [1.0, 10.0, 100.0])
def test_a_rock_that_the_layer_all_but_holds_sinks_as_the_closed_form_says_with_no_more_stretches_than_it_takes(mass):
    """Speeds decay within m / c, so in a dense layer no time step is shorter than the accuracy of places requires."""
    q, t, v_x, accuracy = 500.0 / mass, 0.5, 9.0, 0.01
    physics = in_forest(layer(accuracy=accuracy), max_time=t)
    flights = throw(engine_over("reference", floor(50.0)), physics, (0.3, 0.2, 20.0), (v_x, 0.0, 0.0), mass)
    gone = (1.0 - math.exp(-q * t)) / q
    exact = (0.3 + v_x * gone, 0.2, 20.0 - G * t / q + G / q * gone)
    assert np.linalg.norm(flights.deposits.x[0] - exact) <= accuracy
    assert len(flights.paths.t) < 50.0 + 6.0 * q * t


@BOTH
def test_above_the_layer_a_rock_flies_free(engine):
    over = engine_over(engine, floor(50.0))
    free, above = (
        throw(over, in_forest(*effects, max_time=1.0), (0.3, 0.2, 40.0), (5.0, 0.0, 0.0))
        for effects in ((), (layer(height=30.0),))
    )
    assert above.deposits.x[0] == pytest.approx(free.deposits.x[0], abs=1e-12)


@BOTH
def test_a_rock_that_falls_into_the_layer_is_braked_from_there(engine):
    """A fall of 40 m through 30 m of forest ends slower than a free fall, faster than a fall through forest only."""
    over, x = engine_over(engine, floor(50.0)), (0.3, 0.2, 40.0)
    speeds = [throw(over, in_forest(layer(height=height)), x, ZERO).impacts.speed_in[0] for height in (0.0, 30.0, 50.0)]
    assert speeds[0] > speeds[1] > speeds[2]
    assert speeds[0] == pytest.approx(math.sqrt(2.0 * G * 40.0), rel=1e-12)


@BOTH
@pytest.mark.parametrize(("x", "braked"), [(-20.0, False), (20.0, True)])
def test_a_forest_brakes_where_it_stands(engine, x, braked):
    over = engine_over(engine, floor(50.0))
    speed = throw(over, in_forest(layer(edges=EAST)), (x, 0.3, 10.0), ZERO).impacts.speed_in[0]
    assert (speed < 0.95 * math.sqrt(2.0 * G * 10.0)) == braked


@BOTH
def test_light_rocks_are_braked_more(engine):
    over = engine_over(engine, floor(50.0))
    speeds = [throw(over, in_forest(layer()), (0.3, 0.2, 20.0), ZERO, mass).impacts.speed_in[0] for mass in (50.0, 9e3)]
    assert speeds[0] == pytest.approx(G * 50.0 / 500.0, rel=0.01)  # its terminal speed, g m / c
    assert speeds[1] > 0.9 * math.sqrt(2.0 * G * 20.0)


ROUGH = rough_grid(12, 40.0, 0.6, 0.6)
PLACES = [(1.0 + 0.3 * i, 18.0 + 0.2 * i, 4.0) for i in range(8)]


@pytest.mark.long
@BOTH
def test_a_layer_of_no_strength_leaves_every_bit_as_it_was(engine):
    over = engine_over(engine, ROUGH)
    free, none = (
        throw(over, in_forest(*effects, model="sliding"), PLACES, (6.0, 0.3, 2.0)) for effects in ((), (layer(0.0),))
    )
    assert same_bits(free, none)


@pytest.mark.long
def test_both_engines_have_the_same_bits_with_both_kinds_of_drag():
    effects = (Drag(0.5, 1.2, 0.01, G), layer(height=2.0, edges=EAST))
    physics = in_forest(*effects, model="sliding", R_n=0.8, R_t=0.95)
    one, other = (throw(engine_over(name, ROUGH), physics, PLACES, (6.0, 0.3, 2.0)) for name in ENGINES)
    assert same_bits(one, other)
    assert loses_energy(one)


@pytest.mark.parametrize("accuracy", [0.1, 1e-3])
def test_both_kinds_of_drag_together_are_as_accurate_as_either(accuracy):
    """A run with a tenth of the time step differs by at most the sum of both errors."""
    ends = [
        throw(
            engine_over("reference", floor(50.0)),
            in_forest(Drag(2.0, 1.2, share * accuracy, G), layer(accuracy=share * accuracy), max_time=1.5),
            (0.3, 0.2, 25.0), (20.0, 4.0, 3.0),
        ).deposits.x[0]
        for share in (1.0, 1e-2)
    ]  # fmt: skip
    assert np.linalg.norm(ends[0] - ends[1]) <= 2.0 * accuracy
