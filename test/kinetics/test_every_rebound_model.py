"""Tests of each rebound model: no velocity into the ground, no energy gained, rocks stop, both engines agree."""

import math

import numpy as np
import pytest
from flights.rebounds_named import ALL, MODELS, energy, falling_rock, flight_with, struck
from flights.scenes_of_facets import engine_over, floor, fly, rough_grid, same_bits, surface
from programs.command_line import python

from rpf3d_core.kinetics.rebound import rest_of_bounces
from rpf3d_core.values import ZERO, Motion, Outcome

ROUNDING = 1e-12
"""Largest relative growth of an energy by rounding: about a dozen operations, and the error of a unit normal."""
ENDED = {Outcome.STOPPED, Outcome.LEFT_TERRAIN}


def impacts(count: int = 1000):
    """Yield random impacts: ground, velocity (3,) m/s into the ground, spin (3,) rad/s, unit normal (3,)."""
    draw = np.random.default_rng(3)
    for _ in range(count):
        n = draw.normal(size=3)
        n /= np.linalg.norm(n)
        v = draw.normal(size=3) * 10.0 ** draw.uniform(-6, 2)
        v -= 2.0 * max(v @ n, 0.0) * n
        w = draw.normal(size=3) * 10.0 ** draw.uniform(-6, 2)
        yield surface(draw.uniform(), draw.uniform()), tuple(v.tolist()), tuple(w.tolist()), tuple(n.tolist())


@pytest.mark.parametrize("model", ALL.values(), ids=ALL)
def test_no_model_sends_a_rock_into_the_ground(model):
    for i, (ground, v, w, n) in enumerate(impacts()):
        after = struck(model, ground, v, w, n, falling_rock(impacts=i))
        assert np.dot(after.v, n) >= -1e-14 * np.linalg.norm(after.v)


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_no_model_makes_energy(model):
    for i, (ground, v, w, n) in enumerate(impacts()):
        after = struck(model, ground, v, w, n, falling_rock(impacts=i))
        assert energy(after) <= energy(Motion(0.0, ZERO, v, w)) * (1.0 + ROUNDING)


@pytest.mark.parametrize("model", ALL.values(), ids=ALL)
@pytest.mark.parametrize("v", [(0.0, 0.0, -3.0), (2.0, 0.0, 0.0), (0.0, 0.0, 0.0)], ids=["straight", "flat", "still"])
@pytest.mark.parametrize(("R_n", "R_t"), [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
def test_coefficients_and_velocities_at_their_limits_leave_numbers(model, v, R_n, R_t):
    for w in (ZERO, (0.0, 4.0, 1.0)):
        after = struck(model, surface(R_n, R_t), v, w)
        assert all(map(math.isfinite, (*after.v, *after.w)))
        rest = rest_of_bounces(model, surface(R_n, R_t), after, (0.0, 0.0, 1.0), 9.81, falling_rock())
        assert all(map(math.isfinite, (*rest.along, *rest.down, *rest.v, rest.t)))


@pytest.mark.long
@pytest.mark.parametrize("model", ALL.values(), ids=ALL)
def test_both_engines_leave_the_same_bits_and_every_rock_comes_to_an_end(model):
    terrain = rough_grid(10, 60.0, 0.7, 0.5, seed=5)
    draw = np.random.default_rng(8)
    x = np.column_stack([draw.uniform(3, 12, 40), draw.uniform(15, 45, 40), draw.uniform(2, 9, 40)])
    v = draw.normal(size=(40, 3)) * 3.0
    physics = flight_with(model, surface(0.5, 0.8, 35.0))
    reference, compiled = (fly(engine_over(name, terrain), physics, x, v) for name in ("reference", "compiled"))
    assert same_bits(reference, compiled)
    assert len(reference.impacts.t) > 100
    assert set(reference.deposits.outcome) <= ENDED


@pytest.mark.parametrize("resting", ["none", "sliding"])
@pytest.mark.parametrize("name", MODELS)
def test_on_level_ground_every_rock_comes_to_rest(name, resting):
    """With `ground: none`, a rock whose bounces keep the speed along the ground does not stop."""
    over = engine_over("reference", floor(400.0))
    ground = surface(0.5, 0.8, 35.0, 0.8)
    physics = flight_with(MODELS[name], ground, resting)
    ends = fly(over, physics, np.tile((0.1, 0.3, 3.0), (20, 1)), (6.0, 1.0, 0.0)).deposits
    keeps = name == "coulomb_limited" and resting == "none"
    assert set(ends.outcome) == {Outcome.UNRESOLVED_CONTACT if keeps else Outcome.STOPPED}


def test_a_model_that_is_not_named_is_not_imported():
    """The names of the loaded modules show what a scene imports."""
    code = """
import sys
from rpf3d_core.scene.models.keys import ReboundSpec
import rpf3d_core.runs.run
before = [name for name in sys.modules if ".rebounds." in name and "builders" not in name]
ReboundSpec.model_validate({"v_half": {}}).model_spec.made()
after = [name for name in sys.modules if ".rebounds." in name and "builders" not in name]
print(before, after)
"""
    done = python(code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[] ['rpf3d_core.kinetics.rebounds.v_half']"
