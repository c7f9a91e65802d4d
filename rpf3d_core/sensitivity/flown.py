"""Fly parameter sets of a scene, all with the same rocks, and return the results for a sensitivity analysis."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.flown_passages import visited
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.batches import BatchControl, Keep, fly_batches
from rpf3d_core.ensemble.even_rounds import rocks_of_round
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.jit.cores import usable_cores
from rpf3d_core.setup.parameter_sets import flight_of_set
from rpf3d_core.setup.prepared import Prepared, check_releases, releases_in_ranges
from rpf3d_core.simulation.engines import Compiled, precompile_flights
from rpf3d_core.values import DEPOSITED

FloatArray = NDArray[np.float64]

JOULE_PER_KJ = 1000.0


@dataclass(frozen=True, eq=False)
class Compared:
    """The inputs of a sensitivity analysis: a prepared scene, the key paths of its unknowns, and the rocks of each set.

    names : key paths of the U unknowns; releases : releases of the rocks that fly with each parameter set
    results : names of the Y results; units : unit of each result: % for shares of rocks, m or kJ
    """

    prepared: Prepared
    names: tuple[str, ...]
    releases: Releases
    results: tuple[str, ...]
    units: tuple[str, ...]


def compared(prepared: Prepared, names: tuple[str, ...], rocks: int) -> Compared:
    """Check the releases of a scene, compile its flights, and return the inputs of a sensitivity analysis.

    The results are the shares of rocks that reach each area, the mean and the p95 runout, and the p95 of each rock's
    largest translational energy. In a scene without areas, the shares that stop in each zone replace the shares that
    reach each area. Runouts and energies are those of all rocks, also of rocks that left the terrain.

    names : key paths of the unknowns; rocks : number of rocks of each parameter set

    Raises
    ------
    InputError
        A release point is refused; the message names its source.
    """
    releases = releases_in_ranges(prepared, rocks_of_round(prepared.sources, rocks, 0))
    check_releases(prepared, releases)
    precompile_flights(prepared.engine, prepared.flight.models, prepared.flight.materials, prepared.flight.settings)
    areas = [f"share that reaches {name}" for name in prepared.area_names]
    places = areas or [f"share that stops in {zone}" for zone in prepared.terrain.zones]
    return Compared(
        prepared=prepared, names=names, releases=releases,
        results=(*places, "mean runout", "p95 runout", "p95 energy"),
        units=(*["%"] * len(places), "m", "m", "kJ"),
    )  # fmt: skip


def fly_all(
    what: Compared, values: FloatArray, advance: Callable[[int], None], stop: Callable[[], bool]
) -> FloatArray | None:
    """Fly S parameter sets; return the results (S, Y) in the units of `Compared.units`, None if `stop` returned True.

    what : inputs of the analysis; values : (S, U) values of the U unknowns in each set, in the units of the scene
    advance : called with the number of sets flown
    stop : called before each group of sets that fly at the same time
    """
    workers = usable_cores() if isinstance(what.prepared.engine, Compiled) else 1
    rows = list[FloatArray]()
    with ThreadPoolExecutor(workers) as pool:
        for begin in range(0, len(values), workers):
            if stop():
                return None
            rows += pool.map(lambda row: results_of(what, row), values[begin : begin + workers])
            advance(len(rows))
    return np.stack(rows)


def results_of(what: Compared, values: Sequence[float] | FloatArray) -> FloatArray:
    """Fly the rocks with one parameter set, and return the results (Y,) in the units of `Compared.units`.

    what : inputs of the analysis; values : (U,) values of the unknowns, in the units of the scene
    """
    prepared, rocks = what.prepared, len(what.releases.x)
    flight = flight_of_set(prepared, dict(zip(what.names, map(float, values), strict=True)))
    paths = bool(prepared.area_names)
    keep = Keep(paths=np.full(rocks, paths), impacts=np.zeros(rocks, dtype=bool), record=paths)
    batch = fly_batches(prepared.engine, flight, what.releases, keep, None, BatchControl(threads=1))
    runout = np.hypot(*(batch.finals[:, 1:3] - what.releases.x[:, :2]).T)
    energy = 0.5 * what.releases.mass * batch.finals[:, 5] ** 2 / JOULE_PER_KJ
    return np.array([*_shares(what, batch), runout.mean(), np.percentile(runout, 95), np.percentile(energy, 95)])


def _shares(what: Compared, batch: Batch) -> list[float]:
    """Return the shares (%) of the rocks that reach each area or, in a scene without areas, that stop in each zone."""
    prepared = what.prepared
    if prepared.area_names:
        return [100.0 * float(visited(batch, outlines).mean()) for outlines in prepared.outlines.values()]
    deposited = np.isin(batch.counts[:, 0], [int(outcome) for outcome in DEPOSITED])
    zone = np.where(deposited, prepared.terrain.zone[batch.counts[:, 1]], -1)
    return [100.0 * float((zone == number).mean()) for number in range(len(prepared.terrain.zones))]
