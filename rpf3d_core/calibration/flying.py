"""Fly parameter sets over one prepared terrain, and return the densities of the observations under each set."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.data_checks import check_field, check_stops
from rpf3d_core.calibration.density import (
    GROUPS,
    Stops,
    misfits_of,
    share_densities,
    stop_densities,
    value_densities,
)
from rpf3d_core.calibration.flown_counts import (
    deposited_in,
    extent_of,
    passed,
    reached_area,
    reached_section,
    stopped_in_area,
    stopped_in_section,
)
from rpf3d_core.calibration.flown_passages import Passages, passages
from rpf3d_core.calibration.observations import (
    Directions,
    Field,
    ObservedCount,
    Values,
    calibration_of,
    directions_of,
    field_of,
)
from rpf3d_core.calibration.sampling import Observed
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.batches import BatchControl, Keep, fly_batches
from rpf3d_core.ensemble.even_rounds import every_point, is_spread, rocks_of_round
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.sizes import UNIT_SPHERE_VOLUME
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.errors import SceneError
from rpf3d_core.jit.cores import usable_cores
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.parameter_sets import check_names, flight_of_set
from rpf3d_core.setup.prepared import Prepared, check_releases, prepare, releases_in_ranges
from rpf3d_core.simulation.engines import Compiled, precompile_flights, precompile_ground_below
from rpf3d_core.unknowns.places import Surroundings, place_around

FloatArray = NDArray[np.float64]

ROCKS_A_BLOCK, SIZED_ROCKS_A_BLOCK = 24, 4
"""Number of rocks of a parameter set per observed block: for points, and for spheres or bodies, which take much longer.

Densities are averaged over neighbouring sets: many sets of few rocks give more information than few sets of many.
"""
LEAST_ROCKS, MOST_ROCKS = 128, 4096
"""Bounds of the number of rocks of a parameter set, if the scene does not state it; more blocks need more rocks."""
MASS_KERNEL = 0.3
"""Width (-) of the kernel in the logarithm of mass: a rock counts less for an observed block of another mass."""
DEALT = 2**34
"""Part of the key of the random numbers that assign release points to observed blocks; each round adds its number."""
JOULE_PER_KJ = 1000.0


class Flown(NamedTuple):
    """The result of R rocks flown with one parameter set; the rocks are in a random order, the same for all sets.

    stops : where the rocks stopped; energy : (R,) kJ, largest energy of translation of each rock
    densities : (GROUPS, M, C) of the C observations under this set, for each group of rocks and each of M misfits
    """

    stops: Stops
    densities: FloatArray
    energy: FloatArray


@dataclass(frozen=True, eq=False)
class Slope:
    """A prepared scene with its observations: everything that flights of parameter sets share.

    names : key paths of the unknowns; directions : along and across the slope; field : the observations
    rocks : number of rocks of each set
    error : m, standard deviation of the measuring error of an end point
    misfits : (M,) m, possible errors of the model, as standard deviations
    alike : (N, R) weight of each of R rocks in the prediction for each of N observed blocks, with the rocks in the
        order of `Flown.stops` (`_mixed_order`); None if all weights are equal
    """

    prepared: Prepared
    names: tuple[str, ...]
    directions: Directions
    field: Field
    rocks: int
    error: float
    misfits: FloatArray
    alike: FloatArray | None

    @property
    def place(self) -> Surroundings:
        """The rectangle in plan around the releases of the rocks and the observed stops, in the input's coordinates."""
        releases = releases_of_round(self, 0).x[:, :2] + np.array(self.prepared.terrain.frame.origin[:2])
        stops = self.field.stops @ self.directions.axes[:, :2]
        return place_around(np.concatenate([releases, stops]))

    @property
    def needs_paths(self) -> bool:
        """True if the observations need the paths of rocks for a comparison, and not only the places of their stops."""
        return bool(self.field.values) or any(one.kind != "stopped" for one in self.field.counted)


def slope_of(scene: Scene) -> Slope:
    """Read the terrain and the observations of a scene, and compile its flights.

    Raises
    ------
    InputError
        The scene, a file or an observation is refused; the message names it.
    """
    spec = calibration_of(scene)
    check_names(scene, (*spec.unknowns, *spec.book))
    with_values(scene, spec.book)  # refuses a wrong value of the book before the first flight
    prepared = prepare(scene)
    field = field_of(scene, prepared.terrain.frame)
    check_field(scene, field)
    rocks = _rocks_for(scene, spec.rocks, field)
    slope = Slope(
        prepared=prepared, names=tuple(spec.unknowns), directions=directions_of(scene, prepared.terrain.frame),
        field=field, rocks=rocks, error=spec.measuring_error, misfits=misfits_of(field.stops), alike=None,
    )  # fmt: skip
    releases = releases_of_round(slope, 0)
    check_releases(prepared, releases)
    check_stops(prepared, slope.directions, field)
    if is_spread(prepared.sources, rocks):  # later rounds fly other points
        check_releases(prepared, releases_in_ranges(prepared, every_point(prepared.sources)))
    flight = prepared.flight
    precompile_flights(prepared.engine, flight.models, flight.materials, flight.settings)
    precompile_ground_below(prepared.engine)
    weights = _alike(field, releases)
    return replace(slope, alike=None if weights is None else weights[:, _mixed_order(rocks)])


def _rocks_for(scene: Scene, stated: int | None, field: Field) -> int:
    """Return the number of rocks of a parameter set: the stated number, or a number that fits the observations.

    If the observed blocks have masses or shapes, each block needs at least one simulated rock with its mass or shape.

    Raises
    ------
    SceneError
        Fewer rocks are stated than blocks with masses or shapes were observed.
    """
    blocks = len(field.stops)
    least = blocks if field.masses is not None or field.shapes is not None else 1
    if stated is not None and stated < least:
        raise SceneError(
            f"{scene.path}: `calibration.rocks` is {stated}, but {blocks} observed blocks have masses or shapes, and "
            f"each is predicted from rocks that are like it: give at least {blocks}, or leave the key out"
        )
    return stated or max(rocks_a_set(scene, blocks), least)


def rocks_a_set(scene: Scene, blocks: int) -> int:
    """Return the number of rocks of a parameter set, from 128 to 4096; blocks : number of observed blocks."""
    each = SIZED_ROCKS_A_BLOCK if scene.rock.shape is not None else ROCKS_A_BLOCK
    return int(np.clip(each * blocks, LEAST_ROCKS, MOST_ROCKS))


def releases_of_round(slope: Slope, number: int) -> Releases:
    """Return the releases that all sets of a round share; each round has other rocks, evenly spread over all sources.

    If the masses or shapes of the observed blocks are known, they replace the masses or shapes of the simulated rocks:
    the releases receive the blocks in turn, and after the last block the first block again. In this case, the order of
    the releases is random in each round.

    number : number of the round, from 0
    """
    prepared, field = slope.prepared, slope.field
    releases = releases_in_ranges(prepared, rocks_of_round(prepared.sources, slope.rocks, number))
    block = np.arange(slope.rocks) % max(len(field.stops), 1)
    if field.masses is not None or field.shapes is not None:  # so that no block falls from the same few points
        key = [prepared.scene.seed, DEALT + number]
        releases = taken(releases, np.random.Generator(np.random.Philox(key=key)).permutation(slope.rocks))
    if field.masses is not None:
        mass = field.masses[block]
        radius = np.cbrt(mass / (prepared.scene.rock.density * UNIT_SPHERE_VOLUME))
        releases = replace(releases, mass=mass, radius=radius)
    return releases if field.shapes is None else replace(releases, shape=field.shapes[block])


def _alike(field: Field, releases: Releases) -> FloatArray | None:
    """Return the weight (N, R) (-) of each of R simulated rocks in the prediction for each of N observed blocks.

    The weight is small if the masses of rock and block differ much, and 0 if their shapes differ. The result is None if
    the observed blocks have neither masses nor shapes.

    releases : of the R rocks
    """
    if field.masses is None and field.shapes is None:
        return None
    weights = np.ones((len(field.stops), len(releases.x)))
    if field.masses is not None:
        distance = np.log(field.masses)[:, None] - np.log(releases.mass)[None, :]
        weights *= np.exp(-0.5 * (distance / MASS_KERNEL) ** 2)
    if field.shapes is not None and releases.shape is not None:
        weights *= field.shapes[:, None] == releases.shape[None, :]
    return weights


def observed_of(slope: Slope) -> Observed:
    """Return the number of observed rocks behind each of C observations, and the density of each under pure chance.

    The order is that of `Flown.densities`: end points, values at gates, counts of rocks. "Pure chance" means: a stop
    is equally likely anywhere in the rectangle around the terrain (`anywhere_density`), a value anywhere between 0 and
    twice the largest value of its list, and the share of counted rocks is one half. A count of rocks gives two
    observations: the rocks that did what was counted, such as reaching an area, and the other rocks.
    """
    field = slope.field
    counts, anywhere = [np.ones(len(field.stops))], [np.full(len(field.stops), anywhere_density(slope))]
    for one in field.values:
        counts.append(np.ones(len(one.observed)))
        anywhere.append(np.full(len(one.observed), 1.0 / max(2.0 * float(one.observed.max()), 1e-9)))
    for part in field.counted:
        counts.append(np.array([part.rocks, part.of - part.rocks], dtype=float))
        anywhere.append(np.full(2, 0.5))
    return Observed(counts=np.concatenate(counts), anywhere=np.concatenate(anywhere))


def anywhere_density(slope: Slope) -> float:
    """Return the density (1/m2) of a stop that is equally likely anywhere on the terrain.

    The density is 1 over the area of the rectangle along and across the slope that contains the terrain.
    """
    places = slope.directions.places(slope.prepared.terrain.vertices)
    return float(1.0 / np.prod(np.maximum(np.ptp(places, axis=0), 1e-9)))


def workers_of(slope: Slope, threads: int | None) -> int:
    """Return the number of parameter sets that fly at the same time: 1 with the reference engine.

    threads : number of threads of the compiled engine, None for one per core
    """
    compiled = isinstance(slope.prepared.engine, Compiled)
    return (threads or usable_cores()) if compiled else 1


def fly_sets(
    slope: Slope, values: FloatArray, number: int, stop: Callable[[], bool], threads: int | None = None
) -> Iterator[Flown]:
    """Fly the parameter sets of a round, each on one thread, and yield their results in the order of the sets.

    values : (S, U) of S sets and U unknowns, each in the unit of its key in the scene
    number : number of the round, which selects the rocks
    stop : called before each set, on the thread of the set; if `stop` returns True, neither this set nor a later set is
        yielded
    threads : number of threads, None for one per core; results do not depend on it
    """
    workers = workers_of(slope, threads)
    releases = releases_of_round(slope, number)

    def fly(row: FloatArray) -> Flown | None:
        return None if stop() else fly_set(slope, row, releases)

    with ThreadPoolExecutor(workers) as pool:
        waiting = list[Future[Flown | None]]()
        for row in values:
            waiting.append(pool.submit(fly, row))
            if len(waiting) > workers:
                if (one := waiting.pop(0).result()) is None:
                    return  # later sets may have flown, but the kept sets must have no gaps
                yield one
        for future in waiting:
            if (one := future.result()) is None:
                return
            yield one


def fly_set(slope: Slope, values: Sequence[float] | FloatArray, releases: Releases) -> Flown:
    """Fly the rocks of one parameter set on the calling thread, and return their stops, energies and densities.

    releases : of the rocks
    values : (U,), each in the unit that its key has in the scene, such as (-) or degrees
    """
    prepared, rocks = slope.prepared, len(releases.x)
    flight = flight_of_set(prepared, dict(zip(slope.names, map(float, values), strict=True)))
    flags = np.full(rocks, slope.needs_paths)
    keep = Keep(paths=flags, impacts=np.zeros(rocks, dtype=bool), record=slope.needs_paths)
    batch = fly_batches(prepared.engine, flight, releases, keep, None, BatchControl(threads=1))
    deposited = deposited_in(batch)
    mixed = _mixed_order(rocks)
    stops = Stops(place=slope.directions.places(batch.finals[:, 1:4])[mixed], deposited=deposited[mixed])
    energy = 0.5 * releases.mass * batch.finals[:, 5] ** 2 / JOULE_PER_KJ
    return Flown(stops=stops, densities=_densities(slope, batch, releases, stops), energy=energy[mixed])


def _mixed_order(rocks: int) -> NDArray[np.int64]:
    """Return a random order (R,) of R rocks, so that every group has rocks of all sources and places.

    The order depends only on R, so that all parameter sets have the same order. rocks : R
    """
    return np.random.Generator(np.random.Philox(key=GROUPS)).permutation(rocks)


def _densities(slope: Slope, batch: Batch, releases: Releases, stops: Stops) -> FloatArray:
    """Return the densities (GROUPS, M, C) of C observations under one parameter set, for each group and M misfits.

    Densities of values at gates do not depend on the misfit.
    """
    field, mixed = slope.field, _mixed_order(len(releases.x))
    parts = [stop_densities(stops, field.stops, np.hypot(slope.error, slope.misfits), slope.alike)]
    gates = {one.at: passages(batch, slope.directions, one.at, slope.prepared.engine) for one in field.values}
    for one in field.values:
        known = _of_values(one, gates[one.at], releases.mass, mixed)
        parts.append(np.repeat(known[:, None, :], len(slope.misfits), axis=1))
    parts += [share_densities(_probabilities(slope, one, batch)[:, mixed]) for one in field.counted]
    return np.ascontiguousarray(np.concatenate(parts, axis=2))  # contiguous as if read from disk: equal order of sums


def _of_values(one: Values, gate: Passages, mass: FloatArray, mixed: NDArray[np.int64]) -> FloatArray:
    """Return the densities (GROUPS, N) of the simulated values at the N values observed at a gate.

    one : the observed values; gate : passages of the R rocks through the gate; mass : (R,) kg
    mixed : (R,) random order of the rocks, by which they are divided into groups
    """
    energy = 0.5 * mass * gate.speed**2 / JOULE_PER_KJ
    simulated = {"speed": gate.speed, "height": gate.height, "energy": energy}[one.kind]
    return value_densities(simulated[mixed], one.observed, one.error)


def _probabilities(slope: Slope, one: ObservedCount, batch: Batch) -> FloatArray:
    """Return the probability (M, R) that each rock did what was counted in the field, for each misfit.

    one : a count of observed rocks; batch : the R flown rocks
    """
    outlines, observed = slope.prepared.outlines.get(one.place), slope.prepared.scene.observed
    if one.kind == "passed" and one.at is not None:
        return passed(extent_of(batch, slope.directions), one.at, slope.misfits)
    if outlines is not None:
        return (reached_area if one.kind == "reached" else stopped_in_area)(batch, outlines, slope.misfits)
    section = (None, None) if observed is None else observed.sections[one.place]
    if one.kind == "reached":
        return reached_section(extent_of(batch, slope.directions), section, slope.misfits)
    along = slope.directions.places(batch.finals[:, 1:4])[:, 0]
    return stopped_in_section(along, deposited_in(batch), section, slope.misfits)
