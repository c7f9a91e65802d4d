"""Impacts followed with 50 digits: against closed forms, and as the judge of events."""

from dataclasses import replace
from decimal import localcontext

import mpmath
import numpy as np
import pytest
from scenes_of_facets import engine_over, flight, floor, fly, incline, rough_grid, surface

from rpf3d_core.accuracy.precise import DIGITS, impacts_in_digits, off_exact
from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.effects.roughness import RocfallRoughness
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import STANDARD_GRAVITY

R_N, R_T = 0.5, 0.75
"""Numbers that a double holds exactly, as mpmath then has them too."""
GROUND = Surface(R_N, R_T, 0.5, 0.5)
CLOSE = mpmath.mpf(10) ** -45
"""Of 50 digits some are lost over ten impacts."""
EXACT_TO = 1e-11
"""m; a few impacts on a terrain of some ten metres, each rounded at 2^-53 of that and amplified by rough ground."""


class Case:
    """What `off_exact` looks at of a prepared scene."""

    def __init__(self, engine, physics) -> None:
        self.engine, self.flight = engine, physics


def test_bounces_on_a_floor_are_those_of_the_geometric_series() -> None:
    facets = engine_over("compiled", floor()).facets
    height, speed, bounces = 2.0, 1.5, 10
    with localcontext() as context, mpmath.workdps(60):
        context.prec = DIGITS
        g = mpmath.mpf(STANDARD_GRAVITY)
        fall = mpmath.sqrt(2 * mpmath.mpf(height) / g)
        times = [fall * (1 + 2 * sum(mpmath.mpf(R_N) ** k for k in range(1, n + 1))) for n in range(bounces)]
        start = ([-1.0, 0.5, height], [speed, 0.0, 0.0])
        recorded = [float(t) for t in times]
        found = impacts_in_digits(facets, [GROUND] * bounces, STANDARD_GRAVITY, *start, [0] * bounces, recorded)
        x, u = mpmath.mpf(-1) + speed * fall, mpmath.mpf(speed) * R_T
        for n, impact in enumerate(found):
            assert abs(mpmath.mpf(str(impact.t)) - times[n]) < CLOSE
            assert abs(mpmath.mpf(str(impact.x[0])) - x) < CLOSE
            assert abs(impact.x[2]) < CLOSE
            x, u = x + u * 2 * fall * mpmath.mpf(R_N) ** (n + 1), u * R_T


def test_the_second_impact_on_an_incline_is_that_of_the_closed_form() -> None:
    # validation reference 2.2: R_n 0.5, R_t 0.8, h 10 m, 40 degrees: after t = 1.427843 s and s = 16.712478 m
    facets = engine_over("compiled", incline(40.0)).facets
    ground = Surface(0.5, 0.8, 0.5, 0.5)
    with localcontext() as context:
        context.prec = DIGITS
        start = ([1.0, 0.0, 10.0 - np.tan(np.radians(40.0))], [0.0, 0.0, 0.0])
        first, second = impacts_in_digits(facets, [ground] * 2, STANDARD_GRAVITY, *start, [0, 0], [1.43, 2.86])
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


def test_another_rebound_model_is_not_followed() -> None:
    engine, physics = engine_over("reference", floor()), flight(surface(), rebound="thesis_literal")
    assert off_exact(Case(engine, physics), fly(engine, physics, (0.0, 0.0, 3.0))) == []


def test_effects_are_not_followed() -> None:
    engine = engine_over("reference", floor())
    rough = chain_of([RocfallRoughness(0.1)])
    physics = flight(surface())
    physics = replace(physics, models=physics.models._replace(effects=rough))
    assert off_exact(Case(engine, physics), fly(engine, physics, (0.0, 0.0, 3.0), (3.0, 0.0, 0.0))) == []
