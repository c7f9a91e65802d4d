"""The nodes' calls into the core: sources become releases, releases flights, flights what is published."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rpf3d_core.compiling import HAS_NUMBA
from rpf3d_core.detection.bucket_locator import BucketLocator, bucket_locator
from rpf3d_core.ensemble.flights import Deposits, Flights, FloatArray, Impacts, on_ground
from rpf3d_core.ensemble.fly import choose_engine, fly_ensemble
from rpf3d_core.ensemble.paths import PathSamples, sample_paths
from rpf3d_core.ensemble.releases import Releases, Source, check_above_ground, releases_of
from rpf3d_core.ensemble.sizes import DrawnRock
from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.hazard.passed import hazard_facets
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.io.scene_sources import rock_of
from rpf3d_core.prepared import scene_flight
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import Facets, Terrain, facets_of
from rpf3d_core.values import DEPOSITED, OUTCOME_SENTENCES, Outcome, Rock
from rpf3d_ros.parameters import SimulatorParameters
from rpf3d_ros.results import Columns, Results
from rpf3d_ros.source_messages import Sources
from rpf3d_ros.survey_terrain import terrain_of
from rpf3d_ros.terrain_messages import Survey

SOURCE = "sources"
"""Name of the one source that the poses of a message make."""

NO_DRAW = 0
"""Seed of releases in which nothing is random."""

UNFINISHED = (Outcome.MAX_TIME, Outcome.MAX_IMPACTS, Outcome.UNRESOLVED_CONTACT, Outcome.FAILED)
"""Outcomes that a diagnostic warns of: the answer is not the rock's end."""


@dataclass(frozen=True, eq=False)
class Answer:
    """results : to publish; figures : for the diagnostic; warnings : sentences about rocks without an end."""

    results: Results
    figures: Mapping[str, str]
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Ground:
    """A terrain with what is built from it once: the arrays of the kernels and the buckets of the plan."""

    terrain: Terrain
    facets: Facets
    buckets: BucketLocator


class Simulator:
    """Flies sources over the last survey that is a terrain, and keeps what was built over it."""

    def __init__(self, parameters: SimulatorParameters, scene: Scene) -> None:
        self._parameters, self._scene = parameters, scene
        self._survey: Survey | None = None
        self._engines: dict[str, Engine] = {}
        self.ground: Ground | None = None

    def stand_on(self, survey: Survey) -> None:
        """Take a survey as the ground, if it is another than the last one that was tried.

        Raises TerrainError where the survey is no terrain; the ground is then what it was.
        """
        if survey is self._survey:
            return
        try:
            self.ground, self._engines = ground_of(survey, self._scene.terrain.weld), {}
        except TerrainError:
            self._survey = survey
            raise
        self._survey = survey

    def fly(self, sources: Sources) -> Answer:
        """Fly one rock from every source. Raises InputError for a source under the ground or off the terrain."""
        engine = self.engine(choose_engine(self._scene.engine, len(sources.positions), HAS_NUMBA))
        return simulate(self.ground, engine, sources, self._parameters, self._scene)

    def engine(self, name: str) -> Engine:
        """The engine with its index over the ground, built once for each ground. Raises InputError without numba."""
        if self.ground is None:
            raise TerrainError("no terrain has been received")
        if name not in self._engines:
            try:
                self._engines[name] = engine_of(name, self.ground.facets)
            except ValueError as error:
                raise InputError(str(error)) from error
        return self._engines[name]


def simulate(
    ground: Ground, engine: Engine, sources: Sources, parameters: SimulatorParameters, scene: Scene
) -> Answer:
    """Fly one rock from every source over the ground. Raises InputError for a source under it or off it."""
    releases = releases_over(engine, sources, ground.terrain, parameters, rock_of(scene.rock))
    check_above_ground(releases, [SOURCE], engine, ground.terrain.frame)
    flights = fly_ensemble(engine, scene_flight(scene, ground.terrain), releases)
    results = results_of(ground, flights, parameters, scene.gravity)
    return Answer(results, figures_of(ground, flights), warnings_of(flights))


def ground_of(survey: Survey, weld: float) -> Ground:
    """The terrain of a survey, with its index. Raises TerrainError where the survey is none."""
    terrain = terrain_of(survey, weld)
    facets = facets_of(terrain)
    return Ground(terrain, facets, bucket_locator(facets))


def releases_over(
    engine: Engine, sources: Sources, terrain: Terrain, parameters: SimulatorParameters, rock: Rock | DrawnRock
) -> Releases:
    """One rock a source, thrown along the pose's x axis with release_speed; heights as above_ground says."""
    points = terrain.frame.points_to_local(sources.positions)
    above_ground = parameters.above_ground if parameters.above_ground >= 0.0 else None
    source = Source(SOURCE, points, rocks=len(points), above_ground=above_ground)
    drawn = releases_of([source], rock, NO_DRAW, engine, terrain.frame)
    return replace(drawn, v=parameters.release_speed * sources.directions)


def results_of(ground: Ground, flights: Flights, parameters: SimulatorParameters, gravity: float) -> Results:
    """What is published of flights, in the map frame."""
    samples = sample_paths(flights.paths, max_step=parameters.trajectory_step, gravity=gravity)
    return Results(
        trajectories=_trajectory_columns(ground.terrain, samples, flights.deposits),
        impacts=_impact_columns(ground.terrain, flights.impacts, flights.deposits),
        deposits=_deposit_columns(ground.terrain, flights.deposits),
        hazard=hazard_of(ground, flights, gravity),
    )


def hazard_of(ground: Ground, flights: Flights, gravity: float) -> dict[str, FloatArray]:
    """Corners (F, 3, 3) m, map frame, of the facets that rocks stopped on, and of the others that they passed over."""
    facets = hazard_facets(ground.buckets, ground.facets.corners, flights, gravity)
    return {level: _corners(ground.terrain, chosen) for level, chosen in facets.items()}


def figures_of(ground: Ground, flights: Flights) -> dict[str, str]:
    """The run in figures, for the diagnostic."""
    outcomes = Counter(Outcome(code).name.lower() for code in flights.deposits.outcome.tolist())
    counts = {"triangles": len(ground.terrain.triangles), "rocks": len(flights.deposits.rock), **outcomes}
    times = {"compile_s": f"{flights.compile_s:.3f}", "fly_s": f"{flights.fly_s:.3f}"}
    return {"engine": flights.engine, **{name: str(count) for name, count in counts.items()}, **times}


def warnings_of(flights: Flights) -> tuple[str, ...]:
    """A sentence for each outcome that leaves rocks without an end."""
    counts = {outcome: int(np.count_nonzero(flights.deposits.outcome == outcome)) for outcome in UNFINISHED}
    return tuple(f"rocks: {n}, each {OUTCOME_SENTENCES[outcome]}" for outcome, n in counts.items() if n)


def _corners(terrain: Terrain, facets: np.ndarray) -> FloatArray:
    return terrain.frame.points_to_input(terrain.vertices[terrain.triangles[facets]])


def _trajectory_columns(terrain: Terrain, samples: PathSamples, deposits: Deposits) -> Columns:
    energy = 0.5 * deposits.mass[samples.row] * samples.speed**2
    row = {"t": samples.t, "rock": samples.row, "speed": samples.speed, "energy": energy}
    return {**_position_columns(terrain, samples.x), **row}


def _impact_columns(terrain: Terrain, flown: Impacts, deposits: Deposits) -> Columns:
    impacts = on_ground(flown)
    energy = 0.5 * deposits.mass[impacts.row] * impacts.speed_in**2
    row = {"t": impacts.t, "rock": impacts.row, "speed": impacts.speed_in, "energy": energy}
    return {**_position_columns(terrain, impacts.x), **row}


def _deposit_columns(terrain: Terrain, deposits: Deposits) -> Columns:
    lying = np.flatnonzero(np.isin(deposits.outcome, DEPOSITED))
    runout = np.linalg.norm((deposits.x - deposits.release)[lying, :2], axis=1)
    row = {"t": deposits.t, "runout": runout, "speed": deposits.max_speed, "energy": deposits.max_energy}
    kept = {name: column if name == "runout" else column[lying] for name, column in row.items()}
    return {**_position_columns(terrain, deposits.x[lying]), "rock": lying, **kept}


def _position_columns(terrain: Terrain, x: FloatArray) -> dict[str, FloatArray]:
    points = terrain.frame.points_to_input(x)
    return {name: points[:, i] for i, name in enumerate("xyz")}
