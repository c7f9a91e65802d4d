"""Tests that the recorded path of a slide that turns has a row for each bend, without an effect on the motion."""

import math

import numpy as np
import pytest
from flights import scenes_of_facets as made

from rpf3d_core.values import Mode, Outcome

TURN = math.degrees(2.0 * math.atan(0.0625)) * (1.0 + 1e-9)
"""Largest angle (degrees) between the directions of two successive rows of a path."""
ROUND_A_VERTEX = 0.01
"""Largest share of rocks that count as wedged because they start on a vertex or edge at nanometres per second.

Such a rock moves round within tolerance for 64 path segments in the facets that meet there
(docs/reference/tolerances.md).
"""


def uphill(engine, **settings):
    """Fly a rock that slides obliquely up an incline of two facets and comes down again."""
    down, normal = made.down_the_slope(35.0)
    across = np.cross(normal, down)
    physics = made.flight(made.surface(0.0, 1.0, 20.0, 0.0), "sliding", **settings)
    terrain = made.incline(35.0, down=60.0, up=20.0, half_width=40.0)
    return made.fly(made.engine_over(engine, terrain), physics, 1e-12 * normal, -9.0 * down + 0.7 * across)


@pytest.mark.parametrize("engine", made.ENGINES)
def test_a_slide_is_written_down_every_seven_degrees(engine):
    flights = uphill(engine)
    paths = flights.paths
    sliding = np.flatnonzero(paths.mode == Mode.SLIDING)
    begin, end = paths.v[sliding], paths.v_end[sliding]
    cosine = (begin * end).sum(1) / np.maximum(np.linalg.norm(begin, axis=1) * np.linalg.norm(end, axis=1), 1e-300)
    steep = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    assert len(sliding) > 20, "it turns by more than 150 degrees"
    assert steep.max() <= TURN


@pytest.mark.parametrize("engine", made.ENGINES)
def test_bends_are_no_contacts(engine):
    few = uphill(engine, max_impacts=8)
    assert (few.paths.mode == Mode.SLIDING).sum() > 20
    assert few.deposits.outcome.tolist() == [Outcome.LEFT_TERRAIN]


@pytest.mark.parametrize("engine", made.ENGINES)
def test_slow_rocks_that_turn_do_not_pass_for_wedged(engine):
    """At nanometres per second a turn is shorter than the tolerance; its bends must not count as lack of progress."""
    terrain = made.rough_grid(14, 21.0, 0.6, 0.02, seed=0)
    physics = made.flight(made.surface(0.0, 0.8, 15.0, 0.5), "sliding")
    x, v = (14.25, 5.25, -8.54534146517406), (-1.634e-8, 1.592e-8, 6.00e-9)
    flights = made.fly(made.engine_over(engine, terrain), physics, x, v)
    assert flights.deposits.outcome.tolist() == [Outcome.LEFT_TERRAIN], "friction holds nothing on 31 degrees"


def test_hardly_any_slow_release_on_a_slope_steeper_than_friction_is_a_deposit():
    terrain = made.rough_grid(14, 21.0, 0.6, 0.02, seed=0)
    physics = made.flight(made.surface(0.0, 0.8, 15.0, 0.5), "sliding")
    random = np.random.default_rng(4)
    corners = terrain.vertices[terrain.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    middles = 0.5 * (corners[:, 0] + corners[:, 1])
    inside = ((middles[:, :2] > 1.0) & (middles[:, :2] < 20.0)).all(axis=1)
    x = np.concatenate([middles[inside], corners[inside, 0]])
    v = random.normal(size=x.shape) * 10.0 ** random.uniform(-9, -3, (len(x), 1))
    v -= (v * np.tile(normals[inside], (2, 1))).sum(1)[:, None] * np.tile(normals[inside], (2, 1))
    flights = made.fly(made.engine_over("compiled", terrain), physics, x, v)
    assert (flights.deposits.outcome == Outcome.STOPPED).mean() <= ROUND_A_VERTEX
