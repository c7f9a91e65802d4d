"""Tests of ground drawn for each rock or impact: engines agree, and fixed numbers are not drawn."""

import dataclasses
import math

import numpy as np
import pytest
from flights.compiled_loops import compiled_loops
from flights.scenes_of_facets import engine_over, flight, floor, gully, incline, rough_grid, same_bits, surface

from rpf3d_core.ensemble.flights import Flights, given_columns
from rpf3d_core.ensemble.fly import Flight, fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.materials.distributions import (
    Distribution,
    fixed,
    quantiles,
    triangular_between,
    truncated_lognormal,
    truncated_normal,
    truncated_power_law,
    truncated_weibull,
    uniform_between,
)
from rpf3d_core.materials.draws import DrawnMaterials, DrawnSurface, drawn_materials
from rpf3d_core.materials.library import Materials, surface_of
from rpf3d_core.materials.rock_context import RockContext, RockKey
from rpf3d_core.materials.streams import ZONES, Purpose, uniform, uniform_at
from rpf3d_core.terrain.facets import Terrain

pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine to compare with")

SANDSTONE = truncated_normal(0.5, 0.2, 0.3, 0.8)
RANGE = uniform_between(0.5, 0.95)
ANGLE = truncated_normal(30.0, 5.0, 15.0, 45.0)
ROUNDING = 1e-9
"""Largest relative error of a speed after an impact over the speed before it."""


def drawn(
    R_n: Distribution = SANDSTONE, R_t: Distribution = RANGE, angle: Distribution = ANGLE, per_impact: bool = False,
    zones: int = 1, seed: int = 7, model: str = "sliding",
) -> Flight:  # fmt: skip
    """Return the physics of a flight over drawn ground, with the same distributions in all zones."""
    materials = drawn_materials([DrawnSurface(R_n, R_t, angle, 0.5, per_impact)] * zones)
    physics = flight(surface(), model, seed=seed)
    return dataclasses.replace(physics, materials=materials)


def thrown(rocks: int, x: tuple[float, float, float] = (1.0, 0.3, 3.0), source: int = 2) -> Releases:
    """Return releases that are all equal, so that only the drawn ground makes the rocks differ."""
    ones = np.ones(rocks)
    number = np.arange(rocks)
    v = np.tile((2.0, 0.1, 0.0), (rocks, 1))
    return Releases(np.full(rocks, source), number, np.tile(x, (rocks, 1)), v, ones, ones)


def both(terrain: Terrain, physics: Flight, rocks: Releases) -> tuple[Flights, Flights]:
    reference, compiled = (
        fly_ensemble(engine_over(name, terrain), physics, rocks) for name in ("reference", "compiled")
    )
    return reference, compiled


TERRAINS = {"incline": incline(35.0, jitter=1, cells=(6, 4)), "rough": rough_grid(12, 20.0, 0.5, 0.4, seed=2)}
KINDS = {
    "normal": (SANDSTONE, RANGE, ANGLE),
    "lognormal": (truncated_lognormal(0.4, 0.2, 0.05, 0.9), fixed(0.8), fixed(30.0)),
    "power_law": (fixed(0.5), truncated_power_law(1.5, 0.3, 0.9), truncated_lognormal(25.0, 8.0, 5.0, 60.0)),
    "weibull": (
        triangular_between(0.2, 0.4, 0.9), truncated_weibull(3.0, 0.7, 0.3, 0.95),
        truncated_weibull(2.0, 25.0, 5.0, 60.0),
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("model", ["none", "sliding"])
@pytest.mark.parametrize("per_impact", [False, True], ids=["per_rock", "per_impact"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("terrain", TERRAINS)
def test_both_engines_leave_the_same_bits_on_drawn_ground(
    terrain: str, kind: str, per_impact: bool, model: str
) -> None:
    reference, compiled = both(TERRAINS[terrain], drawn(*KINDS[kind], per_impact, model=model), thrown(25))
    assert len(set(reference.deposits.path.tolist())) == 25, "rocks that start alike go different ways"
    assert same_bits(reference, compiled)


def test_a_gully_of_two_zones_draws_for_each_of_them_on_both_engines() -> None:
    physics = drawn(per_impact=True, zones=2)
    reference, compiled = both(gully(40.0, 30.0, 20.0), physics, thrown(20, (0.0, 0.4, 2.0)))
    assert same_bits(reference, compiled)


def test_threads_batches_and_company_do_not_matter_to_what_is_drawn() -> None:
    engine, physics, rocks = engine_over("compiled", TERRAINS["rough"]), drawn(per_impact=True), thrown(300)
    whole = fly_ensemble(engine, physics, rocks)
    for threads in (1, 2, 5):
        assert same_bits(fly_ensemble(engine, physics, rocks, threads=threads), whole)
    some = [17, 4, 299]
    alone = fly_ensemble(
        engine, physics, Releases(**{name: column[some] for name, column in given_columns(rocks).items()})
    )
    np.testing.assert_array_equal(alone.deposits.x, whole.deposits.x[some])


@pytest.mark.parametrize("change", ["seed", "source"])
def test_another_seed_or_source_draws_other_ground(change: str) -> None:
    engine = engine_over("reference", TERRAINS["incline"])
    one = fly_ensemble(engine, drawn(), thrown(10))
    other = fly_ensemble(
        engine, drawn(seed=8 if change == "seed" else 7), thrown(10, source=3 if change == "source" else 2)
    )
    assert not (one.deposits.x == other.deposits.x).all(axis=1).any()


def ratios(flights: Flights) -> np.ndarray:
    """Return speed after over speed before each impact (N,); for vertical falls onto a floor this is the drawn R_n."""
    return flights.impacts.speed_out / flights.impacts.speed_in


@pytest.mark.parametrize("per_impact", [False, True], ids=["per_rock", "per_impact"])
def test_a_rock_keeps_its_ground_for_life_or_until_its_next_impact(per_impact: bool) -> None:
    rocks = dataclasses.replace(thrown(400), v=np.zeros((400, 3)))
    flights = fly_ensemble(engine_over("compiled", floor()), drawn(per_impact=per_impact), rocks)
    found, row = ratios(flights), flights.impacts.row
    number = np.arange(len(row)) - np.searchsorted(row, row)
    first = found[number == 0]
    stream = Purpose.NORMAL_RESTITUTION
    if per_impact:
        expected = [uniform_at(7, 2, int(r), int(stream), int(n) + 1) for r, n in zip(row, number, strict=True)]
        np.testing.assert_allclose(found, quantiles(SANDSTONE, np.array(expected)), rtol=ROUNDING)
    else:
        np.testing.assert_allclose(first, quantiles(SANDSTONE, uniform(7, 2, np.arange(400), stream)), rtol=ROUNDING)
        np.testing.assert_allclose(found, first[row], rtol=ROUNDING)
    assert first.min() >= 0.3 and first.max() <= 0.8 and first.std() > 0.1


def test_a_drawn_friction_angle_is_the_slope_that_it_just_holds() -> None:
    # On a slope of 30 degrees a rock let go from rest slides off exactly if its drawn angle is smaller.
    angle = uniform_between(20.0, 40.0)
    physics = drawn(fixed(0.5), fixed(0.8), angle)
    n = 200
    at_rest = dataclasses.replace(thrown(n), x=np.tile((0.0, 0.0, 0.0), (n, 1)), v=np.zeros((n, 3)))
    flights = fly_ensemble(engine_over("compiled", incline(30.0)), physics, at_rest)
    angles = quantiles(angle, uniform(7, 2, np.arange(n), Purpose.FRICTION_ANGLE))
    assert 60 < (angles < 30.0).sum() < 140
    np.testing.assert_array_equal(flights.deposits.path > 1.0, angles < 30.0)


def rock_numbered(source: int, rock: int, impacts: int) -> RockContext:
    """Return the context of a rock, with seed 1, as draws use it."""
    return RockContext(None, RockKey(1, source, rock), impacts)


def test_one_more_distribution_leaves_the_other_coefficients_as_they_were() -> None:
    one = drawn_materials([DrawnSurface(SANDSTONE, fixed(0.8), fixed(30.0), 0.5, True)] * 2)
    more = drawn_materials([DrawnSurface(SANDSTONE, RANGE, ANGLE, 0.5, True)] * 2)
    for zone in (0, 1):
        for impacts in (0, 1, 2):
            before, after = (surface_of(materials, zone, rock_numbered(3, 5, impacts)) for materials in (one, more))
            assert before.R_n == after.R_n and before.R_t == 0.8 and after.R_t != 0.8
    draws = {
        surface_of(more, zone, rock_numbered(s, r, i)).R_n
        for zone in (0, 1)
        for s in (0, 1)
        for r in (0, 1)
        for i in (0, 1)
    }
    assert len(draws) == 16, "zone, source, rock and impact each tell draws apart"


def test_there_is_room_for_every_purpose_beside_a_zone() -> None:
    assert max(Purpose) < ZONES


def test_ground_of_numbers_is_the_plain_one_whatever_class_it_was_written_in() -> None:
    materials = drawn_materials([DrawnSurface(fixed(0.5), fixed(0.8), fixed(30.0), 0.4, True)])
    assert type(materials) is Materials
    assert [column.tolist() for column in materials] == [[0.5], [0.8], [math.tan(math.radians(30.0))], [0.4], [0.0]]


def test_ground_of_numbers_compiles_no_draw() -> None:
    engine = engine_over("compiled", floor())
    fly_ensemble(engine, flight(surface()), thrown(2))
    fly_ensemble(engine, drawn(), thrown(2))
    plain = [loop for loop in compiled_loops() if "ConstantRestitution" in loop.rebound and loop.effects == "none"]
    keys = {loop.materials.split("(")[0]: [loop.keys] for loop in plain}
    assert set(keys) == {"Materials", "DrawnMaterials"} and DrawnMaterials.__name__ in keys
    assert keys["Materials"] == ["none"], "without a key nothing can be drawn"
    assert len(keys["DrawnMaterials"]) == 1 and keys["DrawnMaterials"][0].startswith("RockKeys")


def test_bounces_summed_up_and_the_slide_after_them_have_the_ground_of_the_next_impact() -> None:
    # The start of the sum determines which impacts are drawn, but each drawn impact keeps its number.
    engine = engine_over("compiled", incline(20.0))
    fine, coarse = (
        fly_ensemble(
            engine, dataclasses.replace(physics, settings=physics.settings._replace(smallest_bounce=h)), thrown(50)
        )
        for physics, h in ((drawn(per_impact=True), 1e-6), (drawn(per_impact=True), 1e-3))
    )
    for r in range(50):
        few, many = (flights.impacts.speed_out[flights.impacts.row == r] for flights in (coarse, fine))
        assert len(few) < len(many)
        np.testing.assert_array_equal(few, many[: len(few)])
