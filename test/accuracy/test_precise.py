"""Tests of impacts followed with 50 digits: against closed forms, and as the reference for the engines."""

from dataclasses import replace
from decimal import Decimal, localcontext
from pathlib import Path

import mpmath
import numpy as np
import pytest
from flights.scenes_of_facets import engine_over, flight, floor, fly, incline, rough_grid, surface
from scenes.small_pit import scene_file

from rpf3d_core.accuracy import flown
from rpf3d_core.accuracy.precise import RecordedImpact, impacts_in_digits, off_exact
from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.effects.roughness import RocfallRoughness
from rpf3d_core.materials.library import Surface
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.values import STANDARD_GRAVITY

CLOSE = mpmath.mpf(10) ** -45
"""Largest error (m and s) of impacts followed with 50 digits, after some digits are lost over eight impacts."""
DOUBLE = 2.0**-51
"""Largest error (s) of a time of up to 8 s that is rounded to float64."""
LAST_BIT = 1e-15
"""Largest relative error of a difference that is rounded once, at the end."""
EXACT_TO = 1e-11
"""Largest error (m) after a few impacts on a terrain of some tens of metres: rough ground amplifies rounding."""

IMPACTS = 5
"""Number of impacts of a rock that are followed by trying every facet; later bounces are small."""


class Case:
    """Stands in for a prepared scene; has only what `off_exact` uses."""

    def __init__(self, engine, physics) -> None:
        self.engine, self.flight = engine, physics


def series_on(facets, ground: Surface, x: tuple[float, float, float], impacts: int) -> list:
    """Return [(time s, place (3,) m)] of impacts of a rock dropped onto a plane, from the closed form with 60 digits.

    The slope is that of the facet's rounded corners: 40 degrees apart from rounding.
    """
    (ax, _, az), _, (bx, _, bz) = ([mpmath.mpf(float(c)) for c in corner] for corner in facets.corners[0].reshape(3, 3))
    run, fall = abs(bx - ax), abs(bz - az)
    sin, cos = fall / mpmath.hypot(run, fall), run / mpmath.hypot(run, fall)
    x0, y0, z0 = (mpmath.mpf(c) for c in x)
    z = az - (x0 - ax) * fall / run
    g, R_n, R_t = (mpmath.mpf(float(value)) for value in (STANDARD_GRAVITY, ground.R_n, ground.R_t))
    speed = mpmath.sqrt(2 * g * (z0 - z))
    t, s, u, w = speed / g, mpmath.mpf(0), R_t * speed * sin, R_n * speed * cos
    found = []
    for _ in range(impacts):
        found.append((t, (x0 + s * cos, y0, z - s * sin)))
        bounce = 2 * w / (g * cos)
        t, s, u, w = t + bounce, s + u * bounce + g * sin * bounce**2 / 2, R_t * (u + g * sin * bounce), R_n * w
    return found


def in_mpmath(value: Decimal) -> mpmath.mpf:
    return mpmath.mpf(str(value))


@pytest.mark.parametrize("angle", [0.0, 22.0, 40.0, 59.0])
def test_bounces_down_an_incline_are_those_of_the_geometric_series_to_45_digits(angle: float) -> None:
    facets, start, bounces = engine_over("compiled", incline(angle)).facets, (1.0, 0.5, 10.0), 8
    ground = Surface(0.5, 0.8, 0.5, 0.5)
    with mpmath.workdps(60):
        expected = series_on(facets, ground, start, bounces)
        times = [float(t) for t, _ in expected]
        recorded = [RecordedImpact(0, ground, t) for t in times]
        found = impacts_in_digits(facets, recorded, STANDARD_GRAVITY, start, (0.0, 0.0, 0.0))
        assert len(found) == bounces
        for impact, (t, place) in zip(found, expected, strict=True):
            assert abs(in_mpmath(impact.t) - t) < CLOSE
            assert max(abs(in_mpmath(a) - b) for a, b in zip(impact.x, place, strict=True)) < CLOSE
        off_doubles = [abs(in_mpmath(impact.t) - float(impact.t)) for impact in found]
        assert DOUBLE / 1000 < max(off_doubles) < DOUBLE, "no double holds these times"


def test_how_far_events_are_off_is_told_to_all_digits_of_a_double() -> None:
    # With Python's default of 28 digits, a difference of about 1e-16 m has only twelve correct digits.
    engine, physics = engine_over("compiled", incline(40.0)), flight(surface(R_n=0.5, R_t=0.8), "none")
    flights = fly(engine, physics, (1.0, 0.5, 10.0))
    off = off_exact(Case(engine, physics), flights, rocks=1)
    assert len(off) > 5
    with mpmath.workdps(60):
        for number, (t, place) in enumerate(series_on(engine.facets, Surface(0.5, 0.8, 0.5, 0.5), (1.0, 0.5, 10.0), 5)):
            gap = [mpmath.mpf(float(a)) - b for a, b in zip(flights.impacts.x[number], place, strict=True)]
            distance = float(mpmath.sqrt(sum(c * c for c in gap)))
            assert 0.0 < distance < EXACT_TO
            assert off[number].place_max == pytest.approx(distance, rel=LAST_BIT, abs=0.0)
            late = float(abs(mpmath.mpf(float(flights.impacts.t[number])) - t))
            assert off[number].time_max == pytest.approx(late, rel=LAST_BIT, abs=0.0)


def test_the_callers_decimal_numbers_keep_their_digits() -> None:
    engine, physics = engine_over("reference", incline(40.0)), flight(surface(), "none")
    flights = fly(engine, physics, (1.0, 0.5, 10.0))
    told = off_exact(Case(engine, physics), flights, rocks=1)
    with localcontext(prec=7):
        assert off_exact(Case(engine, physics), flights, rocks=1) == told, "and are not what is calculated with"
        assert str(Decimal(1) / 3) == "0.3333333"


def test_the_second_impact_on_an_incline_is_that_of_the_table() -> None:
    # by hand from the closed form: R_n 0.5, R_t 0.8, h 10 m, 40 degrees: after t = 1.427843 s and s = 16.712478 m
    facets = engine_over("compiled", incline(40.0)).facets
    ground = Surface(0.5, 0.8, 0.5, 0.5)
    start = ([1.0, 0.0, 10.0 - np.tan(np.radians(40.0))], [0.0, 0.0, 0.0])
    recorded = [RecordedImpact(0, ground, t) for t in (1.43, 2.86)]
    first, second = impacts_in_digits(facets, recorded, STANDARD_GRAVITY, *start)
    gap = [float(a - b) for a, b in zip(second.x, first.x, strict=True)]
    assert float(second.t - first.t) == pytest.approx(1.427843, abs=1e-6)
    assert np.linalg.norm(gap) == pytest.approx(16.712478, abs=1e-6)


def test_events_agree_with_50_digits_and_a_wrong_impact_is_told() -> None:
    engine, physics = engine_over("compiled", rough_grid(8, 24.0, 0.6, 0.4, seed=1)), flight(surface(), "none")
    x = np.random.default_rng(1).uniform((3, 6, 4), (6, 18, 8), (20, 3))
    flights = fly(engine, physics, x, (2.0, 0.0, 0.0))
    off = off_exact(Case(engine, physics), flights, rocks=20)
    assert off[0].impacts == 20 and len(off) > 3
    assert 0.0 < off[0].place_max < EXACT_TO and off[0].time_max < EXACT_TO
    assert max(one.place_median for one in off[:3]) < EXACT_TO
    wrong = replace(flights.impacts, x=flights.impacts.x + np.array([0.0, 0.0, 1e-6]))
    told = off_exact(Case(engine, physics), replace(flights, impacts=wrong), rocks=20)
    assert told[0].place_median == pytest.approx(1e-6, rel=1e-3)


def first_crossing(corners: list, x, v, g: Decimal, after: Decimal) -> tuple[Decimal, int]:
    """Return (time s, facet) of the first crossing, from above and after a time (s), of a parabola with a facet.

    corners : (F, 3, 3) m, tried one after another; the facet is -1 and the time infinite if there is none
    """
    found = (Decimal("Infinity"), -1)
    for f, (p, q, r) in enumerate(corners):
        u, w = ([b - a for a, b in zip(p, other, strict=True)] for other in (q, r))
        n = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]]
        b, c = sum(map(Decimal.__mul__, n, v)), sum(i * (j - k) for i, j, k in zip(n, x, p, strict=True))
        under_root = b * b + 2 * g * n[2] * c
        if under_root < 0:
            continue
        t = (b + under_root.sqrt()) / (g * n[2])  # all facets face up
        at = [x[0] + v[0] * t, x[1] + v[1] * t]
        sides = [(j[0] - i[0]) * (at[1] - i[1]) - (j[1] - i[1]) * (at[0] - i[0]) for i, j in ((p, q), (q, r), (r, p))]
        if after < t < found[0] and min(sides) >= 0:
            found = (t, f)
    return found


def test_in_exact_arithmetic_no_other_facet_is_met_before_the_one_that_events_met() -> None:
    engine, physics = engine_over("compiled", rough_grid(8, 24.0, 0.6, 0.4, seed=1)), flight(surface(), "none")
    x = np.random.default_rng(2).uniform((3, 6, 4), (6, 18, 8), (40, 3))
    flights, facets = fly(engine, physics, x, (2.0, 0.0, 0.0)), engine.facets
    corners = [[[Decimal(c) for c in p] for p in f] for f in facets.corners.reshape(-1, 3, 3).tolist()]
    g, ground = Decimal(STANDARD_GRAVITY), Surface(*(float(c[0]) for c in physics.materials))
    for row in range(len(x)):
        struck = np.flatnonzero(flights.impacts.row == row)[:IMPACTS]
        met, times = flights.impacts.facet[struck].tolist(), flights.impacts.t[struck].tolist()
        release = x[row].tolist(), [2.0, 0.0, 0.0]
        recorded = [RecordedImpact(f, ground, t) for f, t in zip(met, times, strict=True)]
        exact = impacts_in_digits(facets, recorded, STANDARD_GRAVITY, *release)
        last, begin, after = [[Decimal(c) for c in some] for some in release], Decimal(0), Decimal(0)
        for f, impact in zip(met, exact, strict=True):
            with localcontext(prec=50):
                t, first = first_crossing(corners, *last, g, after)
                assert first == f and abs(begin + t - impact.t) < Decimal("1e-40")
            last, begin, after = [impact.x, impact.v], impact.t, Decimal("1e-30")


@pytest.mark.parametrize("draw", ["per_rock", "per_impact"])
def test_drawn_ground_is_that_which_each_impact_found(tmp_path: Path, draw: str) -> None:
    path = scene_file(tmp_path)
    drawn = f"normal_restitution: {{mean: 0.5, sd: 0.1, min: 0.2, max: 0.8}}, draw: {draw}"
    path.write_text(path.read_text().replace("normal_restitution: 0.5", drawn))
    prepared = prepare(read_scene(path).model_copy(update={"engine": "reference"}))
    flights = flown.fly(prepared, flown.some_rocks(prepared, 10), paths=True).flights
    off = off_exact(prepared, flights, rocks=10)
    assert len(off) > 3 and max(one.place_max for one in off[:4]) < EXACT_TO


@pytest.mark.parametrize("R_t", [0.2, 0.95])
def test_coulomb_limited_impacts_are_those_of_events(R_t: float) -> None:
    """With R_t = 0.2 friction limits the impulse, with 0.95 it does not; in the first case, R_t alone is metres off."""
    ground = surface(0.5, R_t, 20.0)
    engine, physics = engine_over("compiled", incline(30.0)), flight(ground, "none", "coulomb_limited")
    flights = fly(engine, physics, (0.3, 0.2, 4.0), (3.0, 1.0, 0.0))
    off = off_exact(Case(engine, physics), flights)
    assert len(off) > 3 and max(one.place_max for one in off[:4]) < EXACT_TO
    constant = Case(engine, flight(ground, "none"))
    assert (off_exact(constant, flights)[1].place_max > 0.1) == (R_t == 0.2)


def test_another_rebound_model_is_not_followed() -> None:
    engine, physics = engine_over("reference", floor()), flight(surface(), rebound="thesis_literal")
    assert off_exact(Case(engine, physics), fly(engine, physics, (0.0, 0.0, 3.0))) == []


def test_effects_are_not_followed() -> None:
    engine = engine_over("reference", floor())
    rough = chain_of([RocfallRoughness(0.1)])
    physics = flight(surface())
    physics = replace(physics, models=physics.models._replace(effects=rough))
    assert off_exact(Case(engine, physics), fly(engine, physics, (0.0, 0.0, 3.0), (3.0, 0.0, 0.0))) == []
