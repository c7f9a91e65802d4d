"""Tests that a rock whose state becomes NaN gets a separate outcome, disturbs no other rock and can be flown again."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from flights.scenes_of_facets import ENGINES, engine_over, flight, floor, same_bits, surface

import rpf3d_core as rpf3d
from rpf3d_core.ensemble.fly import Flight, fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.jit.dispatch import HAS_NUMBA, OPTIONS
from rpf3d_core.kinetics.rebound import RemainingBounces, rebound, rest_of_bounces
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation import engines
from rpf3d_core.simulation.engines import Models
from rpf3d_core.values import OUTCOME_SENTENCES, ZERO, Motion, Outcome, Vec
from rpf3d_core.vectors import add, dot, norm, scale

SCENES = Path(__file__).parents[2] / "config" / "scenes"


class Faulty(NamedTuple):
    """An own model with a fault: above `speed` (m/s) it takes the root of a negative number or divides by zero."""

    speed: float
    divides: float


@rebound.rule(Faulty)
def faulty(model: Faulty, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    back = add(motion.v, scale(-(1.0 + surface.R_n) * dot(motion.v, n), n))
    speed = norm(motion.v)
    if model.divides > 0.0:
        fault = 1.0 / (0.0 if speed > model.speed else 1.0)
    else:
        fault = math.sqrt(model.speed - speed) - math.sqrt(model.speed - speed) + 1.0
    return Motion(motion.t, motion.x, scale(fault, back), motion.w)


@rest_of_bounces.rule(Faulty)
def faulty_rest(
    model: Faulty, surface: Surface, motion: Motion, n: Vec, gravity: float, rock: RockContext
) -> RemainingBounces:
    return RemainingBounces(ZERO, ZERO, ZERO, 0.0, True)


@pytest.fixture(autouse=True, scope="module")
def compiled_for_these_tests_only() -> Iterator[None]:
    """Compile the loop for the faulty model without the disk cache, whose index other processes could not read then."""
    if not HAS_NUMBA:
        yield
        return
    import numba

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engines, "_follow_all", numba.njit(nogil=True, **OPTIONS)(engines._follow_all.py_func))
        yield


def faulty_flight(divides: float) -> Flight:
    whole = flight(surface(0.9))
    return Flight(whole.materials, whole.settings, Models(Faulty(9.0, divides), whole.models.ground))


def dropped(*heights: float) -> Releases:
    n = len(heights)
    x = np.stack([np.linspace(-5, 5, n), np.linspace(-4, 6, n), heights], axis=1)
    v = np.tile((0.5, 0.0, 0.0), (n, 1))
    return Releases(np.zeros(n, int), np.arange(n), x, v, np.ones(n), np.ones(n))


@pytest.mark.long
@pytest.mark.parametrize("divides", [0.0, 1.0], ids=["root", "division"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_becomes_no_number_is_told_up_to_the_event_before(engine: str, divides: float) -> None:
    flights = fly_ensemble(engine_over(engine, floor()), faulty_flight(divides), dropped(1.0, 9.0, 2.0))
    ends = flights.deposits
    assert ends.outcome.tolist() == [Outcome.STOPPED, Outcome.FAILED, Outcome.STOPPED]
    for column in (ends.x, ends.t, ends.path, ends.max_speed, ends.max_energy, flights.paths.x, flights.paths.v):
        assert np.isfinite(column).all(), "nothing that a map could take up is no number"
    assert np.isfinite(flights.impacts.speed_out).all()
    np.testing.assert_array_equal(ends.x[1], ends.release[1])
    assert (flights.impacts.row == 1).sum() == ends.impacts[1] == 0


@pytest.mark.parametrize("divides", [0.0, 1.0], ids=["root", "division"])
def test_both_engines_tell_a_failed_rock_alike(divides: float) -> None:
    pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine to compare with")
    one, other = (
        fly_ensemble(engine_over(engine, floor()), faulty_flight(divides), dropped(1.0, 9.0, 2.0, 30.0, 0.1))
        for engine in ENGINES
    )
    assert (one.deposits.outcome == Outcome.FAILED).sum() == 2
    assert same_bits(one, other)


@pytest.mark.long
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("part", ["x", "v"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_rock_that_is_released_as_no_number_fails_at_once(engine: str, part: str, value: float) -> None:
    rocks = dropped(1.0, 2.0)
    getattr(rocks, part)[1, 2] = value
    assert fly_ensemble(engine_over(engine, floor()), flight(surface()), rocks).deposits.outcome.tolist() == [
        Outcome.STOPPED,
        Outcome.FAILED,
    ]


def test_a_failed_rock_is_no_deposit_and_its_sentence_says_how_to_fly_it_again() -> None:
    from rpf3d_core.values import DEPOSITED

    assert Outcome.FAILED not in DEPOSITED and "replay" in OUTCOME_SENTENCES[Outcome.FAILED]


def test_outcomes_keep_their_numbers() -> None:
    assert [outcome.name for outcome in Outcome] == [
        "STOPPED", "LEFT_TERRAIN", "CAUGHT", "FRAGMENTED", "MAX_TIME", "MAX_IMPACTS", "UNRESOLVED_CONTACT", "FAILED",
        "LOST_TO_HOLE", "FELL_THROUGH",
    ]  # fmt: skip
    assert [int(outcome) for outcome in Outcome] == list(range(10))


@pytest.mark.long
@pytest.mark.parametrize(("source", "engine"), [("west_wall", "reference"), (0, "compiled")])
def test_one_rock_of_a_scene_is_flown_again_with_its_bits(source: str | int, engine: str) -> None:
    scene = rpf3d.read_scene(SCENES / "demo.yaml")
    among = rpf3d.simulate(scene, rocks=12, engine="reference").flights
    alone = rpf3d.replay(scene, source, 7, engine=engine).flights
    assert (alone.deposits.source.tolist(), alone.deposits.rock.tolist()) == ([0], [7])
    np.testing.assert_array_equal(alone.deposits.x[0], among.deposits.x[7])
    np.testing.assert_array_equal(alone.impacts.x, among.impacts.x[among.impacts.row == 7])


@pytest.mark.parametrize(
    ("source", "rock", "sentence"),
    [
        ("east_wall", 0, "there is no source 'east_wall'; the sources are west_wall"),
        (1, 0, "there is no source 1; the sources are west_wall"),
        (0, -1, "the rock is -1; the rocks of source 'west_wall' are numbered from 0 to 199$"),
        (0, 200, "numbered from 0 to 199; if more rocks have flown, give their number as `rocks`"),
    ],
)
def test_a_rock_that_is_not_there_cannot_be_flown_again(source: str | int, rock: int, sentence: str) -> None:
    with pytest.raises(rpf3d.InputError, match=sentence):
        rpf3d.replay(SCENES / "demo.yaml", source, rock)


def test_a_rock_of_a_larger_run_is_flown_again_if_the_number_of_its_rocks_is_given() -> None:
    alone = rpf3d.replay(SCENES / "demo.yaml", 0, 200, rocks=201).flights
    assert alone.deposits.rock.tolist() == [200]
