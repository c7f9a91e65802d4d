"""Rocks of a scene flown one way: what came of each of them, which cells they reached, and what it cost."""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from rpf3d_core.ensemble.flights import Flights, IntArray
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases, share_out
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.hazard.convergence import Step, step_of
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.setup.prepared import Prepared, check_releases, empty_tallies, releases_in_ranges
from rpf3d_core.simulation.engines import Engine, warm
from rpf3d_core.values import Mode

PILOT = 40
"""Rocks that tell what a rock costs before all of them fly."""


@dataclass(frozen=True, eq=False)
class Reached:
    """The map of an ensemble: cells (S,) of the raster that rocks came to, and how many of `flown` rocks (S,)."""

    cells: IntArray
    rocks: IntArray
    flown: int


@dataclass(frozen=True, eq=False)
class FlownSample:
    """N rocks flown one way.

    rows : (N,) which of the releases that were to fly; flights : all of them, with impacts and, if asked for, paths
    reached : their map; places : shares of zones or areas of interest; seconds : of one core, to fly and to count them
    """

    rows: IntArray
    flights: Flights
    reached: Reached
    places: Step
    seconds: float

    @property
    def seconds_per_1000(self) -> float:
        """Of one core, to fly and count 1,000 rocks."""
        return 1000.0 * self.seconds / len(self.rows)


def some_rocks(prepared: Prepared, rocks: int, first: int = 0) -> Releases:
    """So many rocks of a scene, dealt to its sources in proportion, from the `first` such lot of them on.

    Raises
    ------
    InputError
        A source is off the terrain, or a rock starts under the ground.
    """
    shares = share_out([source.rocks for source in prepared.sources], rocks)
    releases = releases_in_ranges(prepared, [range(first * n, (first + 1) * n) for n in shares])
    check_releases(prepared, releases)
    return releases


def with_engine(prepared: Prepared, engine: Engine) -> Prepared:
    """The same scene, flown by another engine or method."""
    return replace(prepared, engine=engine)


def fly(prepared: Prepared, releases: Releases, budget: float = math.inf, paths: bool = False) -> FlownSample:
    """Fly and count rocks, fewer of them where all would take more than a budget (s of one core).

    Fewer are evenly spread over all, so they stand for the same sources and places.

    paths : whether to keep them, beside the impacts
    """
    _warm(prepared)
    rows = np.arange(len(releases.x))
    if budget < math.inf and len(rows) > PILOT:
        pilot = _fly_rows(prepared, releases, spread(rows, PILOT), paths)
        rows = spread(rows, affordable(len(rows), pilot.seconds / PILOT, budget))
    return _fly_rows(prepared, releases, rows, paths)


def affordable(rocks: int, seconds: float, budget: float) -> int:
    """So many rocks, or half, a quarter, ... of them, that they keep to a budget (s); never fewer than PILOT.

    Halves, so that the same rocks fly, and the same errors are told, wherever a machine is about as fast.

    seconds : that one rock takes
    """
    while rocks * seconds > budget and rocks > PILOT:
        rocks = max(rocks // 2, PILOT)
    return rocks


def spread(rows: IntArray, some: int) -> IntArray:
    """At most `some` of rows (N,), evenly spread over them."""
    return np.asarray(rows[np.unique(np.linspace(0, len(rows) - 1, min(some, len(rows))).astype(np.int64))])


def _warm(prepared: Prepared) -> None:
    """Compile what flying and counting takes, for that is no part of their price."""
    flight = prepared.flight
    warm(prepared.engine, flight.models, flight.materials, flight.settings)
    empty_tallies(prepared).warm()


def _fly_rows(prepared: Prepared, releases: Releases, rows: IntArray, paths: bool) -> FlownSample:
    tallies, some = empty_tallies(prepared), taken(releases, rows)
    began = time.process_time()
    flights = fly_ensemble(prepared.engine, prepared.flight, some, paths=None if paths else 0, watch=tallies)
    seconds = time.process_time() - began
    return FlownSample(rows, flights, reached_in(tallies, len(rows)), places_in(prepared, tallies, len(rows)), seconds)


def reached_in(tallies: Tallies, flown: int) -> Reached:
    """The map of what has been counted of so many rocks."""
    found = tallies.squares.found()
    return Reached(found.cell.astype(np.int64), found.rocks, flown)


def places_in(prepared: Prepared, tallies: Tallies, flown: int) -> Step:
    """Shares of the areas of interest or, without any, of the zones."""
    return step_of(tallies.places(flown, prepared.area_names), prepared.terrain.zones)


def flight_seconds(flights: Flights) -> float:
    """Seconds that the rocks of flights with all their paths were in the air, together."""
    paths = flights.paths
    aloft = np.flatnonzero(paths.mode == Mode.FLIGHT)
    return float((paths.t[aloft + 1] - paths.t[aloft]).sum())
