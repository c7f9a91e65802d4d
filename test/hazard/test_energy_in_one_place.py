"""Tests of the energy with which a rock arrives at barriers in one place: what the nets before each barrier left of it.

A gauge is a barrier of capacity 0, which has no contacts. Expected energies are from the release, or from the first
contact at the place, minus the energy that each net with a smaller number takes.
"""

import math
from typing import NamedTuple

import numpy as np
import pytest
from bodies.flying_bodies import Terms, drop, flown, ground, random_poses
from flights import scenes_of_facets as made
from flights.obstacles_made import MASS, RADIUS, energy_of, fence, fences, passage, rough_ground, with_effects
from flights.on_both_engines import BOTH, G

from rpf3d_core.effects.barriers import Barriers
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.hazard.barrier_arrivals import (
    HELD,
    NEVER,
    OVER,
    THROUGH,
    BarrierArrivals,
    empty_arrivals,
    empty_crossed,
    find_arrivals,
)
from rpf3d_core.hazard.flown import FlownRocks, flown_rocks
from rpf3d_core.shapes.families import box
from rpf3d_core.simulation.record import BLOW
from rpf3d_core.terrain.facets import Terrain

GAUGE, LOW, TALL, WIDE = 0.0, 0.4, 60.0, 7.9
ORDERS = [
    [GAUGE, 4e3],
    [4e3, GAUGE],
    [4e3, 3e3, GAUGE],
    [GAUGE, 4e3, GAUGE, 3e3, GAUGE],
    [4e3, GAUGE, GAUGE, 3e3, 2e3, GAUGE],
]
"""Capacities (J) of barriers in one place, in the order of their numbers."""
STRAIGHT = [(0.0, -WIDE), (0.0, WIDE)]
LINES = {
    "alike": [STRAIGHT],
    "drawn the other way round": [[(0.7, -WIDE), (0.1, WIDE)], [(0.1, WIDE), (0.7, -WIDE)]],
    "corners in the path": [[(-4.0, -WIDE), (0.0, 0.5), (-4.0, WIDE)]],
    "corners against straight lines": [[(-4.0, -WIDE), (0.0, 0.5), (0.0, WIDE)], STRAIGHT],
}
"""Lines of barriers on which all of them meet the path of the rock in one place."""
ON = 1e-9
"""Distance (m) from a plane at which a point counts as on the plane."""
PLACED = pytest.mark.parametrize("lines", LINES.values(), ids=LINES)


def each_way(barriers: Barriers, rocks: FlownRocks) -> BarrierArrivals:
    """Return the arrivals of rocks at barriers; the compiled loop and plain Python find the same."""
    count = len(barriers.panel.height)
    both = [empty_arrivals(len(rocks.mass), count) for _ in range(2)]
    for find, found in zip((find_arrivals, find_arrivals.py_func), both, strict=True):
        find(barriers, rocks, empty_crossed(barriers.obstacles, count), found)
    for one, other in zip(*both, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)
    return both[0]


def arrive(
    engine: str, terrain: Terrain, nets: Barriers, x: np.ndarray, v: np.ndarray, **ground: float
) -> tuple[Flights, BarrierArrivals]:
    """Fly rocks from x (m) with v (m/s), and return the flights and the arrivals; ground : as in `surface`."""
    found = empty_arrivals(len(np.atleast_2d(x)), len(nets.panel.height))

    def watch(batch, releases):
        rows = batch.rows
        flown_here = flown_rocks(batch, releases.mass[rows], releases.radius[rows], G)
        for whole, part in zip(found, each_way(nets, flown_here), strict=True):
            whole[rows] = part
        return np.zeros(len(rows))

    physics = with_effects(made.flight(made.surface(**ground)), nets)
    flights = made.fly(made.engine_over(engine, terrain), physics, x, v, watch=watch)
    return flights, found


def in_turn(capacities: list[float], lines: list, height: float = TALL) -> Barriers:
    """Return barriers on a floor along lines that take turns; capacities : J; height : m."""
    terrain = made.floor(cells=10)
    return fences(
        *(fence(terrain, lines[k % len(lines)], height, capacity) for k, capacity in enumerate(capacities))
    )  # fmt: skip


def meets_each_once(found: BarrierArrivals) -> bool:
    """Return True if every rock has exactly one arrival at each barrier."""
    return bool((found.events.sum(axis=2) == 1).all())


def left(energy: float, capacities: list[float]) -> np.ndarray:
    """Return the energy (J) with which a rock comes to each barrier, if it takes all the capacity of each one."""
    return energy - np.cumsum([0.0, *capacities[:-1]])


@BOTH
@PLACED
@pytest.mark.parametrize("capacities", ORDERS, ids=str)
@pytest.mark.parametrize("z", [2.0, 0.0], ids=["in flight", "on the ground"])
def test_a_rock_comes_to_each_barrier_with_what_the_nets_before_it_left(engine, lines, capacities, z):
    nets = in_turn(capacities, lines)
    flights, found = arrive(
        engine, made.floor(cells=10), nets, (-2.0, 0.5, z), (10.0, 0.0, 0.0), friction_angle=0.0
    )  # fmt: skip
    assert (found.did == THROUGH).all() and meets_each_once(found)
    t = found.t[0, 0]
    np.testing.assert_allclose(found.t, t, rtol=1e-9)
    before = energy_of(math.hypot(10.0, G * t if z > 0.0 else 0.0))
    np.testing.assert_allclose(found.energy[0], left(before, capacities), rtol=1e-9)
    contacts = flights.impacts.facet < 0
    np.testing.assert_allclose(found.height, flights.impacts.x[contacts][0, 2], atol=1e-9)


@pytest.mark.parametrize("z", [2.0, 0.0], ids=["in flight", "on the ground"])
def test_a_rock_comes_so_to_barriers_at_any_angle_that_have_one_point_in_common(z):
    """Each line is straight through the point, or has a corner there with one side left and one right of the path."""
    random = np.random.default_rng(7)
    for _ in range(60):
        heading = random.uniform(0.0, 2.0 * math.pi)
        point, ahead = random.uniform(-1.0, 1.0, 2), np.array([math.cos(heading), math.sin(heading)])
        capacities = random.choice([GAUGE, GAUGE, 1e3, 3e3], random.integers(2, 8)).tolist()
        lines = []
        for _ in capacities:
            angles = heading + random.uniform(0.05, math.pi - 0.05, 2) * (1.0, -1.0)
            angles[1] = angles[1] if random.integers(2) else angles[0] + math.pi
            ends = point + random.uniform(3.0, 8.0, (2, 1)) * np.stack([np.cos(angles), np.sin(angles)], 1)
            lines.append([ends[0], point, ends[1]][:: random.choice([-1, 1])])
        x, v = (*(point - random.uniform(0.5, 1.8) * ahead), z), (*(10.0 * ahead), 0.0)
        nets = in_turn(capacities, lines)
        _, found = arrive("compiled", made.floor(cells=10), nets, x, v, friction_angle=0.0)
        assert (found.did == THROUGH).all() and meets_each_once(found)
        way = math.dist(x[:2], point)
        before = energy_of(math.hypot(10.0, G * way / 10.0 if z > 0.0 else 0.0))
        np.testing.assert_allclose(found.energy[0], left(before, capacities), rtol=1e-8)


@BOTH
@pytest.mark.parametrize("capacities", ORDERS, ids=str)
@pytest.mark.parametrize("z", [2.0, 0.0], ids=["in flight", "on the ground"])
def test_a_rock_released_at_barriers_comes_to_them_in_their_order(engine, capacities, z):
    """No segment of the path ends at the first contact, so all crossings are behind it."""
    nets = in_turn(capacities, [STRAIGHT])
    _, found = arrive(engine, made.floor(cells=10), nets, (0.0, 0.5, z), (10.0, 0.0, 0.0), friction_angle=0.0)
    assert (found.did == THROUGH).all() and meets_each_once(found)
    np.testing.assert_allclose(found.energy[0], left(energy_of(10.0), capacities), rtol=1e-9)


@BOTH
def test_a_rock_flies_over_a_low_net_with_what_the_net_before_it_left(engine):
    terrain = made.floor(cells=10)
    nets = fences(*(fence(terrain, STRAIGHT, height, 4e3) for height in (LOW, TALL, LOW)))
    _, found = arrive(engine, terrain, nets, (-2.0, 0.5, 2.0), (10.0, 0.0, 0.0))
    assert found.did.tolist() == [[OVER, THROUGH, OVER]]
    before = energy_of(math.hypot(10.0, 0.2 * G))
    np.testing.assert_allclose(found.energy[0], [before, before, before - 4e3], rtol=1e-9)


@BOTH
def test_a_rock_that_the_second_net_catches_comes_to_the_gauges_before_that_net_only(engine):
    capacities = [GAUGE, 4e3, GAUGE, 1e9, GAUGE]
    nets = in_turn(capacities, [STRAIGHT])
    _, found = arrive(engine, made.floor(cells=10), nets, (-2.0, 0.5, 2.0), (10.0, 0.0, 0.0))
    assert found.did.tolist() == [[THROUGH, THROUGH, THROUGH, HELD, NEVER]]
    before = energy_of(math.hypot(10.0, 0.2 * G))
    np.testing.assert_allclose(found.energy[0, :4], left(before, capacities)[:4], rtol=1e-9)
    assert found.energy[0, 4] == 0.0


@BOTH
@pytest.mark.parametrize("apart", [-0.1, 0.1])
def test_a_gauge_elsewhere_measures_the_energy_on_the_path(engine, apart):
    """The net takes all its capacity 0.1 m before or behind the gauge; the rock slides without friction."""
    terrain = made.floor(cells=10)
    gauge = fence(terrain, [(apart, -WIDE), (apart, WIDE)], TALL, GAUGE)
    for nets, b in ((fences(gauge, fence(terrain, STRAIGHT, TALL, 4e3)), 0),
                    (fences(fence(terrain, STRAIGHT, TALL, 4e3), gauge), 1)):  # fmt: skip
        _, found = arrive(engine, terrain, nets, (-2.0, 0.5, 0.0), (10.0, 0.0, 0.0), friction_angle=0.0)
        np.testing.assert_allclose(found.energy[0, b], energy_of(10.0) - (4e3 if apart > 0.0 else 0.0), rtol=1e-9)


def test_a_rock_with_a_shape_comes_with_what_is_left_of_translation_and_rotation():
    """The last net ends the flights, because plain Python is slow for bodies on the ground."""
    rng, count, capacities = np.random.default_rng(3), 6, [GAUGE, 2e3, GAUGE, 1e3, GAUGE, 1e9]
    terrain = rough_ground()
    nets = fences(*(fence(terrain, [(10.0, -WIDE), (10.0, WIDE)], TALL, capacity) for capacity in capacities))
    x = np.stack([rng.uniform(-1, 1, count), rng.uniform(-3, 3, count), rng.uniform(2.5, 4, count)], 1)
    v = np.stack([rng.uniform(1, 8, count), *rng.uniform(-1, 1, (2, count))], 1)
    shapes = [box((1.0, 0.8, 0.5))]
    terms = Terms((ground(0.6, 0.1, 0.2, 0.5),), 4e-3, 60_000, 60.0, effects=(nets,), mass=MASS)
    end = flown(made.engine_over("reference", terrain), shapes, drop(shapes, x, random_poses(rng, count), v), terms)
    rocks = FlownRocks(
        counts=end.counts, finals=end.finals, impacts=end.impacts, facets=end.facets, pieces=end.pieces,
        modes=end.modes, first=end.first, mass=np.full(count, MASS), radius=np.full(count, RADIUS), gravity=G,
    )  # fmt: skip
    found = each_way(nets, rocks)
    turning = 0
    for r in range(count):
        rows = np.arange(*end.first[r : r + 2, 0])
        q = rows[end.facets[rows] < 0][0]
        before = MASS * end.impacts[q, BLOW + 1]
        turning += before > 1.02 * energy_of(end.impacts[q, 7])
        np.testing.assert_allclose(found.energy[r], left(before, capacities), rtol=1e-9)
        np.testing.assert_allclose(found.t[r], end.impacts[q, 0], rtol=1e-9)
    assert turning >= 3 and (found.did == [THROUGH] * 5 + [HELD]).all()


class Wall(NamedTuple):
    """A random barrier at x (m) on ground of height z (m); the fields are those of `fence`."""

    x: float
    z: float
    height: float
    capacity: float
    taken: float
    top: bool


def valley(random: np.random.Generator) -> tuple[Terrain, list[Wall]]:
    """Return a valley that is level along y, and barriers of random strength and order in two places of its slope."""
    fall, rise = np.tan(np.radians(random.uniform((30, 25), (45, 60))))
    bottom = random.uniform(18.0, 28.0)
    profile = [(-10.0, 10 * fall), (bottom, -bottom * fall), (80.0, -bottom * fall + (80.0 - bottom) * rise)]
    places = np.sort(random.uniform(8.0, bottom - 1.0, 2))
    walls = [
        Wall(
            x=float(x), z=float(-x * fall), height=float(random.choice([0.7, 1.2, 2.5, TALL])),
            capacity=float(random.choice([0.0, 0.0, 2e3, 10e3, 40e3])), taken=float(random.uniform(0.1, 1.0)),
            top=bool(random.integers(2)),
        )
        for x in random.choice(places, 9)
    ]  # fmt: skip
    return made.strip(profile, 60.0, 3), walls


def visits(flights: Flights, row: int, x: float) -> list[tuple[float, float, float]]:
    """Return time (s), energy before (J) and height z (m) each time that the path of a rock comes to the plane at x."""
    paths, found = flights.paths, []
    for p in np.flatnonzero(paths.row == row)[:-1]:
        begin, end, duration = paths.x[p], paths.x[p + 1], paths.t[p + 1] - paths.t[p]
        away, beyond = abs(begin[0] - x), (end[0] - x) * np.sign(x - begin[0])
        if away < ON or beyond < -ON or not duration > 0.0:
            continue
        found.append(passage(paths, p, x, G))
    return found


def recounted(flights: Flights, walls: list[Wall], row: int) -> tuple[list[tuple], np.ndarray]:
    """Return first arrivals (result, time s, energy J) of a rock at walls, and the numbers of its arrivals by result.

    At each visit the rule is applied to the walls of the place in the order of their numbers.
    """
    first, events = [(NEVER, math.inf, 0.0)] * len(walls), np.zeros((len(walls), 4), dtype=int)
    for x in {wall.x for wall in walls}:
        for t, energy, z in visits(flights, row, x):
            for b, wall in enumerate(walls):
                if wall.x != x:
                    continue
                over = z - wall.z + RADIUS * wall.top > wall.height
                did = OVER if over else HELD if 0.0 < wall.capacity >= energy else THROUGH
                first[b] = min(first[b], (did, t, energy), key=lambda arrival: arrival[1])
                events[b, did] += 1
                energy -= wall.taken * wall.capacity if did == THROUGH else 0.0
                if did == HELD:
                    break
    return first, events


@pytest.mark.parametrize(("engine", "seeds", "rocks"), [("compiled", range(12), 60), ("reference", (12, 13), 8)])
def test_first_arrivals_are_those_of_the_rule_for_random_barriers_in_two_places(engine, seeds, rocks):
    seen, after = np.zeros(4, dtype=int), 0
    for seed in seeds:
        random = np.random.default_rng(seed)
        terrain, walls = valley(random)
        nets = fences(*(
            fence(terrain, [(w.x, -59.0), (w.x, 59.0)][:: random.choice([-1, 1])], w.height, w.capacity, w.taken, w.top)
            for w in walls
        ))  # fmt: skip
        x = np.stack([random.uniform(-2, 0, rocks), random.uniform(-9, 9, rocks), random.uniform(3, 9, rocks)], 1)
        v = np.stack([random.uniform(1, 9, rocks), random.uniform(-1, 1, rocks), np.zeros(rocks)], 1)
        friction = random.uniform(10, 30)
        flights, found = arrive(engine, terrain, nets, x, v, R_n=0.5, R_t=0.9, friction_angle=friction)
        for row in range(rocks):
            first, events = recounted(flights, walls, row)
            did, t, energy = (np.array(column) for column in zip(*first, strict=True))
            assert found.did[row].tolist() == did.tolist()
            assert (found.events[row] == events).all()
            np.testing.assert_allclose(found.t[row], t, rtol=1e-9)
            np.testing.assert_allclose(found.energy[row], energy, rtol=1e-8, atol=1e-6)
            seen += events.sum(axis=0)
            after += sum(w.capacity == 0.0 and any(
                o.x == w.x and did[k] == THROUGH and o.capacity > 0.0 for k, o in enumerate(walls[:b])
            ) for b, w in enumerate(walls) if did[b] == THROUGH)  # fmt: skip
    assert (seen[1:] > 0).all() and after > rocks
