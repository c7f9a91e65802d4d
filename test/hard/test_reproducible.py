"""Tests that results are bitwise equal for other engines, threads, batches, orders of rocks and facets, and turns."""

import threading

import numpy as np
import pytest
from flights.on_both_engines import BOTH, MODELS
from flights.scenes_of_facets import (
    ENGINES,
    box,
    cone,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    gully,
    incline,
    joined,
    released,
    rough_grid,
    same_bits,
    strip,
    surface,
    terrain_of,
    turned,
)

from rpf3d_core.ensemble import batches, flight_order
from rpf3d_core.values import Outcome

HARD_PLACES = {
    "rough slope": rough_grid(8, 16.0, 0.5, 0.5, seed=4),
    "box over a floor": joined(box(), floor(4.0, z=-3.0, cells=3)),
    "gully": gully(35.0, 50.0, 2.0, cells=7),
    "cube's corner": cone(3, 5.0, 5.0),
    "steps": strip([(0.0, 10.0), (5.0, 10.0), (5.0, 7.0), (10.0, 7.0), (10.0, 0.0), (20.0, 0.0)], across=3),
}
PLACES = pytest.mark.parametrize("place", HARD_PLACES)


def rocks_over(place: str, count: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (count, 3) m and velocities (count, 3) m/s of rocks over the middle of HARD_PLACES[place]."""
    vertices = HARD_PLACES[place].vertices
    low, high = vertices.min(0), vertices.max(0)
    draw = np.random.default_rng(10)
    x = draw.uniform(low + 0.3 * (high - low), low + 0.6 * (high - low), (count, 3))
    x[:, 2] = high[2] + draw.uniform(0.5, 2.0, count)
    return x, draw.normal(size=(count, 3)) * 2.0


@pytest.mark.parametrize("model", ["none", "sliding"])
@PLACES
def test_hard_places_give_the_same_bits_on_both_engines(place, model):
    x, v = rocks_over(place)
    physics = flight(surface(0.5, 0.9, 15.0), model, max_impacts=500)
    one, other = (fly(engine_over(name, HARD_PLACES[place]), physics, x, v) for name in ENGINES)
    assert len(one.impacts.t) >= 12 and same_bits(one, other)


@MODELS
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_number_of_threads_changes_no_bit(monkeypatch, threads, model):
    monkeypatch.setattr(flight_order, "LARGEST_BATCH", 3)
    over = engine_over("compiled", HARD_PLACES["rough slope"])
    physics = flight(surface(0.5, 0.9, 15.0), model)
    parts = rocks_over("rough slope", 40)
    assert same_bits(fly(over, physics, *parts, threads=threads), fly(over, physics, *parts))


def test_a_single_batch_flies_without_further_threads(monkeypatch):
    over, physics = engine_over("compiled", HARD_PLACES["rough slope"]), flight(surface(0.5, 0.9, 15.0), "none")
    threads = set()

    def watch(flown, _):
        threads.add(threading.get_ident())
        return np.zeros(len(flown.rows))

    fly(over, physics, *rocks_over("rough slope", 40), threads=2, watch=watch)
    assert threads == {threading.get_ident()}
    monkeypatch.setattr(flight_order, "LARGEST_BATCH", 3)
    monkeypatch.setattr(flight_order, "SMALLEST_BATCH", 3)
    threads.clear()
    fly(over, physics, *rocks_over("rough slope", 40), threads=2, watch=watch)
    assert threads and threading.get_ident() not in threads


@BOTH
@MODELS
@PLACES
def test_the_order_of_rocks_and_batches_changes_no_bit(monkeypatch, engine, model, place):
    x, v = rocks_over(place, 15)
    over, physics = engine_over(engine, HARD_PLACES[place]), flight(surface(0.5, 0.9, 15.0), model, max_impacts=500)
    whole = fly(over, physics, x, v).deposits
    order = np.random.default_rng(2).permutation(len(x))
    monkeypatch.setattr(flight_order, "LARGEST_BATCH", 4)
    monkeypatch.setattr(flight_order, "REFERENCE_BATCH", 4)
    shuffled = fly(over, physics, x[order], v[order]).deposits
    for name in ("x", "t", "path", "outcome", "facet", "impacts", "max_speed"):
        np.testing.assert_array_equal(getattr(shuffled, name), getattr(whole, name)[order])


@BOTH
@MODELS
@PLACES
def test_the_order_of_the_facets_and_of_their_corners_changes_no_bit(engine, model, place):
    """This holds also on steps and in gullies, where a rock meets several facets at the same time."""
    terrain, (x, v) = HARD_PLACES[place], rocks_over(place, 15)
    order = np.random.default_rng(3).permutation(len(terrain.triangles))
    shuffled = terrain_of(terrain.vertices, terrain.triangles[order], terrain.zone[order], terrain.zones)
    physics = flight(surface(0.5, 0.9, 15.0), model, max_impacts=500)
    one, other = (fly(engine_over(engine, t), physics, x, v).deposits for t in (terrain, shuffled))
    for name in ("x", "t", "path", "outcome", "impacts", "max_speed"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    hit = one.facet >= 0
    np.testing.assert_array_equal(one.facet[hit], order[other.facet[hit]])


@BOTH
@pytest.mark.parametrize("R_n", [0.0, 0.35])
def test_on_a_plane_cut_into_facets_their_order_changes_no_bit(engine, R_n):
    """Rocks fall onto vertices where six facets of the same normal meet, and slide along edges of two such facets."""
    plane = rough_grid(8, 16.0, 1.0, 0.0, seed=1)
    x = np.array([(2.0 * i, 2.0 * j, 3.0) for i in (2, 3, 5) for j in (1, 3, 6)])
    x[:3, 0] += 0.5  # over edges
    physics = flight(surface(R_n, 0.5, 0.0), "sliding")
    whole = fly(engine_over(engine, plane), physics, x).deposits
    for seed in range(4):
        order = np.random.default_rng(seed).permutation(len(plane.triangles))
        shuffled = fly(engine_over(engine, terrain_of(plane.vertices, plane.triangles[order])), physics, x).deposits
        for name in ("x", "t", "path", "impacts"):
            np.testing.assert_array_equal(getattr(shuffled, name), getattr(whole, name))
        np.testing.assert_array_equal(order[shuffled.facet], whole.facet)


@BOTH
@MODELS
@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_scene_turned_by_a_quarter_gives_the_turned_answer_to_the_last_bit(engine, model, quarters):
    """A quarter turn causes no rounding, the formulas treat x and y alike, and no axis decides a tie on this ground."""
    terrain = HARD_PLACES["rough slope"]
    x, v = rocks_over("rough slope")
    physics = flight(surface(0.4, 0.9, 32.0), model)
    image = terrain_of(turned(terrain.vertices, 90.0 * quarters), terrain.triangles)
    one = fly(engine_over(engine, terrain), physics, x, v)
    other = fly(engine_over(engine, image), physics, turned(x, 90.0 * quarters), turned(v, 90.0 * quarters))
    assert {Outcome.STOPPED} < {Outcome(o) for o in one.deposits.outcome} | {Outcome.LEFT_TERRAIN}
    np.testing.assert_array_equal(other.deposits.x, turned(one.deposits.x, 90.0 * quarters))
    np.testing.assert_array_equal(other.impacts.x, turned(one.impacts.x, 90.0 * quarters))
    for name in ("t", "path", "outcome", "facet", "impacts", "max_speed"):
        np.testing.assert_array_equal(getattr(one.deposits, name), getattr(other.deposits, name))


@BOTH
@MODELS
def test_a_smooth_scene_turned_by_33_degrees_gives_the_turned_answer_to_a_nanometre(engine, model):
    """The terrain is a plane in 40 facets, which does not amplify the rounding of the turn as rough ground does."""
    descent, normal = down_the_slope(25.0, 0.0)
    draw = np.random.default_rng(1)
    x = np.outer(draw.uniform(0, 5, 12), descent) + np.outer(draw.uniform(0.1, 2, 12), normal)
    x[:, 1] = draw.uniform(-1, 1, 12)
    v = draw.normal(size=(12, 3))
    physics = flight(surface(0.4, 0.9, 32.0), model)
    ends = []
    for angle in (0.0, 33.0):
        over = engine_over(engine, incline(25.0, angle, cells=(20, 1), half_width=8.0))
        ends.append(fly(over, physics, turned(x, angle), turned(v, angle)).deposits)
    np.testing.assert_array_equal(ends[0].outcome, ends[1].outcome)
    np.testing.assert_array_equal(ends[0].impacts, ends[1].impacts)
    np.testing.assert_allclose(turned(ends[1].x, -33.0), ends[0].x, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(ends[1].t, ends[0].t, rtol=1e-9)


@pytest.mark.parametrize("batches_until_stop", [1, 2, 5])
def test_a_flight_that_is_stopped_has_flown_whole_groups(monkeypatch, batches_until_stop):
    """A group contains rocks of all releases; a batch contains rocks of only a part of the ground."""
    monkeypatch.setattr(flight_order, "LARGEST_BATCH", 4)
    over = engine_over("compiled", HARD_PLACES["rough slope"])
    physics = flight(surface(0.5, 0.9, 15.0), "sliding")
    x, v = rocks_over("rough slope", 100)
    asked = iter(range(100))
    flown = batches.fly_batches(
        over, physics, released(x, v), batches.Keep(*np.zeros((2, 100), dtype=bool)),
        control=batches.BatchControl(threads=2, stop=lambda: next(asked) >= batches_until_stop - 1),
    )  # fmt: skip
    groups = [set(np.concatenate(group).tolist()) for group in flight_order.dealt(released(x, v), 2, 4)]
    taken = [group for group in groups if group & set(flown.rows.tolist())]
    assert set(flown.rows.tolist()) == set().union(*taken) and 0 < len(taken) < len(groups)


def test_the_batches_of_a_group_lie_side_by_side_and_groups_all_over():
    x = np.zeros((20_000, 3))
    x[:, 1] = np.linspace(0.0, 100.0, 20_000)
    releases = released(x, np.zeros((20_000, 3)))
    groups = list(flight_order.dealt(releases, 2, flight_order.LARGEST_BATCH))
    rows = np.concatenate([rows for group in groups for rows in group])
    assert np.array_equal(np.sort(rows), np.arange(20_000))
    for group in groups:
        places = x[np.concatenate(group), 1]
        assert np.ptp(places) > 99.0, "a group stands for all"
        gaps = [np.ptp(x[rows, 1]) / 100.0 - len(rows) / len(places) for rows in group]
        assert np.abs(gaps).max() < 0.01, "each batch has a stretch of its own"
