"""Tests that counts at barriers equal counts in plain Python from impacts and paths, over random valleys.

Rocks break through, climb the far side and come back, fly over on the way out and are caught on the way back. These
tests share no code with the package: a fence stands on a level line x = const, and the tables give its contacts.
"""

from dataclasses import dataclass, field

import numpy as np
import pytest
from flights import scenes_of_facets as made
from flights.obstacles_made import MASS, RADIUS, fence, fences, passage, with_effects

from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.hazard.barriers import BarrierTally

G = 9.81
HALF = 60.0
CAUGHT = 2
FIXED = [1, 1115, 1290, 1378, 20001, 20002, 20003]
"""Seeds of valleys; those from 20001 on were not used while the audit was written."""


@dataclass
class Fence:
    """A fence at x (m) on ground of height z (m), with the counts at this fence."""

    x: float
    z: float
    height: float
    capacity: float
    taken: float
    top: bool
    first: dict = field(default_factory=lambda: {"caught": 0, "broken": 0, "over": 0})
    events: dict = field(default_factory=lambda: {"caught": 0, "broken": 0, "over": 0})
    caught: int = 0
    caught_after_a_break: int = 0
    energies: list = field(default_factory=list)
    heights: list = field(default_factory=list)

    def take(self, events):
        """Count one rock by its events, a list in any order of (time s, kind, energy J, height m)."""
        if not events:
            return
        events.sort()
        _, what, energy, height = events[0]
        self.first[what] += 1
        self.energies.append(energy)
        self.heights.append(height)
        for event in events:
            self.events[event[1]] += 1
        if any(event[1] == "caught" for event in events):
            self.caught += 1
            self.caught_after_a_break += what == "broken"


def valley(random):
    """Return a valley that is level along y, and two fences on the slope where rocks start."""
    fall, rise, far = np.tan(np.radians(random.uniform((30, 25, 10), (45, 60, 30))))
    bottom = random.uniform(18.0, 28.0)
    low = -bottom * fall
    profile = [(-10.0, 10 * fall), (bottom, low), (bottom + 25.0, low + 25 * rise), (90.0, low + 25 * rise + 20 * far)]
    places = np.sort(random.uniform(8.0, bottom - 1.0, 2))
    some = [
        Fence(
            float(x), float(-x * fall), float(random.uniform(0.4, 2.5)), float(random.uniform(3e3, 60e3)),
            float(random.uniform(0.1, 1.0)), bool(random.integers(2)),
        )
        for x in places
    ]  # fmt: skip
    return made.strip(profile, HALF, int(random.integers(1, 7))), some


def flown(seed, engine, rocks):
    """Fly rocks over the valley of a seed.

    Return the flights, the fences, the barrier number of each panel, and the tally.
    """
    random = np.random.default_rng(seed)
    terrain, some = valley(random)
    nets = fences(*(
        fence(terrain, [(f.x, -HALF + 1), (f.x, HALF - 1)], f.height, f.capacity, f.taken, f.top) for f in some
    ))  # fmt: skip
    tally = BarrierTally(nets, ("upper", "lower"), G, engine == "compiled")

    def watch(batch, releases):
        tally(batch, releases)
        return np.zeros(len(batch.rows))

    x = np.stack([random.uniform(-2, 0, rocks), random.uniform(-9, 9, rocks), random.uniform(3, 9, rocks)], 1)
    v = np.stack([random.uniform(1, 9, rocks), random.uniform(-1, 1, rocks), np.zeros(rocks)], 1)
    ground = made.surface(random.uniform(0.4, 0.75), random.uniform(0.75, 0.95), random.uniform(15, 35))
    physics = with_effects(made.flight(ground), nets)
    over = made.engine_over(engine, terrain)
    return made.fly(over, physics, x, v, watch=watch), some, nets.panel.barrier, tally


def recounted(flights, some, barrier_of):
    """Count rocks and events at each fence `some` from the tables of impacts and paths."""
    impacts, paths, deposits = flights.impacts, flights.paths, flights.deposits
    for row, outcome in enumerate(deposits.outcome.tolist()):
        contacts, mine = [[], []], np.flatnonzero(impacts.row == row)
        for i in mine[impacts.facet[mine] < 0]:
            b = int(barrier_of[-2 - impacts.facet[i]])
            what = "caught" if outcome == CAUGHT and i == mine[-1] else "broken"
            height = impacts.x[i, 2] - some[b].z + RADIUS * some[b].top
            contacts[b].append((float(impacts.t[i]), what, 0.5 * MASS * impacts.speed_in[i] ** 2, height))
        for b, one in enumerate(some):
            one.take(contacts[b] + overflights(paths, np.flatnonzero(paths.row == row), one))


def overflights(paths, rows, one):
    """Return the events of a rock that crosses the plane of a fence above the fence; rows : of its path."""
    found = []
    for p in rows[:-1]:
        begin, end, duration = paths.x[p], paths.x[p + 1], paths.t[p + 1] - paths.t[p]
        if (begin[0] < one.x) == (end[0] < one.x) or not duration > 0.0:
            continue
        t, energy, z = passage(paths, p, one.x, G)
        height = z - one.z + RADIUS * one.top
        if height > one.height + 1e-9:
            found.append((t, "over", energy, height))
    return found


def agrees(figures, one):
    """Assert that the reported figures of a barrier equal the counts of a fence."""
    told = (figures.first_caught, figures.first_broken_through, figures.first_flown_over, figures.caught)
    events = (figures.caught_events, figures.broken_through_events, figures.flown_over_events)
    assert told == (*(one.first[what] for what in ("caught", "broken", "over")), one.caught)
    assert events == tuple(one.events[what] for what in ("caught", "broken", "over"))
    assert figures.came == len(one.energies) == sum(one.first.values())
    for sample, values in ((figures.counted.energy, one.energies), (figures.counted.height, one.heights)):
        ranked, counts = sample.sorted()
        assert np.repeat(ranked, counts) == pytest.approx(np.sort(values), rel=1e-8, abs=1e-7)
    assert figures.counted.over.count == one.first["over"]


@pytest.mark.parametrize("seed", FIXED)
def test_what_is_told_of_barriers_is_what_the_tables_say(seed):
    flights, some, barrier_of, tally = flown(seed, "compiled", 150)
    recounted(flights, some, barrier_of)
    for figures, one in zip(tally.figures, some, strict=True):
        agrees(figures, one)


def test_plain_python_counts_the_same():
    flights, some, barrier_of, tally = flown(2, "reference", 25)
    recounted(flights, some, barrier_of)
    for figures, one in zip(tally.figures, some, strict=True):
        agrees(figures, one)


def test_the_audit_meets_rocks_that_break_through_and_are_caught_by_the_same_fence_later():
    """Without such rocks, the audit could not distinguish first arrivals from later ones."""
    again = over_first = events = came = 0
    for seed in FIXED:
        flights, some, barrier_of, tally = flown(seed, "compiled", 150)
        recounted(flights, some, barrier_of)
        again += sum(one.caught_after_a_break for one in some)
        over_first += sum(one.first["over"] for one in some)
        events += sum(sum(one.events.values()) for one in some)
        came += sum(figures.came for figures in tally.figures)
        assert all(figures.caught >= figures.first_caught for figures in tally.figures)
    assert again > 20 and over_first > 20 and events > 1.2 * came


def test_an_interval_of_a_percentile_holds_it_as_often_as_it_says():
    """For 2,000 samples of 300 values with a known p95, 93 to 98 % of the intervals contain it."""
    random, truth = np.random.default_rng(5), -np.log(0.05)
    holds = 0
    for _ in range(2000):
        low, high = Sample(random.exponential(size=300)).interval(95)
        holds += low <= truth <= high
    assert 0.93 * 2000 <= holds <= 0.98 * 2000


@pytest.mark.parametrize(("values", "open_above"), [(0, True), (5, True), (60, True), (200, False)])
def test_few_values_leave_a_percentile_open_above(values, open_above):
    low, high = Sample(np.arange(float(values))).interval(95)
    assert (high is None) == open_above
    assert (low is None) == (values < 1)
