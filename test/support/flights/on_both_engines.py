"""Parameters for tests of flights on both engines, and checks of the flights."""

from dataclasses import replace

import numpy as np
import pytest

from flights.scenes_of_facets import ENGINES
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.winding import repair_winding
from rpf3d_core.values import Mode, Outcome

G = 9.81
NEAR = 1e-6
"""Distance (m) that counts as zero: far above the tolerance (1e-11 m), far below any relevant distance."""
BOTH = pytest.mark.parametrize("engine", ENGINES)
MODELS = pytest.mark.parametrize("model", ["none", "sliding"])


def as_loaded(terrain: Terrain) -> Terrain:
    """Return the terrain with repaired winding, like every terrain that is read from a file."""
    winding = repair_winding(terrain.vertices, terrain.triangles, edges_of(terrain.triangles, len(terrain.vertices)))
    return replace(terrain, triangles=winding.triangles)


def lies_on(engine: Engine, flights: Flights) -> bool:
    """Return True if every rock that stopped has ground at most NEAR below it."""
    x = flights.deposits.x[flights.deposits.outcome == Outcome.STOPPED] + (0, 0, NEAR)
    below = engine.ground_below(x)
    return bool(np.all(below[:, 1] >= 0) and np.all(below[:, 0] <= 2 * NEAR))


def outcomes(flights: Flights) -> set[Outcome]:
    """Return the set of the outcomes of all rocks."""
    return {Outcome(outcome) for outcome in flights.deposits.outcome}


def along_flights(flights: Flights, gravity: float = G, samples: int = 9) -> np.ndarray:
    """Return points (N, 3) m on all paths: all events, and `samples` evenly spaced points on each arc."""
    paths = flights.paths
    going = np.flatnonzero(paths.mode[:-1] == Mode.FLIGHT)
    t = np.linspace(0.0, 1.0, samples)[:, None, None] * (paths.t[going + 1] - paths.t[going])[:, None]
    arcs = paths.x[going] + paths.v[going] * t - 0.5 * t * t * np.array([0.0, 0.0, gravity])
    return np.concatenate([paths.x, arcs.reshape(-1, 3)])


def loses_energy(flights: Flights, gravity: float = G, room: float = 1e-9) -> bool:
    """Return True if no rock gains energy anywhere on its path.

    room : allowed gain by rounding, as a share of the largest energy of all rocks (-)
    """
    paths = flights.paths
    after = gravity * paths.x[:, 2] + 0.5 * (paths.v**2).sum(1)
    before = gravity * paths.x[1:, 2] + 0.5 * (paths.v_end[:-1] ** 2).sum(1)
    same = np.diff(paths.row) == 0
    slack = room * np.abs(after).max() + 1e-12
    return bool(np.all((before - after[:-1])[same] <= slack) and np.all((after[1:] - before)[same] <= slack))
