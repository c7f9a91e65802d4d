"""From a scene to a result: read, release, fly, write. What `rpf3d run` does, in a few lines of Python."""

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.compiling import HAS_NUMBA
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import Progress, choose_engine, fly_ensemble
from rpf3d_core.ensemble.releases import Releases, Source, check_above_ground, releases_of, share_out
from rpf3d_core.errors import InputError
from rpf3d_core.io.areas import read_areas
from rpf3d_core.io.point_files import read_points
from rpf3d_core.io.results import write_results
from rpf3d_core.io.scene import read_scene
from rpf3d_core.io.scene_model import LARGEST_SEED, RockSpec, Scene, SourceSpec, material_of
from rpf3d_core.io.terrain import read_terrain
from rpf3d_core.kinetics.ground import GROUND_MODELS
from rpf3d_core.kinetics.rebound import REBOUND_MODELS
from rpf3d_core.materials.library import Surface, materials_of
from rpf3d_core.simulation.engines import Engine, Models, engine_of
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.faults import FaultReport
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Rock, Vec


@dataclass(frozen=True, eq=False)
class Run:
    """A scene, the terrain that was read for it, and what came of its rocks.

    read_s : wall seconds to read and check the terrain; index_s : to build the engine's index over it
    """

    scene: Scene
    terrain: Terrain
    faults: FaultReport
    flights: Flights
    read_s: float
    index_s: float
    began: float


def simulate(
    scene: Scene | str | Path,
    rocks: int | None = None,
    engine: str | None = None,
    seed: int | None = None,
    progress: Progress | None = None,
) -> Run:
    """Fly all rocks of a scene.

    Parameters
    ----------
    scene : a scene, or the path of its file
    rocks : how many in total, dealt to the sources in proportion; None for the scene's own numbers
    engine : "reference", "compiled" or "auto"; None for the scene's own
    seed : for everything that is drawn at random; None for the scene's own
    progress : as `ensemble.fly.Progress`

    Raises
    ------
    InputError
        The scene, one of its files or a source is refused; says which, and what would be right.
    """
    began = time.perf_counter()
    scene = with_choices(scene if isinstance(scene, Scene) else read_scene(scene), rocks, engine, seed)
    read_companions(scene)
    terrain, faults = read_terrain(scene)
    flight = scene_flight(scene, terrain)
    read_s = time.perf_counter() - began
    built = build_engine(scene, terrain)
    index_s = time.perf_counter() - began - read_s
    releases = scene_releases(scene, terrain, built)
    flights = fly_ensemble(built, flight, releases, True, scene.outputs.trajectories, progress)
    return Run(scene, terrain, faults, flights, read_s, index_s, began)


def write_run(run: Run, folder: str | Path, recording: bool = True) -> Path:
    """Write everything that a run leaves behind (docs/outputs.md) and return the folder.

    Raises
    ------
    InputError
        The folder holds something else, or cannot be written to.
    """
    from rpf3d_core.recordings.log import write_recording  # rerun is needed for this only

    def record(path: Path, facts: dict[str, Any]) -> None:
        write_recording(path, run.scene, run.terrain, run.flights, facts)

    timings = {
        "read_s": run.read_s,
        "index_s": run.index_s,
        "wall_s": time.perf_counter() - run.began,
    }
    arguments = (run.scene, run.terrain, run.faults, run.flights, timings)
    try:
        return write_results(folder, *arguments, record if recording else None)
    except OSError as fault:
        raise InputError(f"{folder}: could not be written ({fault.strerror or fault})") from fault


def with_choices(scene: Scene, rocks: int | None, engine: str | None, seed: int | None) -> Scene:
    """The scene with what the caller chose instead of what it says; None keeps what it says.

    Raises
    ------
    InputError
        Fewer than one rock, an unknown engine, or a seed out of range.
    """
    changes: dict[str, object] = {}
    if rocks is not None:
        if rocks < 1:
            raise InputError(f"the number of rocks is {rocks}; it must be at least 1")
        shares = share_out([source.rocks for source in scene.sources], rocks)
        changes["sources"] = tuple(
            source.model_copy(update={"rocks": n}) for source, n in zip(scene.sources, shares, strict=True)
        )
    if engine is not None:
        if engine not in ("auto", "reference", "compiled"):
            raise InputError(f"the engine is {engine!r}; it must be auto, reference or compiled")
        changes["engine"] = engine
    if seed is not None:
        if not 0 <= seed <= LARGEST_SEED:
            raise InputError(f"the seed is {seed}; it must be a whole number from 0 to {LARGEST_SEED}")
        changes["seed"] = seed
    return scene.model_copy(update=changes)


def read_companions(scene: Scene) -> None:
    """Read the small files that a scene names, so that a damaged one is refused before a large mesh is read and flown.

    Raises
    ------
    InputError
        A file of points or polygons is damaged; names it.
    """
    scene_sources(scene, Frame(up=scene.terrain.up))
    read_areas(scene)
    if scene.observed is not None:
        read_points(scene.observed.points_file)


def build_engine(scene: Scene, terrain: Terrain) -> Engine:
    """The scene's engine, with its index over the terrain.

    Raises
    ------
    InputError
        The compiled engine is asked for and numba is not installed.
    """
    name = choose_engine(scene.engine, sum(source.rocks for source in scene.sources), HAS_NUMBA)
    try:
        return engine_of(name, facets_of(terrain))
    except ValueError as fault:
        raise InputError(f"{scene.path}: {fault}") from fault


def scene_flight(scene: Scene, terrain: Terrain) -> Flight:
    """Materials by zone, settings and models of a scene.

    Raises
    ------
    InputError
        A zone of the terrain has no material.
    """
    surfaces = [_surface(scene, zone) for zone in terrain.zones]
    settings = Settings(scene.gravity, scene.smallest_bounce, scene.max_time, scene.max_impacts)
    return Flight(materials_of(surfaces), settings, Models(REBOUND_MODELS[scene.rebound], GROUND_MODELS[scene.ground]))


def _surface(scene: Scene, zone: str) -> Surface:
    """The ground of one zone; angles become numbers here, at the edge."""
    material = material_of(scene, zone)
    return Surface(
        R_n=material.normal_restitution,
        R_t=material.tangential_restitution,
        mu=math.tan(math.radians(material.friction_angle_deg)),
        stop_speed=scene.stop_speed if material.stop_speed is None else material.stop_speed,
    )


def scene_releases(scene: Scene, terrain: Terrain, engine: Engine) -> Releases:
    """The releases of a scene's rocks, all above ground.

    Raises
    ------
    InputError
        A rock starts under the ground or off the terrain; names the scene, the source and the position.
    """
    sources = scene_sources(scene, terrain.frame)
    try:
        releases = releases_of(sources, scene_rock(scene), scene.seed, engine, terrain.frame)
        check_above_ground(releases, [source.name for source in sources], engine, terrain.frame)
    except InputError as fault:
        raise InputError(f"{scene.path}: {fault}") from fault
    return releases


def scene_rock(scene: Scene) -> Rock:
    """Mass (kg) and radius (m) of the sphere of the same volume."""
    return rock_of(scene.rock)


def rock_of(spec: RockSpec) -> Rock:
    """A rock from its density and either its diameter or its mass: a sphere."""
    if spec.mass is not None:
        return Rock(spec.mass, (3.0 * spec.mass / (4.0 * math.pi * spec.density)) ** (1.0 / 3.0))
    radius = 0.5 * (spec.diameter or 0.0)
    return Rock(spec.density * 4.0 / 3.0 * math.pi * radius**3, radius)


def scene_sources(scene: Scene, frame: Frame) -> list[Source]:
    """The sources of a scene in a terrain's local frame.

    Raises
    ------
    InputError
        A file of points is damaged.
    """
    return [_source(spec, frame) for spec in scene.sources if spec.rocks > 0]


def _source(spec: SourceSpec, frame: Frame) -> Source:
    """One source in the local frame."""
    points = read_points(spec.points_file) if spec.points_file else np.array(spec.points or spec.line, dtype=float)
    return Source(
        name=spec.name,
        points=frame.points_to_local(points),
        rocks=spec.rocks,
        velocity=_vector(frame.directions_to_local(spec.velocity)),
        line=spec.line is not None,
        spread=_vector(np.abs(frame.directions_to_local(spec.spread))),
        velocity_spread=_vector(np.abs(frame.directions_to_local(spec.velocity_spread))),
        above_ground=spec.above_ground,
    )


def _vector(values: Any) -> Vec:
    """Three floats as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z
