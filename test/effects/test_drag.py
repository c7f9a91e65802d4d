"""Tests of quadratic air drag: exact cases, order and size of the splitting error, energy, both engines."""

import dataclasses
import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, loses_energy
from flights.scenes_of_facets import (
    ENGINES,
    box,
    engine_over,
    flight,
    floor,
    fly,
    incline,
    rough_grid,
    same_bits,
    surface,
)
from hazards.hazard_tallied import numbers, over, rocks_above, rough
from scenes.small_pit import scene_file

from rpf3d_core.effects.air_step import FLIGHT
from rpf3d_core.effects.drag import Drag, drag_per_metre
from rpf3d_core.effects.hooks import chain_of, in_air, longest_flight
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare, releases_in_ranges
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.values import ZERO, Motion, Outcome, Rock

G = 9.81
STONE = Rock(0.9, 0.043)
"""A stone of 9 cm and 2,700 kg/m3, which air slows noticeably."""
BOULDER = Rock(1413.7, 0.5)

ON_EDGES = 5e-3
"""Largest share of passages over facets that differ by rounding: bounces within a nanosecond of an edge."""


def drag(coefficient: float = 0.5, accuracy: float = 0.01) -> Drag:
    return Drag(coefficient, 1.2, accuracy, G)


def with_drag(
    effect: Drag | None, model: str = "none", R_n: float = 0.5, R_t: float = 0.8, **settings: float
) -> Flight:
    physics = flight(surface(R_n, R_t), model, **settings)
    effects = None if effect is None else chain_of([effect])
    return dataclasses.replace(physics, models=physics.models._replace(effects=effects))


def in_pit(flight: Flight, effect: Drag) -> Flight:
    """Return the physics of a flight with the effect `Drag`, ending at the first impact."""
    models, settings = flight.models._replace(effects=chain_of([effect])), flight.settings._replace(max_impacts=1)
    return dataclasses.replace(flight, models=models, settings=settings)


def throw(engine: Engine, physics: Flight, rock: Rock, x: tuple, v: tuple) -> Flights:
    """Fly rocks of one size from x (3,) or (R, 3) m with velocity v (3,) or (R, 3) m/s."""
    places = np.atleast_2d(np.array(x, dtype=float))
    speeds = np.ascontiguousarray(np.broadcast_to(np.array(v, dtype=float), places.shape))
    numbers, ones = np.arange(len(places)), np.ones(len(places))
    releases = Releases(0 * numbers, numbers, places, speeds, rock.mass * ones, rock.radius * ones)
    return fly_ensemble(engine, physics, releases)


def followed(k: float, x: tuple, v: tuple, t: float, step: float = 1e-3) -> tuple[np.ndarray, np.ndarray]:
    """Return position (3,) m and velocity (3,) m/s after t seconds of flight with drag k (1/m), by Runge-Kutta."""

    def change(y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[3:], -k * np.linalg.norm(y[3:]) * y[3:] - (0.0, 0.0, G)])

    y, steps = np.array([*x, *v], dtype=float), max(1, math.ceil(t / step))
    h = t / steps
    for _ in range(steps):
        a = change(y)
        b = change(y + 0.5 * h * a)
        c = change(y + 0.5 * h * b)
        y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + change(y + h * c))
    return y[:3], y[3:]


def test_drag_is_half_rho_c_area_over_mass():
    """k = 1.2 * 0.5 * pi * 0.25 / (2 * 1413.7) = 1.6667e-4 1/m."""
    assert drag_per_metre(drag(), BOULDER) == pytest.approx(1.6667e-4, rel=1e-4)


@pytest.mark.parametrize("t", [0.0, 0.3, 40.0])
def test_the_air_alone_brakes_as_its_equation_says(t):
    """The speed follows 1/v = 1/v0 + k t, and the direction stays the same."""
    v, rock = (3.0, -4.0, 12.0), RockContext(STONE, None, 0)
    after = in_air(drag(), Motion(1.0, (1.0, 2.0, 3.0), v, (0.0, 5.0, 0.0)), 0.0, t, rock)
    speed = 1.0 / (1.0 / 13.0 + drag_per_metre(drag(), STONE) * t)
    assert after.v == pytest.approx(tuple(c * speed / 13.0 for c in v), rel=1e-15)
    assert (after.t, after.x, after.w) == (1.0, (1.0, 2.0, 3.0), (0.0, 5.0, 0.0))


FALLS = [(STONE, (12.0, 5.0, 8.0)), (STONE, ZERO), (BOULDER, (20.0, 0.0, -15.0)), (Rock(1e-4, 0.002), (9.0, 0.0, 9.0))]
FALL_IDS = ["stone-thrown", "stone-dropped", "boulder", "grain"]


def places_after(engine: str, effect: Drag, rock: Rock, v: tuple, t: float) -> np.ndarray:
    """Return the position (3,) m, after t seconds, of a rock that is thrown high above the ground."""
    over = engine_over(engine, floor(500.0))
    end = throw(over, with_drag(effect, max_time=t), rock, (0.3, 0.2, 400.0), v).deposits
    assert end.outcome[0] == Outcome.MAX_TIME
    return end.x[0]


@pytest.mark.long
@BOTH
@pytest.mark.parametrize(("rock", "v"), FALLS, ids=FALL_IDS)
@pytest.mark.parametrize("accuracy", [1.0, 0.01, 1e-4])
def test_a_flight_is_as_accurate_as_it_was_asked_for(engine, rock, v, accuracy):
    k = drag_per_metre(drag(), rock)
    for t in (0.2 * FLIGHT, FLIGHT):
        exact, _ = followed(k, (0.3, 0.2, 400.0), v, t)
        assert np.linalg.norm(places_after(engine, drag(0.5, accuracy), rock, v, t) - exact) <= accuracy


@pytest.mark.parametrize(("rock", "v"), FALLS[:3], ids=FALL_IDS[:3])
def test_the_error_falls_as_the_square_of_the_stretch(rock, v):
    """The time step is proportional to the root of `accuracy`; a hundredth of `accuracy` gives 1 % of the error."""
    exact, _ = followed(drag_per_metre(drag(), rock), (0.3, 0.2, 400.0), v, FLIGHT)
    coarse, fine = (
        np.linalg.norm(places_after("reference", drag(0.5, accuracy), rock, v, FLIGHT) - exact)
        for accuracy in (1e-1, 1e-3)
    )
    assert coarse / fine > 60.0


@BOTH
def test_a_stone_that_falls_long_enough_has_its_terminal_speed(engine):
    """The terminal speed is sqrt(g / k)."""
    k = drag_per_metre(drag(2.0), STONE)
    over = engine_over(engine, floor(500.0))
    physics = with_drag(drag(2.0), max_time=40.0)
    flights = throw(over, physics, STONE, (0.3, 0.2, 4000.0), (3.0, 0.0, 0.0))
    assert flights.deposits.max_speed[0] == pytest.approx(math.sqrt(G / k), rel=1e-3)


@BOTH
def test_a_fall_from_rest_meets_the_ground_when_and_as_fast_as_the_closed_form_says(engine):
    """The closed form is h(t) = ln cosh(sqrt(g k) t) / k and v^2 = g / k (1 - exp(-2 k h))."""
    k, height = drag_per_metre(drag(), STONE), 60.0
    over = engine_over(engine, floor(50.0))
    impacts = throw(over, with_drag(drag(0.5, 1e-4)), STONE, (0.3, 0.2, height), ZERO).impacts
    t = math.acosh(math.exp(k * height)) / math.sqrt(G * k)
    assert impacts.t[0] == pytest.approx(t, abs=1e-4 / 30.0)
    assert impacts.speed_in[0] == pytest.approx(math.sqrt(G / k * (1.0 - math.exp(-2.0 * k * height))), rel=1e-5)


@pytest.mark.long
@BOTH
@pytest.mark.parametrize("effect", [Drag(0.0, 1.2, 0.01, G), Drag(0.5, 0.0, 0.01, G)], ids=["no-C_d", "no-density"])
def test_drag_of_no_strength_leaves_every_bit_as_it_was(engine, effect):
    over = engine_over(engine, rough_grid(12, 40.0, 0.6, 0.6))
    x = [(1.0 + 0.3 * i, 18.0 + 0.2 * i, 4.0) for i in range(12)]
    calm, still = (throw(over, with_drag(e, "sliding"), STONE, x, (4.0, 0.3, 0.0)) for e in (None, effect))
    assert same_bits(calm, still)
    assert longest_flight(effect, Motion(0.0, ZERO, (9.0, 0.0, 0.0), ZERO), RockContext(STONE, None, 0)) == math.inf


TERRAINS = {
    "rough": (rough_grid(12, 40.0, 0.6, 0.6), [(1.0 + 0.3 * i, 18.0 + 0.2 * i, 4.0) for i in range(12)]),
    "box": (box(), [(0.5 * i - 2.0, 0.3, 4.0 + 0.2 * i) for i in range(8)]),
    "incline": (incline(35.0, cells=(9, 3)), [(0.5 * i, 0.3, 5.0) for i in range(8)]),
}


@pytest.mark.parametrize("terrain", TERRAINS)
@pytest.mark.parametrize("accuracy", [1.0, 1e-3])
def test_both_engines_have_the_same_bits(terrain, accuracy):
    ground, x = TERRAINS[terrain]
    physics = with_drag(drag(1.0, accuracy), "sliding", 0.8, 0.95)
    one, other = (throw(engine_over(name, ground), physics, STONE, x, (9.0, 3.0, 4.0)) for name in ENGINES)
    assert same_bits(one, other)


@BOTH
@pytest.mark.parametrize("terrain", TERRAINS)
@pytest.mark.parametrize("accuracy", [10.0, 0.02])
def test_air_takes_energy_and_never_gives_any(engine, terrain, accuracy):
    ground, x = TERRAINS[terrain]
    physics = with_drag(drag(2.0, accuracy), "sliding", 1.0, 1.0, max_time=6.0)
    over = engine_over(engine, ground)
    for rock in (STONE, Rock(1e-4, 0.002)):
        assert loses_energy(throw(over, physics, rock, x, (9.0, 3.0, 4.0)))
        assert loses_energy(throw(over, physics, rock, x, ZERO))


@BOTH
def test_a_short_fall_is_slower_with_air_than_without(engine):
    """The fall ends in the first half of a time step, where undoing half of the drag would make the rock faster."""
    over = engine_over(engine, floor())
    calm, braked = (
        throw(over, with_drag(effect), STONE, (0.3, 0.2, 0.05), ZERO).impacts.speed_in[0]
        for effect in (None, drag(1.0, 10.0))
    )
    assert braked < calm
    assert braked == pytest.approx(calm, rel=1e-3)


@BOTH
def test_stretches_end_in_mid_air_and_count_as_no_impacts(engine):
    over = engine_over(engine, floor(50.0))
    flights = throw(over, with_drag(drag(0.5, 1e-3), max_impacts=1), STONE, (0.3, 0.2, 60.0), ZERO)
    assert len(flights.paths.t) > 10
    assert flights.deposits.impacts[0] == 1


def test_maps_count_a_rock_once_however_many_stretches_its_flight_has():
    """The air is too thin to change a passage, but the accuracy is so fine that flights still have many time steps."""
    terrain, thin = rough(), Drag(1e-9, 1.2, 1e-17, G)
    x, v = rocks_above(60)
    pieces, maps = [], []
    for effect in (None, thin):
        tallies = over(terrain)
        physics = with_drag(effect, "sliding", 0.6, 0.85)
        flights = fly(engine_over("compiled", terrain), physics, x, v, watch=tallies)
        pieces.append(len(flights.paths.t))
        maps.append(dict(numbers(tallies.maps(60, ()))))
    assert pieces[1] > 3 * pieces[0]
    passages = [counted.pop("facets.passages.") for counted in maps]
    assert np.abs(passages[1] - passages[0]).sum() <= ON_EDGES * passages[0].sum()
    for name, counted in maps[0].items():
        assert maps[1][name] == pytest.approx(counted, rel=1e-6, abs=1e-6, nan_ok=True), name


@pytest.mark.long
def test_flights_into_a_pit_are_as_accurate_as_they_were_asked_for(tmp_path):
    """Compared with time steps about 30 times as short, no first impact differs by more than the accuracy."""
    prepared = prepare(read_scene(scene_file(tmp_path, more="rock: {diameter: 0.2}\nengine: reference")))
    releases = releases_in_ranges(prepared, [range(20), range(10)])
    impacts = [
        fly_ensemble(prepared.engine, in_pit(prepared.flight, drag(0.5, accuracy)), releases).impacts
        for accuracy in (0.01, 1e-5)
    ]
    assert len(impacts[0].t) == 30
    assert np.linalg.norm(impacts[0].x - impacts[1].x, axis=1).max() <= 0.01
    assert np.array_equal(impacts[0].facet, impacts[1].facet)
