"""From a scene to a result: read, release, fly, write. What `rpf3d run` does, in a few lines of Python."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rpf3d_core.compiling import HAS_NUMBA
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import Flight, Progress, choose_engine, fly_ensemble
from rpf3d_core.ensemble.releases import Releases, check_above_ground, ranges_of, releases_in, share_out
from rpf3d_core.ensemble.sizes import DrawnRock
from rpf3d_core.errors import InputError
from rpf3d_core.io.areas import read_areas
from rpf3d_core.io.point_files import read_points
from rpf3d_core.io.results import write_results
from rpf3d_core.io.scene import read_scene
from rpf3d_core.io.scene_draws import distribution_of
from rpf3d_core.io.scene_model import LARGEST_SEED, Scene, material_of
from rpf3d_core.io.scene_sources import read_source_files, rock_of, scene_sources
from rpf3d_core.io.terrain import read_terrain
from rpf3d_core.kinetics.ground import GROUND_MODELS
from rpf3d_core.kinetics.rebound import REBOUND_MODELS
from rpf3d_core.materials.draws import DrawnSurface, drawn_materials
from rpf3d_core.simulation.engines import Engine, Models, engine_of
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.faults import FaultReport
from rpf3d_core.values import Rock


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
    scene = scene if isinstance(scene, Scene) else read_scene(scene)
    return _flown(with_choices(scene, rocks, engine, seed), None, progress)


def replay(
    scene: Scene | str | Path, source: str | int, rock: int, engine: str = "reference", seed: int | None = None
) -> Run:
    """Fly one rock of a scene again, with the bits it has among all others.

    Parameters
    ----------
    scene, engine, seed : as `simulate`
    source : the name of its source, or its place in the scene's list, from 0; rock : its number, from 0

    Raises
    ------
    InputError
        As `simulate`, or there is no such source or rock.
    """
    scene = with_choices(scene if isinstance(scene, Scene) else read_scene(scene), None, engine, seed)
    names = [spec.name for spec in scene.sources]
    place = names.index(source) if source in names else source
    if not isinstance(place, int) or not 0 <= place < len(names):
        raise InputError(f"{scene.path}: there is no source {source!r}; the sources are {', '.join(names)}")
    if rock < 0:
        raise InputError(f"{scene.path}: the rock is {rock}; rocks are numbered from 0")
    return _flown(scene, [range(rock, rock + 1 if i == place else rock) for i in range(len(names))], None)


def _flown(scene: Scene, ranges: Sequence[range] | None, progress: Progress | None) -> Run:
    """Fly the rocks of a scene, or those of each source that stand in its range."""
    began = time.perf_counter()
    read_companions(scene)
    terrain, faults = read_terrain(scene)
    flight = scene_flight(scene, terrain)
    read_s = time.perf_counter() - began
    built = build_engine(scene, terrain)
    index_s = time.perf_counter() - began - read_s
    releases = scene_releases(scene, terrain, built, ranges)
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
    read_source_files(scene)
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
    models = Models(REBOUND_MODELS[scene.rebound], GROUND_MODELS[scene.ground])
    return Flight(drawn_materials(surfaces, scene.seed), settings, models)


def _surface(scene: Scene, zone: str) -> DrawnSurface:
    """The ground of one zone."""
    material = material_of(scene, zone)
    return DrawnSurface(
        R_n=distribution_of(material.normal_restitution),
        R_t=distribution_of(material.tangential_restitution),
        friction_angle=distribution_of(material.friction_angle_deg),
        stop_speed=scene.stop_speed if material.stop_speed is None else material.stop_speed,
        per_impact=material.draw == "per_impact",
    )


def scene_releases(scene: Scene, terrain: Terrain, engine: Engine, ranges: Sequence[range] | None = None) -> Releases:
    """The releases of a scene's rocks, or of those of each source whose numbers stand in its range, all above ground.

    Raises
    ------
    InputError
        A rock starts under the ground or off the terrain; names the scene, the source and the position.
    """
    sources = scene_sources(scene, terrain)
    chosen = ranges_of([source.rocks for source in sources]) if ranges is None else ranges
    try:
        releases = releases_in(sources, chosen, scene_rock(scene), scene.seed, engine, terrain.frame)
        check_above_ground(releases, [source.name for source in sources], engine, terrain.frame)
    except InputError as fault:
        raise InputError(f"{scene.path}: {fault}") from fault
    return releases


def scene_rock(scene: Scene) -> Rock | DrawnRock:
    """Mass (kg) and radius (m) of the sphere of the same volume, or how they are drawn."""
    return rock_of(scene.rock)
