"""Make the report of `rpf3d check`: mesh faults, source heights, warnings, and time and memory of a run.

The check refuses every scene that `rpf3d run` refuses, with one exception: rocks that do not start above the terrain
are reported for each source.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.sizes import diameter_of, mass_range
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.raster import GIGABYTE
from rpf3d_core.hazard.tally import BYTES_PER_CELL
from rpf3d_core.results.overconfidence import behind_a_crest
from rpf3d_core.runs.check_calibration import observations_in_words, unknowns_in_words
from rpf3d_core.runs.check_effects import effects_called_for, idle_effects
from rpf3d_core.runs.check_shapes import measured_sizes, shapes_in_words
from rpf3d_core.runs.pilot_run import Cost, pilot_run
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.zone_materials import unused_materials, without_friction
from rpf3d_core.setup.prepared import Prepared, check_engine, prepare, read_companions
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.setup.warnings.extents import TERRAIN, Extent, input_extents, other_extents
from rpf3d_core.setup.warnings.hanging_rims import hanging_rims
from rpf3d_core.setup.warnings.misplaced_inputs import refuse_other_systems
from rpf3d_core.setup.warnings.placement import looked_at, placement_warnings, rocks_of_sources
from rpf3d_core.setup.warnings.source_heights import SourceHeight
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of_speed
from rpf3d_core.setup.warnings.wrong_coordinates import placing_hints, placing_notes
from rpf3d_core.simulation.engines import Reference
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.zones import zones_with_facets

MOST_CHECKED = 50_000
"""Approximate largest number of rocks whose start is checked, so that a check takes seconds.

The checked rocks are evenly spread over each source.
"""
@dataclass(frozen=True)
class Maps:
    """The size and memory of the hazard maps that a run of the scene will make.

    raster : the cells of the maps; facets : number of facets; allowed : largest memory (GB) of the maps
    Percentiles become coarser to stay within `allowed`.
    """

    raster: Raster
    facets: int
    allowed: float

    @property
    def least(self) -> float:
        """Memory (GB) of the counts of all cells and facets, without percentiles.

        `hazard.raster.check_memory` compares the same sum with the memory that the scene allows.
        """
        return (self.raster.nx * self.raster.ny + self.facets) * BYTES_PER_CELL / GIGABYTE

    def describe(self) -> str:
        """Return size and memory of the hazard maps as one line of text."""
        cells = f"{self.raster.nx:,} x {self.raster.ny:,} cells of {self.raster.cell:g} m and {self.facets:,} facets"
        return f"{cells}: {max(self.least, 0.001):.3f} GB, and percentiles in what is left of {self.allowed:g} GB"


@dataclass(frozen=True)
class Sizes:
    """The ranges of mass and diameter of the rocks of a scene, from which the user can see wrong units.

    lightest, heaviest : kg; smallest, largest : m, diameters of spheres with these masses
    """

    lightest: float
    heaviest: float
    smallest: float
    largest: float

    def describe(self) -> str:
        """Return both ranges as one line of text."""
        masses, diameters = _span(self.lightest, self.heaviest), _span(self.smallest, self.largest)
        return f"{masses} kg, {diameters} m in diameter"


@dataclass(frozen=True)
class Check:
    """The report of `rpf3d check` on a scene.

    rocks : masses and diameters; maps : size of the hazard maps; sources : start heights of each source
    warnings : sentences on settings that are valid but suspicious
    cost : estimated time of the run; None if `fit` is False, because no pilot run is then flown
    assumed_friction : names of the materials that use the default friction angle
    shapes : sentences on the shapes of the rocks and on their files; empty for points and spheres
    measured : sentences on the files of measured sizes: the column and the unit that are read
    observed : lines on the observations that `rpf3d calibrate` reads; empty if the scene has no calibration
    idle : names of the materials that no zone of the terrain has, so that their unknowns change nothing
    calibrated : the unknowns that `rpf3d calibrate` fits, with their priors; empty if the scene has no calibration
    """

    scene: Scene
    faults: FaultReport
    rocks: Sizes
    maps: Maps
    sources: list[SourceHeight]
    warnings: list[str]
    cost: Cost | None
    assumed_friction: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    measured: tuple[str, ...] = ()
    observed: tuple[str, ...] = ()
    calibrated: str = ""
    idle: tuple[str, ...] = ()

    @property
    def fit(self) -> bool:
        """True if every checked rock starts above the terrain, so that the scene can be run."""
        return not any(source.under_ground or source.off_terrain for source in self.sources)


Shown = Callable[[list[Extent], list[str]], None]
"""A function that shows the extents of all inputs, and sentences on inputs that look misplaced."""


def check_scene(scene: Scene, show: Shown | None = None) -> Check:
    """Check a scene and its terrain without a full run, and estimate the time of the run from a few rocks.

    show : called with the extents of all inputs, and with sentences on inputs that look misplaced, after the terrain
        has been read, even if the terrain is then refused; not called if an earlier check fails, for example if a file
        of points is damaged. If another input is refused later, `show` is called again, with an empty list of extents
        and the remarks on the terrain, if there are any

    Raises
    ------
    InputError
        The scene or one of its files is refused.
    """
    check_engine(scene)
    read_companions(scene)
    read = _terrain_after_showing(scene, show)
    by_reference = scene.model_copy(update={"engine": Reference.name})  # it needs no compiling
    with _remarks_before_refusal(read[1], show):
        prepared = prepare(by_reference, terrain_read=read)
        releases, heights = looked_at(prepared, MOST_CHECKED)
    maps = Maps(raster=prepared.raster, facets=len(prepared.terrain.triangles), allowed=scene.hazard.memory_gb)
    placed = placement_warnings(prepared, releases, heights)
    rims = hanging_rims(prepared.terrain, prepared.engine)
    observed, doubts = observations_in_words(prepared)
    warnings = [*prepared.faults.remarks, *prepared.doubts, *placed, *rims, *doubts]
    assumed = without_friction(scene, prepared.terrain.zones)
    report = Check(
        scene=scene,
        faults=prepared.faults,
        rocks=_sizes(prepared),
        maps=maps,
        sources=heights,
        warnings=warnings,
        cost=None,
        assumed_friction=assumed,
        shapes=shapes_in_words(scene),
        measured=measured_sizes(scene),
        observed=observed,
        calibrated=unknowns_in_words(scene),
        idle=tuple(unused_materials(scene, zones_with_facets(prepared.terrain))),
    )
    return _with_pilot(report, prepared, releases) if report.fit else report


@contextmanager
def _remarks_before_refusal(faults: FaultReport, show: Shown | None) -> Iterator[None]:
    """Context manager: if an input is refused in the `with` block, show the remarks on the terrain, which may say why.

    The InputError is then raised again. For example, an input may lie off a terrain whose file states another unit than
    the unit in which the file is read.
    """
    try:
        yield
    except InputError:
        if show is not None and faults.remarks:
            show([], list(faults.remarks))
        raise


def _terrain_after_showing(scene: Scene, show: Shown | None) -> tuple[Terrain, FaultReport]:
    """Read the terrain of a scene, then show the extents of all inputs; return the terrain and its faults.

    The extents are also shown if the terrain is refused, unless its files cannot be read.

    Raises
    ------
    InputError
        The terrain is refused. If another input is in another reference system, the message names this input instead.
    """
    read: tuple[Terrain, FaultReport] | None = None
    try:
        read = read_terrain(scene)
        return read
    except InputError:
        # Lines of berms or polygons of zones in another reference system cause errors that do not name this cause.
        refuse_other_systems(other_extents(scene), scene.terrain.crs)
        raise
    finally:
        if show is not None:
            _show_extents(scene, None if read is None else read[1], show)


def _show_extents(scene: Scene, faults: FaultReport | None, show: Shown) -> None:
    """Show the extents of all inputs, and sentences on inputs that look misplaced.

    Show nothing if the terrain is refused and its extent is not known.

    faults : the report on the mesh of the terrain; None if the terrain is refused
    """
    extents = input_extents(scene, faults)
    if faults is not None:
        show(extents, list(placing_notes(scene, faults, extents[1:])))
    elif extents[:1] and extents[0].name == TERRAIN:
        show(extents, list(placing_hints(extents, scene.terrain.crs, scene.terrain.up)))


def _with_pilot(report: Check, prepared: Prepared, releases: Releases) -> Check:
    """Return the report with the results of a pilot run: the estimated time of a run, and further warnings.

    The warnings are about high speeds, sources behind a crest, missing effects, and effects that change nothing.

    prepared : the scene, prepared for the reference engine
    releases : of all checked rocks; the rocks of the pilot run are chosen from them
    """
    few, flown, cost = pilot_run(report.scene, prepared, releases, sum(rocks_of_sources(prepared)))
    fastest = float(flown.deposits.max_speed.max(initial=0.0))
    behind = behind_a_crest(flown.deposits, [source.name for source in prepared.sources], "pilot rocks")
    sentences = [
        *warnings_of_speed(fastest), *behind, *effects_called_for(report.scene, flown),
        *idle_effects(prepared, few, flown),
    ]  # fmt: skip
    return replace(report, cost=cost, warnings=[*report.warnings, *sentences])


def _sizes(prepared: Prepared) -> Sizes:
    """Return the range of the rocks' masses, and the range of diameters of spheres with these masses."""
    lightest, heaviest = mass_range(prepared.rock)
    smallest, largest = (diameter_of(mass, prepared.scene.rock.density) for mass in (lightest, heaviest))
    return Sizes(lightest=lightest, heaviest=heaviest, smallest=smallest, largest=largest)


def _span(low: float, high: float) -> str:
    """Return the interval between two numbers as text; a single number if both ends are equal."""
    return three_figures(low) if low == high else f"{three_figures(low)}-{three_figures(high)}"
