"""Fly the critical rock of a run again, if its path is not among the kept paths, so that a report can draw it.

The critical rock is the rock that stopped farthest from its release. It is known only after all rocks have flown.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import Deposits, Flights
from rpf3d_core.ensemble.paths import displayed_rows
from rpf3d_core.ensemble.totals import FarthestRock
from rpf3d_core.results.findings import Run
from rpf3d_core.runs.fly_scene import RunControl, fly_scene
from rpf3d_core.setup.precompiler import Precompiler
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.setup.rounds import Round


def with_critical_path(run: Run, threads: int | None = None) -> Run:
    """Fly the critical rock of a run again, and return the run with this flight in `Run.critical`.

    The run is returned unchanged if the path of this rock is already kept, if no rock stopped, or if the repeated
    flight does not have the rock.

    threads : number of threads for the compiled engine; None for one thread for each core
    """
    rock = run.totals.farthest
    if rock is None or _is_kept(run, rock):
        return run
    flights = fly_one(run.prepared, rock.source, rock.rock, threads).flights
    row = rows_of(flights.deposits, rock)
    return replace(run, critical=_alone(flights, row[0])) if len(row) else run


def fly_one(prepared: Prepared, source: int, rock: int, threads: int | None = None) -> Run:
    """Fly one rock of a prepared scene, bit for bit as in the whole run; return the run of this rock, with its path.

    source : number of the source, from 0; rock : number of the rock in its source, from 0
    threads : number of threads for the compiled engine; None for one thread for each core
    """
    outputs = prepared.scene.outputs
    kept = outputs.model_copy(update={"trajectories": max(outputs.trajectories, 1)})
    scene = prepared.scene.model_copy(update={"outputs": kept})
    first = [rock if i == source else 0 for i in range(len(scene.sources))]
    one_rock = Round(first, [n + (i == source) for i, n in enumerate(first)])
    control = RunControl(threads=threads)
    return fly_scene(replace(prepared, scene=scene), Precompiler(), None, control=control, rounds=[one_rock])


def rows_of(deposits: Deposits, rock: FarthestRock) -> np.ndarray:
    """Return the row numbers of a rock, or of one of its fragments, in a table of deposits: an array (0,) or (1,)."""
    is_rock = (deposits.source == rock.source) & (deposits.rock == rock.rock) & (deposits.piece == rock.piece)
    return np.flatnonzero(is_rock)


def _is_kept(run: Run, rock: FarthestRock) -> bool:
    """Return True if the path of a rock is among the kept paths that the result of a run displays."""
    flights = run.flights
    drawn = displayed_rows(flights.paths, run.scene.outputs.trajectories)
    return bool(np.isin(rows_of(flights.deposits, rock), drawn).any())


def _alone(flights: Flights, row: int) -> Flights:
    """Return the flights with the path of one rock only; row : its row in the deposits."""
    paths = flights.paths
    mine = paths.row == row
    columns: dict[str, Any] = {name: values[mine] for name, values in vars(paths).items() if values is not None}
    return replace(flights, paths=replace(paths, **columns))
