"""Prepare a scene for a run: read the terrain, build search structure, sources and maps, and refuse wrong input."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from shapely.geometry import MultiPolygon

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.fly import choose_engine
from rpf3d_core.ensemble.releases import Releases, Source, check_above_ground, releases_in
from rpf3d_core.ensemble.sizes import AnyRock, mass_range
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import FINE, PER_OCTAVE, Binning, Scales
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.raster import check_memory, raster_over
from rpf3d_core.hazard.tallies import Tallies, tallies_over, with_sources, with_ways
from rpf3d_core.hazard.tally import BYTES_PER_CELL
from rpf3d_core.hazard.walks.ground import ground_over
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.materials.body_draws import DrawnBodyMaterials, DrawnBodySurface, bodies_as_drawn, drawn_body_materials
from rpf3d_core.materials.draws import DrawnMaterials, DrawnSurface, as_drawn, drawn_materials
from rpf3d_core.materials.library import Materials
from rpf3d_core.scene.draws import distribution_of
from rpf3d_core.scene.hazard import asks_ways
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.zone_materials import check_materials, material_of
from rpf3d_core.setup.areas import area_outlines, read_areas
from rpf3d_core.setup.builders.hazard import empty_barriers, memory_of_bins, scales_over
from rpf3d_core.setup.cells import least_cell
from rpf3d_core.setup.file_keys import named_by_key
from rpf3d_core.setup.named import models_of, obstacles_of
from rpf3d_core.setup.observed import position_along
from rpf3d_core.setup.shapes import rock_of_scene
from rpf3d_core.setup.sources import read_source_files, scene_sources
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.setup.warnings.doubts import doubts_of
from rpf3d_core.setup.warnings.extents import other_extents
from rpf3d_core.setup.warnings.misplaced_inputs import refuse_other_systems
from rpf3d_core.setup.warnings.wrong_coordinates import placing_notes
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.simulation.engines import Compiled, Engine, spins_of, stepping
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.values import Vec


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene with everything needed to fly its rocks.

    faults : report on the mesh of the terrain; flight : materials, settings and models
    sources, rock : sources and rocks of the scene, from which the releases are drawn; raster : cells of the hazard maps
    polygons, source_polygons : polygons of each area of interest and of each source, by name, in plan coordinates of
        the input
    outlines : outline rings (N, 2) m of each area of interest, in the local frame
    read_s : wall time (s) to read and check the files, and to prepare models, sources and maps
    index_s : wall time (s) to build the engine's locator, with the wait for its compiled code
    began : `time.perf_counter()` at the start of the preparation
    placing : sentences on inputs that look misplaced or in a wrong unit
    doubts : warnings about the settings of the scene, made before the rocks fly, because files with rock sizes may be
        edited or removed while the rocks fly
    """

    scene: Scene
    terrain: Terrain
    faults: FaultReport
    engine: Engine
    flight: Flight
    sources: Sequence[Source]
    rock: AnyRock
    raster: Raster
    polygons: Mapping[str, MultiPolygon]
    outlines: Mapping[str, list[FloatArray]]
    read_s: float
    index_s: float
    began: float
    placing: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    source_polygons: Mapping[str, MultiPolygon] = field(default_factory=dict)

    @property
    def area_names(self) -> tuple[str, ...]:
        """Names of the areas of interest."""
        return tuple(self.outlines)

    @property
    def obstacles(self) -> Obstacles:
        """Names and places of the obstacles of the scene."""
        return obstacles_of(self.scene, self.flight.models)


def prepare(
    scene: Scene,
    before_index: Callable[[Terrain], None] | None = None,
    terrain_read: tuple[Terrain, FaultReport] | None = None,
) -> Prepared:
    """Read all files that a scene names, and return everything that is needed to fly its rocks.

    before_index : called with the terrain before the locator is built; see `precompiler.Precompiler`
    terrain_read : the terrain and the report on its mesh, if the terrain was read before

    Raises
    ------
    InputError
        A file, a source or a map of the scene is refused; the message names the file or key and the valid values.
    """
    began = time.perf_counter()
    check_engine(scene)
    polygons, source_polygons = read_companions(scene)
    others = other_extents(scene)
    refuse_other_systems(others, scene.terrain.crs)
    terrain, faults = read_terrain(scene) if terrain_read is None else terrain_read
    flight, sources = scene_flight(scene, terrain), scene_sources(scene, terrain, source_polygons)
    raster = scene_raster(scene, terrain, sources=sources)
    outlines = area_outlines(scene, terrain, polygons)
    read_s = time.perf_counter() - began
    if before_index:
        before_index(terrain)
    engine = build_engine(scene, terrain)
    placing = placing_notes(scene, faults, others, is_run=True)
    return Prepared(
        scene=scene, terrain=terrain, faults=faults, engine=engine, flight=flight, sources=sources,
        rock=rock_of_scene(scene), raster=raster, polygons=polygons, outlines=outlines, read_s=read_s,
        index_s=time.perf_counter() - began - read_s, began=began, placing=placing,
        doubts=doubts_of(scene, terrain, engine), source_polygons=source_polygons,
    )  # fmt: skip


def read_companions(scene: Scene) -> tuple[dict[str, MultiPolygon], dict[str, MultiPolygon]]:
    """Read the small files of a scene to find errors in them before the large terrain file is read.

    Returns
    -------
    tuple
        The polygons of the areas of interest, as from `read_areas`, and of the sources, as from `read_source_files`.

    Raises
    ------
    InputError
        A file of points, lines or polygons is damaged; the message names the file.
    """
    source_polygons, areas = read_source_files(scene), read_areas(scene)
    for number, zone in enumerate(scene.zones):
        with named_by_key(scene, "zones", number, "polygons"):
            read_polygons(zone.polygons)
    if scene.observed is not None:
        read_points(scene.observed.points_file, scene.terrain.up, heights=False)
    return areas, source_polygons


def check_engine(scene: Scene) -> None:
    """Refuse a scene that names an engine that is not available.

    Raises
    ------
    InputError
        The scene asks for the compiled engine, but numba is not installed.
    """
    if scene.engine == Compiled.name and not HAS_NUMBA:
        raise InputError(f"{scene.path}: engine {scene.engine!r} cannot be used: numba is not installed")


def engine_for(scene: Scene, rocks: int) -> str:
    """Return the name of the engine that flies a given number of rocks of a scene, such as "compiled"."""
    return choose_engine(scene.engine, rocks, HAS_NUMBA, scene.rock.shape is not None)


def engine_name(scene: Scene) -> str:
    """Return the name of the engine that a run of the scene uses, such as "compiled"."""
    rocks = scene.target.most_rocks if scene.rocks == "auto" else sum(source.rocks for source in scene.sources)
    return engine_for(scene, rocks)


def build_engine(scene: Scene, terrain: Terrain) -> Engine:
    """Return the engine of a scene, with its search structure over the terrain and the scene's contact method."""
    engine, steps = engine_over(engine_name(scene), terrain, facets_of(terrain)), scene.method.stepping
    return engine if steps is None else stepping(engine, steps.dt, steps.threshold, steps.squared)


def scene_flight(scene: Scene, terrain: Terrain) -> Flight:
    """Return everything about the flights of a scene except the terrain: materials, settings and models.

    Raises
    ------
    InputError
        A zone of the terrain has no material, a material belongs to no zone, or a model or effect is refused (see
        `models_of`).
    """
    materials, settings = scene_materials(scene, terrain.zones), scene_settings(scene)
    return Flight(materials=materials, settings=settings, models=models_of(scene, terrain))


def scene_settings(scene: Scene) -> Settings:
    """Return the flight settings of a scene: gravity, smallest bounce, limits of time and impacts, and seed."""
    return Settings(
        gravity=scene.gravity, smallest_bounce=scene.smallest_bounce, max_time=scene.max_time,
        max_impacts=scene.max_impacts, seed=scene.seed,
    )  # fmt: skip


def _surface(scene: Scene, zone: str) -> DrawnSurface:
    """Return the ground coefficients of a zone from its material, as fixed or random numbers."""
    material = material_of(scene, zone)
    return DrawnSurface(
        R_n=distribution_of(material.normal_restitution),
        R_t=distribution_of(material.tangential_restitution),
        friction_angle=distribution_of(material.friction_angle_deg),
        stop_speed=scene.stop_speed if material.stop_speed is None else material.stop_speed,
        per_impact=material.draw == "per_impact",
        rolling_friction=distribution_of(material.rolling_friction or 0.0),
    )


def _body_surface(scene: Scene, zone: str) -> DrawnBodySurface:
    """Return the ground coefficients of a zone for rocks with a shape, as fixed or random numbers."""
    material = material_of(scene, zone)
    return DrawnBodySurface(
        restitution=distribution_of(material.restitution or 0.0),
        friction=distribution_of(material.friction or 0.0),
        rolling_resistance=distribution_of(material.rolling_resistance or 0.0),
        stop_speed=scene.stop_speed if material.stop_speed is None else material.stop_speed,
        per_impact=material.draw == "per_impact",
    )


def scene_materials(scene: Scene, zones: Sequence[str]) -> Materials | DrawnMaterials | DrawnBodyMaterials:
    """Return the materials of all zones of a terrain in the form that the flight loops read.

    Raises
    ------
    InputError
        A zone has no material, or a material belongs to no zone.
    """
    surfaces = [_surface(scene, zone) for zone in zones]
    check_materials(scene, zones)
    if not scene.rock.is_body:
        return drawn_materials(surfaces)
    return drawn_body_materials([_body_surface(scene, zone) for zone in zones])


def scene_drawn_materials(scene: Scene, zones: Sequence[str]) -> DrawnMaterials | DrawnBodyMaterials:
    """Return the materials of all zones in the form with random coefficients, even if all coefficients are fixed.

    `scene_materials` returns the form with fixed coefficients if possible. A loop is compiled for one of the two forms.
    Both forms give a rock the same coefficients, to the last bit.
    """
    if not scene.rock.is_body:
        return as_drawn([_surface(scene, zone) for zone in zones])
    return bodies_as_drawn([_body_surface(scene, zone) for zone in zones])


def scene_raster(
    scene: Scene, terrain: Terrain, box: tuple[Vec, Vec] | None = None, sources: Sequence[Source] = ()
) -> Raster:
    """Return the raster of the hazard maps of a scene, after a check of the memory that it needs.

    Parameters
    ----------
    box : lowest and highest corner (m) of the box around the terrain; None to compute them here
    sources : if the scene gives no cell size, the cells are so large that most cells on the paths from these sources
        get enough rocks for percentiles, as far as the terrain allows; () if unknown: no such limit

    Raises
    ------
    InputError
        The maps would need more memory than the scene allows.
    """
    least = 0.0 if scene.hazard.cell is not None else least_cell(scene, terrain, sources)
    raster = raster_over(terrain, scene.hazard.cell, box, least)
    try:
        check_memory(raster, len(terrain.triangles), scene.hazard.memory_gb, BYTES_PER_CELL)
    except InputError as fault:
        raise InputError(f"{scene.path}: {fault}") from fault
    return raster


def releases_in_ranges(prepared: Prepared, ranges: Sequence[range | IntArray]) -> Releases:
    """Return the releases of the rocks whose numbers are in `ranges`: a range or numbers (N,) for each source.

    Raises
    ------
    InputError
        A source is off the terrain; the message names the scene, the source and the position.
    """
    scene, frame = prepared.scene, prepared.terrain.frame
    try:
        return releases_in(prepared.sources, ranges, prepared.rock, scene.seed, prepared.engine, frame)
    except InputError as fault:
        raise InputError(f"{scene.path}: {fault}") from fault


def places_of(prepared: Prepared) -> list[int]:
    """Return the number of release points of each source; 1 for a source with random places (line or area).

    Rocks use the points of a source in turn.
    """
    drawn = [source.line or source.triangles is not None for source in prepared.sources]
    return [1 if its else len(source.points) for its, source in zip(drawn, prepared.sources, strict=True)]


def check_releases(prepared: Prepared, releases: Releases) -> None:
    """Refuse releases with a rock that starts under the ground or off the terrain.

    Raises
    ------
    InputError
        A rock starts under the ground or off the terrain. The message names the scene, the source, the rock and its
        position.
    """
    names = [source.name for source in prepared.sources]
    try:
        check_above_ground(releases, names, prepared.engine, prepared.terrain.frame)
    except InputError as fault:
        raise InputError(f"{prepared.scene.path}: {fault}") from fault


def empty_tallies(prepared: Prepared) -> Tallies:
    """Return tallies without any rock: the counts of a run for its map cells, facets, zones, areas and barriers.

    If the scene has several sources, the tallies also count each source separately.
    """
    scene, engine = prepared.scene, prepared.engine
    compiled = isinstance(engine, Compiled)
    facets = engine.facets if compiled else facets_of(prepared.terrain)
    locator = engine.locator if isinstance(engine, Compiled) else bucket_locator(facets)
    ground = ground_over(facets, locator, prepared.raster)
    zones = len(prepared.terrain.zones)
    limit = memory_of_bins(scene, prepared.raster, facets)
    binning = Binning(coarse=_scales(prepared, PER_OCTAVE), fine=_scales(prepared, FINE), limit=limit)
    tallies = tallies_over(ground, areas_of(prepared.outlines), zones, scene.gravity, binning, compiled)
    tallies = with_ways(tallies) if asks_ways(scene.hazard) else tallies
    tallies = replace(tallies, spins=spins_of(prepared.flight.models))
    names = [source.name for source in prepared.sources]
    barriers = empty_barriers(scene, prepared.flight, compiled, len(names))
    return replace(with_sources(tallies, names), barriers=barriers)


def _scales(prepared: Prepared, per_octave: int) -> Scales:
    """Return the bins for percentiles, which cover all energies, speeds and heights that rocks of a scene can reach.

    All parts of a run have the same bins. per_octave : number of bins from a value to its double
    """
    facets, sources = prepared.engine.facets, prepared.sources
    fastest = max((_fastest(source) for source in sources), default=0.0)
    highest = max((_highest(source, facets.high[2]) for source in sources), default=0.0)
    masses, spins = mass_range(prepared.rock), spins_of(prepared.flight.models)
    return scales_over(facets, prepared.scene.gravity, fastest, highest, masses, per_octave, spins)


def _highest(source: Source, top: float) -> float:
    """Return an upper bound of the heights (m, local frame) at which a source releases rocks, to size the bins.

    top : m, height of the terrain's highest point, local frame
    """
    above = source.spread[2] + (source.above_ground or 0.0)
    on_ground = source.above_ground is not None or source.triangles is not None
    return (top if on_ground else float(source.points[:, 2].max())) + above


def _fastest(source: Source) -> float:
    """Return an upper bound of the release speeds (m/s) of a source, to size the bins."""
    if source.throw is not None:
        return source.throw.speed.high
    return float(np.linalg.norm(source.velocity) + np.linalg.norm(source.velocity_spread))


def empty_totals(prepared: Prepared) -> Totals:
    """Return empty totals for the rocks of a scene: outcomes, speeds, energies and distances."""
    return Totals(position=position_of_stops(prepared), spins=spins_of(prepared.flight.models))


def position_of_stops(prepared: Prepared) -> Callable[[FloatArray], FloatArray] | None:
    """Return the function that measures the positions of stops along `observed.along`, the direction of comparison.

    The function takes points (N, 3) m in the local frame, and returns positions (N,) m along the direction, measured
    from the local origin. If the scene has no observed end points, the result is None instead of a function.
    """
    observed = prepared.scene.observed
    return None if observed is None else position_along(observed, prepared.terrain.frame)
