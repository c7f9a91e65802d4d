"""Record the calls of the kernels for rocks with a shape, while the reference engine flies such rocks.

The reference engine calls the same functions with the same numbers as the compiled engine, but as plain Python. So a
wrapper around each function can store the arguments, as arrays that compiled code can read.
"""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import accumulate
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.body import impact
from rpf3d_core.body.clearance import clear_time
from rpf3d_core.body.contacts import CONTACT_COLUMNS, SOLVER_COLUMNS
from rpf3d_core.body.distance import separation
from rpf3d_core.body.inelastic import inelastic
from rpf3d_core.body.rotation import turned_for, turning_of
from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.setup.prepared import Prepared, releases_in_ranges
from rpf3d_core.simulation.bodies import contact, motion, survey
from rpf3d_core.simulation.bodies.room import CONTACTS

Floats = NDArray[np.float64]

CALLERS = {
    "inelastic": (impact, contact),
    "separation": (survey,),
    "clear_time": (survey,),
    "turning_of": (motion,),
    "turned_for": (motion,),
}
"""Name of each recorded function -> modules that call the function."""


class Calls(NamedTuple):
    """All recorded calls of a kernel, as arrays for a loop that repeats the calls.

    count : number of rows over which the loop runs
    given : arrays that the loop reads; changed : arrays that the loop writes, with their contents before the calls
    """

    count: int
    given: tuple[NDArray[Any], ...]
    changed: tuple[NDArray[Any], ...]


class CallRecorder:
    """Records calls: each method named after a function stores the arguments, calls it, and returns its result."""

    def __init__(self) -> None:
        self._points: list[Floats] = []
        self._solved: list[tuple[float, ...]] = []
        self._searched: list[tuple[Any, ...]] = []
        self._arms: dict[bytes, tuple[int, int, Floats]] = {}
        self._waited: list[tuple[int, tuple[float, ...]]] = []
        self._turned: list[tuple[tuple[float, ...], list[float]]] = []
        self._latest: dict[tuple[float, ...], list[float]] = {}

    def inelastic(self, points: Any, rows: Any, count: int, moments: Any, velocity: Any, within: float) -> Any:
        """Record a call of `inelastic`, which solves an impact or contact, and return its result."""
        self._points.append(points[:count].copy())
        self._solved.append((*moments, within, *velocity.v, *velocity.w))
        return inelastic(points, rows, count, moments, velocity, within)

    def separation(self, corners: Any, first: int, last: int, size: float, facet: Any, guess: Any) -> Any:
        """Record a call of `separation`, which finds the distance of a body and a facet, and return its result."""
        self._searched.append((first, last, size, *facet[0], *facet[1], *facet[2], *guess))
        return separation(corners, first, last, size, facet, guess)

    def clear_time(self, arms: Any, count: int, sweep: Any, plane: Any, most: float) -> float:
        """Record a call of `clear_time`, which returns a time (s) without contact, and return its result."""
        body = self._arms.setdefault(arms[:, :count].tobytes(), (len(self._arms), count, arms.copy()))[0]
        moves = (*sweep.x, *sweep.v, *sweep.w, *sweep.q, sweep.gravity, sweep.spin_bound)
        self._waited.append((body, (*moves, *plane[0], plane[1], most)))
        return float(clear_time(arms, count, sweep, plane, most))

    def turning_of(self, moments: Any, q: Any, w: Any) -> Any:
        """Record a call of `turning_of`, which begins a free rotation, and return its result."""
        key: tuple[float, ...] = (*moments, *q, *w)
        self._latest[key] = []
        self._turned.append((key, self._latest[key]))
        return turning_of(moments, q, w)

    def turned_for(self, turning: Any, t: float) -> Any:
        """Record a call of `turned_for` as one more time (s) of a recorded rotation, and return its result."""
        self._latest[(*turning.moments, *turning.q, *turning.w)].append(t)
        return turned_for(turning, t)

    def calls(self, corners: Floats) -> dict[str, Calls]:
        """Return all recorded calls, by the name of the loop that repeats them (`block_kernels.py`, `cpp/blocks.cpp`).

        corners : (N, 3) corners of all shapes, for rocks of size 1 (m)
        """
        return {
            "solve_impacts": self._impacts(),
            "find_distances": self._distances(corners),
            "find_clear_times": self._clear_times(),
            "find_rotations": self._rotations(),
        }

    def _impacts(self) -> Calls:
        numbers = np.array(self._solved).reshape(-1, 10)
        first = _starts(map(len, self._points))
        points = np.concatenate([np.empty((0, CONTACT_COLUMNS)), *self._points])
        rows = np.zeros((CONTACTS, SOLVER_COLUMNS))
        return calls_of([first, numbers[:, :3], numbers[:, 3], rows], [points, numbers[:, 4:]])

    def _distances(self, corners: Floats) -> Calls:
        numbers = np.array(self._searched).reshape(-1, 15)
        ends, facets = numbers[:, :2].astype(np.int64), numbers[:, 3:12].reshape(-1, 3, 3)
        given = [corners, ends, numbers[:, 2], facets, numbers[:, 12:]]
        return calls_of(given, [np.zeros((len(numbers), 11))])

    def _clear_times(self) -> Calls:
        arms = np.array([each for _, _, each in self._arms.values()])
        sizes = np.array([(count, each.shape[1]) for _, count, each in self._arms.values()], dtype=np.int64)
        body = np.array([body for body, _ in self._waited], dtype=np.int64)
        numbers = np.array([numbers for _, numbers in self._waited]).reshape(-1, 20)
        given = [arms, sizes, body, numbers[:, :15], numbers[:, 15:19], numbers[:, 19]]
        return calls_of(given, [np.zeros(len(numbers))])

    def _rotations(self) -> Calls:
        numbers = np.array([key for key, _ in self._turned]).reshape(-1, 10)
        times = np.array([t for _, each in self._turned for t in each])
        first = _starts(len(each) for _, each in self._turned)
        given = [numbers[:, :3], numbers[:, 3:7], numbers[:, 7:], first, times]
        return calls_of(given, [np.zeros((len(times), 7))], count=len(numbers))


def _starts(lengths: Iterable[int]) -> NDArray[np.int64]:
    """Return the first row of each of N consecutive groups of rows, and then the total number of rows: (N + 1,)."""
    return np.array([0, *accumulate(lengths)], dtype=np.int64)


def calls_of(given: list[NDArray[Any]], changed: list[NDArray[Any]], count: int | None = None) -> Calls:
    """Return the recorded calls of a kernel with contiguous arrays.

    given, changed : as in `Calls`; count : number of calls, by default the rows of the last array in `changed`
    """
    read, written = (tuple(map(np.ascontiguousarray, arrays)) for arrays in (given, changed))
    return Calls(len(changed[-1]) if count is None else count, read, written)


@contextmanager
def recording() -> Iterator[CallRecorder]:
    """Context manager: record all calls of the kernels by the reference engine, and yield the recorder."""
    recorder = CallRecorder()
    with ExitStack() as stack:
        for name, modules in CALLERS.items():
            for module in modules:
                stack.enter_context(mock.patch.object(module, name, getattr(recorder, name)))
        yield recorder


def recorded_calls(prepared: Prepared, rocks: int) -> tuple[dict[str, Calls], Deposits]:
    """Fly rocks of a scene's first source on the reference engine; return the calls of the kernels, and the deposits.

    prepared : the scene, prepared for the reference engine; rocks : number of rocks
    """
    ranges = [range(rocks)] + [range(0)] * (len(prepared.sources) - 1)
    releases = releases_in_ranges(prepared, ranges)
    with recording() as recorder:
        flights = fly_ensemble(prepared.engine, prepared.flight, releases, record=False)
    return recorder.calls(np.asarray(prepared.flight.models.rebound.shapes.corners)), flights.deposits
