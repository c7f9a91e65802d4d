"""Tests on rough ground: runs are bitwise reproducible, and small shifts of the releases do not change statistics.

Facets are flat. If two rocks meet the same facets in the same order, their distance grows by a factor that depends only
on the path, however small the distance is. They separate for good only if one of them meets another facet or bounces
again. This needs a distance of a share of a facet, or a rare coincidence. So a shift of a picometre stays in the
order of picometres; a shift of a decimetre, the accuracy of surveys and sources, sends half of the rocks elsewhere.
"""

from functools import cache

import numpy as np
import pytest
from flights.on_both_engines import BOTH
from flights.scenes_of_facets import ENGINES, engine_over, flight, fly, same_bits, surface

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain
from rpf3d_core.values import Outcome

HAIR = 1e-12
"""Shift (m) of the order of rounding errors; the contact tolerance of this pit is 1e-9 m."""
HAND = 0.1
"""Shift (m) that is within the accuracy of a survey."""
PHYSICS = flight(surface(0.5, 0.8, 35.0))
MANY = {"reference": 40, "compiled": 4000}
"""Number of rocks for each engine: the reference engine flies only about 50 rocks per second here."""


@cache
def rough() -> Terrain:
    """Return a small rough pit with six benches and facets of about 2 m."""
    whole = pit_terrain(
        Pit(triangles=200_000, waste_benches=6, ore_benches=0, floor_radius=120.0, crest_altitude=72.0, roughness=0.5)
    )
    return Terrain(whole.vertices, whole.triangles, np.zeros_like(whole.zone), ("ground",), whole.frame)


@cache
def flown(engine: str, count: int, shift: float) -> Flights:
    """Return `flown_over` for the pit and a new engine, cached."""
    return flown_over(engine_over(engine, rough()), count, shift)


def flown_over(over: Engine, count: int, shift: float) -> Flights:
    """Fly rocks that are thrown inwards from a ring above the benches; shift : displacement (m) of releases to +x."""
    draw = np.random.default_rng(1)
    a, r = draw.uniform(0, 2 * np.pi, count), draw.uniform(0.55, 0.62, count)
    low, high = rough().vertices.min(0), rough().vertices.max(0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    ring = middle[0] + r * half[0] * np.cos(a), middle[1] + r * half[1] * np.sin(a)
    x = np.stack([*ring, np.full(count, high[2] + 9.0)], 1)
    x[:, 0] += shift
    v = np.stack([-6 * np.cos(a), -6 * np.sin(a), 0 * a], 1)
    return fly(over, PHYSICS, x, v)


def growth(engine: str, shift: float) -> np.ndarray:
    """Return (R,) for each rock the distance between its end and that of the shifted rock, over the shift (m)."""
    one, other = (flown(engine, MANY[engine], by).deposits for by in (0.0, shift))
    return np.linalg.norm(one.x - other.x, axis=1) / shift


@BOTH
def test_a_run_on_rough_ground_is_repeated_to_the_last_bit(engine):
    over = engine_over(engine, rough())
    first, second = (flown_over(over, 30, 0.0) for _ in range(2))
    assert same_bits(first, second)


def test_both_engines_agree_to_the_last_bit_on_rough_ground():
    assert same_bits(*(flown_over(engine_over(engine, rough()), 40, 0.0) for engine in ENGINES))


@BOTH
def test_a_shift_of_a_picometre_grows_by_a_small_factor_on_the_way(engine):
    """`pytest -s` prints the figures of README.md."""
    factors = growth(engine, HAIR)
    print(f"{engine}: growth of {HAIR:g} m, percentiles 50, 90, 99, 100:", np.percentile(factors, [50, 90, 99, 100]))
    assert 0.1 < np.median(factors) < 10.0
    assert np.percentile(factors, 90) < 100.0


@BOTH
def test_the_growth_of_a_nanometre_is_that_of_a_picometre(engine):
    """The growth depends on the path only: 1e-12, 1e-9 and 1e-6 m grow alike, apart from rounding at 1e-12 m."""
    hair, wider, wide = (np.median(growth(engine, shift)) for shift in (HAIR, 1e-9, 1e-6))
    assert wider == pytest.approx(wide, rel=1e-3)
    assert hair == pytest.approx(wide, rel=0.1)


@BOTH
def test_a_shift_of_a_decimetre_sends_a_large_part_of_the_rocks_elsewhere(engine):
    apart = growth(engine, HAND) * HAND
    print(f"{engine}: {HAND} m of shift, {np.mean(apart > 1.0):.0%} end over 1 m apart, at most {apart.max():.0f} m")
    assert np.mean(apart > 1.0) > 0.25


@BOTH
@pytest.mark.parametrize("shift", [HAIR, HAND])
def test_statistics_do_not_tell_the_shifted_rocks_from_the_others(engine, shift):
    """Means and shares differ by no more than four standard errors of two independent runs."""
    count = MANY[engine]
    one, other = (flown(engine, count, by).deposits for by in (0.0, shift))
    for name in ("path", "t", "max_speed"):
        a, b = getattr(one, name), getattr(other, name)
        assert abs(a.mean() - b.mean()) <= 4 * np.sqrt((a.var() + b.var()) / count), name
    a, b = (np.mean(ends.outcome == Outcome.STOPPED) for ends in (one, other))
    assert abs(a - b) <= 4 * np.sqrt(0.5 / count)
