"""Tests that a rock arrives at barriers in one place in their order, and at none after the one that caught it."""

import numpy as np
import pytest
from flights import scenes_of_facets as made
from flights.obstacles_made import fence, fences, thrown, with_effects

from rpf3d_core.hazard.barriers import BarrierFigures, BarrierTally
from rpf3d_core.values import Outcome

ROCKS, PLACE, HALF, STRONG = 40, 6.0, 7.9, 1e9
TALL = (60.0, STRONG)
"""Height (m) and capacity (J) of a barrier that catches every rock."""


def arrivals(engine: str, panels: list[tuple[float, float]], places: tuple[float, ...] = ()) -> list[BarrierFigures]:
    """Return the figures of barriers across an incline, with rocks thrown down towards them.

    panels : height (m) and capacity (J) of each barrier; places : x (m) of each barrier, PLACE for all if empty
    """
    terrain = made.incline(35, cells=(30, 8))
    xs = places or (PLACE,) * len(panels)
    lines = [[(x, -HALF), (x, HALF)] for x in xs]
    nets = fences(*(fence(terrain, line, *panel) for line, panel in zip(lines, panels, strict=True)))
    tally = BarrierTally(nets, tuple(map(str, range(len(panels)))), 9.81, engine == "compiled")

    def watch(batch, releases):
        tally(batch, releases)
        return np.zeros(len(batch.rows))

    physics = with_effects(made.flight(made.surface(0.5, 0.9, 20)), nets)
    flights = made.fly(made.engine_over(engine, terrain), physics, *thrown(ROCKS), watch=watch)
    assert (flights.deposits.outcome == Outcome.CAUGHT).all()
    return list(tally.figures)


@pytest.mark.parametrize("engine", ["reference", "compiled"])
@pytest.mark.parametrize("other", [(0.5, STRONG), (0.5, 0.0), (60.0, 0.0), (60.0, STRONG), (0.0, STRONG), (60.0, 1.0)])
def test_no_rock_arrives_at_a_barrier_after_the_one_that_caught_it_there(
    engine: str, other: tuple[float, float]
) -> None:
    tall, after = arrivals(engine, [TALL, other])
    assert (tall.came, tall.caught, tall.caught_events) == (ROCKS, ROCKS, ROCKS)
    assert after[3:11] == (0,) * 8


@pytest.mark.parametrize("engine", ["reference", "compiled"])
@pytest.mark.parametrize(("other", "did"), [
    ((0.0, STRONG), "first_flown_over"), ((60.0, 0.0), "first_broken_through"), ((60.0, 1.0), "first_broken_through"),
])  # fmt: skip
def test_every_rock_arrives_at_a_barrier_before_the_one_that_caught_it_there(
    engine: str, other: tuple[float, float], did: str
) -> None:
    before, tall = arrivals(engine, [other, TALL])
    assert (before.came, getattr(before, did), before.caught) == (ROCKS, ROCKS, 0)
    assert (tall.came, tall.caught) == (ROCKS, ROCKS)


@pytest.mark.parametrize("engine", ["reference", "compiled"])
def test_a_low_barrier_before_the_tall_one_catches_some_rocks_and_the_tall_one_the_others(engine: str) -> None:
    low, tall = arrivals(engine, [(1.0, STRONG), TALL])
    assert low.came == ROCKS and 0 < low.first_caught < ROCKS
    assert (low.first_flown_over, tall.came) == (ROCKS - low.first_caught,) * 2


@pytest.mark.parametrize("engine", ["reference", "compiled"])
@pytest.mark.parametrize("apart", [-0.5, 0.5])
def test_a_barrier_with_a_later_number_in_front_of_the_tall_one_is_passed(engine: str, apart: float) -> None:
    """The barriers are not in one place: only the one in front of the tall one has arrivals."""
    _, other = arrivals(engine, [TALL, (60.0, 0.0)], (PLACE, PLACE + apart))
    assert other.came == (ROCKS if apart < 0.0 else 0)
