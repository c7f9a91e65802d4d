"""Fly rocks of a scene with one engine or method, to compare results and cost between settings."""

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
from rpf3d_core.setup.precompiler import Precompiler
from rpf3d_core.setup.prepared import Prepared, check_releases, empty_tallies, releases_in_ranges
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.values import Mode

PILOT = 40
"""Number of rocks that are flown first, to estimate the time of one rock."""


@dataclass(frozen=True, eq=False)
class Reached:
    """The map of reach probability of flown rocks, as numbers of rocks in cells, to compare it with another map.

    cells : (S,) numbers of the S reached cells of the raster, ascending; rocks : (S,) number of rocks in each cell
    flown : number of all flown rocks
    """

    cells: IntArray
    rocks: IntArray
    flown: int


@dataclass(frozen=True, eq=False)
class FlownSample:
    """The result of N rocks flown with one engine or method: their flights, their map, and the time taken.

    rows : (N,) for each rock, its row in the `Releases` from which the N rocks were selected
    flights : the flights of all N rocks, with impacts and, if requested, paths
    reached : the map of the rocks; places : shares of rocks that reached or stopped in zones or areas of interest
    seconds : computing time to fly the rocks and to count them into maps, s of one core
    """

    rows: IntArray
    flights: Flights
    reached: Reached
    places: Step
    seconds: float

    @property
    def seconds_per_1000(self) -> float:
        """Time to fly and count 1,000 rocks, in seconds of one core."""
        return 1000.0 * self.seconds / len(self.rows)


def some_rocks(prepared: Prepared, rocks: int, first: int = 0) -> Releases:
    """Return the releases of a number of rocks, divided among the sources as in the scene.

    The number of rocks of each source is proportional to its number of rocks in the scene.

    first : number of groups of `rocks` rocks to skip; different values of `first` give different rocks

    Raises
    ------
    InputError
        A rock starts outside the terrain or under the ground.
    """
    shares = share_out([source.rocks for source in prepared.sources], rocks)
    releases = releases_in_ranges(prepared, [range(first * n, (first + 1) * n) for n in shares])
    check_releases(prepared, releases)
    return releases


def with_engine(prepared: Prepared, engine: Engine) -> Prepared:
    """Return the same scene with another engine, to fly its rocks with another method of finding contacts."""
    return replace(prepared, engine=engine)


def fly(prepared: Prepared, releases: Releases, budget: float = math.inf, paths: bool = False) -> FlownSample:
    """Fly rocks and count them into maps; fly only a selection if all rocks would exceed a time budget.

    The selected rocks are evenly spread over all rocks, so they represent the same sources and places.

    budget : seconds of one core; paths : True to keep the paths in addition to the impacts
    """
    Precompiler().compile(prepared, empty_tallies(prepared))  # the price of rocks does not include compilation
    rows = np.arange(len(releases.x))
    if budget < math.inf and len(rows) > PILOT:
        pilot = _fly_rows(prepared, releases, spread(rows, PILOT), paths)
        rows = spread(rows, affordable(len(rows), pilot.seconds / PILOT, budget))
    return _fly_rows(prepared, releases, rows, paths)


def affordable(rocks: int, seconds: float, budget: float) -> int:
    """Return the number of rocks that can be flown within a time budget: the given number, halved until the rocks fit.

    The result is at least PILOT (40), unless fewer rocks are given. Because the number can only be halved, machines of
    similar speed usually fly the same number of rocks, and so measure the same errors.

    rocks : the given number; seconds : s, time of one rock; budget : s, time for all rocks
    """
    while rocks * seconds > budget and rocks > PILOT:
        rocks = max(rocks // 2, PILOT)
    return rocks


def spread(rows: IntArray, some: int) -> IntArray:
    """Return at most `some` of the rows (N,), evenly spaced, so that the selected rocks represent all sources."""
    return np.asarray(rows[np.unique(np.linspace(0, len(rows) - 1, min(some, len(rows))).astype(np.int64))])


def _fly_rows(prepared: Prepared, releases: Releases, rows: IntArray, paths: bool) -> FlownSample:
    tallies, some = empty_tallies(prepared), taken(releases, rows)
    began = time.process_time()
    flights = fly_ensemble(prepared.engine, prepared.flight, some, paths=None if paths else 0, watch=tallies)
    seconds = time.process_time() - began
    return FlownSample(rows, flights, reached_in(tallies, len(rows)), places_in(prepared, tallies, len(rows)), seconds)


def reached_in(tallies: Tallies, flown: int) -> Reached:
    """Return the map of reached cells from the counts that were added during the flights; flown : number of rocks."""
    found = tallies.squares.found()
    return Reached(found.cell.astype(np.int64), found.rocks, flown)


def places_in(prepared: Prepared, tallies: Tallies, flown: int) -> Step:
    """Return the shares of rocks that reach or stop in each area of interest.

    In a scene without areas, the shares are those of the zones that rocks reached.

    tallies : counts that were added during the flights; flown : number of rocks
    """
    return step_of(tallies.places(flown, prepared.area_names), prepared.terrain.zones)


def flight_seconds(flights: Flights) -> float:
    """Return the total time in flight (s) of all rocks, from their recorded paths; all paths must be recorded."""
    paths = flights.paths
    aloft = np.flatnonzero(paths.mode == Mode.FLIGHT)
    return float((paths.t[aloft + 1] - paths.t[aloft]).sum())
