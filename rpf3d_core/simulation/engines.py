"""The two engines: one runs the physics in plain Python with VTK, the other as compiled code with a bucket grid."""

import math
from copy import copy
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.caps import CapFacets, CapLocator
from rpf3d_core.detection.stepped import stepped
from rpf3d_core.detection.stepped_raster import SteppedRaster
from rpf3d_core.detection.terrain_pieces import PieceNumbers, TerrainPieces
from rpf3d_core.effects.hooks import Chain, links_of
from rpf3d_core.jit.cache import is_cached
from rpf3d_core.jit.dispatch import HAS_NUMBA, loop
from rpf3d_core.materials.rock_context import RockContext, key_of, rock_of
from rpf3d_core.simulation.launches import Launches, Needed, Starts, launches_of, needed_by
from rpf3d_core.simulation.march import follow, locator_for, set_down
from rpf3d_core.simulation.parabola import ground_below
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.record import Logbook, close_rock, empty_record, record_from
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Facets, Terrain, facets_of, plain
from rpf3d_core.values import ZERO, Motion

FINAL_COLUMNS = ("t", "x", "y", "z", "path", "max_speed", "max_height", "ground_speed")
"""Columns with the results of a rock at the end of its flight.

t : s; x, y, z : m, place of the end; path : m, length of the path; max_speed : m/s
max_height : m above the ground, NaN until the path is evaluated
ground_speed : m/s, speed at the beginning of the first sustained contact; NaN if there was none
"""
SPIN_FINALS = ("max_rotational_energy", "max_total_energy")
"""Additional result columns (J) for rocks that spin, computed from the recorded paths; NaN without a recorded path."""
COUNT_COLUMNS = ("outcome", "facet", "impacts", "pieces")
"""Columns with integers for each rock: outcome, facet of the last contact, numbers of impacts and path segments.

The facet is -1 if the rock touched no facet.
"""
BODY_FINALS, BODY_COUNTS = ("q_w", "q_x", "q_y", "q_z", "lift"), ("why",)
"""Additional columns of results and of counts for bodies with a shape.

Results: the orientation at the end, and how far (m) the body was lifted off the ground at its release. Counts: why the
body stopped (`bodies.rest.Stop`).
"""

SAMPLE = 100_000
"""Least number of facets in the sample from which the typical facet size is estimated, if the terrain has as many."""

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Models(NamedTuple):
    """The models of a scene: the parameters of its rebound model, its ground model and its effects.

    rebound, ground : parameters of the two models; effects : a `Chain`, None without effects

    A parameter class has `asks_rock = True` if its rules need the rock's mass and radius, and `draws = True` if its
    rules draw random numbers. A rebound class has `spins = True` if its rules change the spin, so that spins are
    recorded, and `bodies = True` if it is a contact model for bodies with a shape.
    """

    rebound: Any
    ground: Any
    effects: Chain | None = None


def spins_of(models: Models) -> bool:
    """Return True if rocks spin with the models of a scene, so that spins and rotational energies are recorded.

    The result is the attribute `spins` of the rebound model's class; False if the class does not have it.
    """
    return bool(getattr(models.rebound, "spins", False))


def bodies_of(models: Models) -> bool:
    """Return True if the rocks of a scene are bodies with a shape: the rebound model's class has `bodies = True`."""
    return bool(getattr(models.rebound, "bodies", False))


class Reference:
    """The reference engine: plain Python, one rock after another; VTK finds the candidate facets of a contact.

    This engine is slow and simple. Tests compare the results of the compiled engine with its results.

    method : finds the contacts of flights: the locator, which finds every contact, or fixed time steps (`stepping`)
    caps : finds passages through the caps over the gaps of the terrain; None if no caps are given
    pieces : finds contacts of a sliding rock with other separate parts of the terrain; None if no pieces are given
    """

    name = "reference"

    def __init__(
        self, facets: Facets, caps: CapFacets | CapLocator | None = None, pieces: PieceNumbers | None = None
    ) -> None:
        """Build the search structures.

        facets : the terrain; caps : the caps over gaps, or the locator of an engine with the same caps
        pieces : the separate part of the terrain for each facet (`capped.piece_numbers`)
        """
        from rpf3d_core.detection import vtk_closest  # noqa: F401  (only this engine needs VTK, and its rules)
        from rpf3d_core.detection.vtk_locator import VtkLocator

        self.facets = plain(facets)
        self.locator = VtkLocator(facets)
        self.method: Any = self.locator
        if isinstance(caps, CapFacets):
            caps = CapLocator(locator=VtkLocator(caps.facets), facets=plain(caps.facets), layout=plain(caps.layout))
        self.caps = caps
        self.pieces = None if pieces is None else TerrainPieces(self.locator, *plain(pieces))

    def follow(
        self, models: Models, materials: Any, settings: Settings, starts: Starts, logbook: Logbook, begin: int
    ) -> int:
        """Fly rocks `begin` to R - 1 of the R rocks in `starts`, and write their flights into the logbook.

        models : of the scene; materials : surface properties of the zones; settings : gravity, limits and seed

        The flights end at the first rock whose path does not fit into the record; its number is returned, so that the
        caller can continue there with another record. If all paths fit, R is returned. Raises MemoryError if too many
        facets lie near one body with a shape (`follow_bodies`).
        """
        columns = starts._asdict().items()
        lists: dict[str, Any] = {name: None if column is None else column.tolist() for name, column in columns}
        listed = Starts(**lists)
        physics = _physics(plain(models), self, plain(materials), settings)
        launches = launches_of(needs_of(models, materials), settings.seed, listed)
        if bodies_of(models):
            return follow_bodies(False, physics, self.method, launches, logbook, begin)
        return int(_follow_all.py_func(physics, self.method, launches, logbook, begin))  # type: ignore[attr-defined]

    def ground_below(self, x: Floats) -> Floats:
        """Return three columns (R, 3) for R points x (R, 3) m: height (m) above the ground, facet below, its side.

        If no ground lies below a point, as over a hole, the facet is below 0 and the height is 0. The side is 1 for the
        free side of the facet, -1 for its back.
        """
        out = np.empty((len(x), 3))
        _ground_below_all.py_func(self.locator, self.facets, x.tolist(), out)  # type: ignore[attr-defined]
        return out


class Compiled:
    """The compiled engine: numba compiles the same functions; a bucket grid finds the candidate facets of a contact.

    Several threads may call the engine at once.

    locator : the buckets over the facets, built here if not given
    method : finds the contacts of flights: the locator, which finds every contact, or fixed time steps (`stepping`)
    caps, pieces : find passages through caps, and contacts with other separate parts of the terrain; None if not given
    """

    name = "compiled"

    def __init__(
        self, facets: Facets, locator: Any = None, caps: CapFacets | CapLocator | None = None,
        pieces: PieceNumbers | None = None,
    ) -> None:  # fmt: skip
        """Build the search structures that are not given.

        facets : the terrain; locator : the buckets over the facets; None to build them
        caps : the caps over gaps, or the locator of an engine with the same caps
        pieces : the separate part of the terrain for each facet (`capped.piece_numbers`)
        """
        from rpf3d_core.detection.bucket_locator import bucket_locator  # compiles on first use

        self.facets = facets
        self.locator = locator or bucket_locator(facets)
        self.method: Any = self.locator
        if isinstance(caps, CapFacets):
            caps = CapLocator(locator=bucket_locator(caps.facets), facets=caps.facets, layout=caps.layout)
        self.caps = caps
        self.pieces = None if pieces is None else TerrainPieces(self.locator, *pieces)

    def follow(
        self, models: Models, materials: Any, settings: Settings, starts: Starts, logbook: Logbook, begin: int
    ) -> int:
        """Fly rocks `begin` to R - 1 of the R rocks in `starts`, and write their flights into the logbook.

        models : of the scene; materials : surface properties of the zones; settings : gravity, limits and seed

        The flights end at the first rock whose path does not fit into the record; its number is returned, so that the
        caller can continue there with another record. If all paths fit, R is returned. Raises MemoryError if too many
        facets lie near one body with a shape (`follow_bodies`).
        """
        physics = _physics(models, self, materials, settings)
        launches = launches_of(needs_of(models, materials), settings.seed, starts)
        if bodies_of(models):
            return follow_bodies(True, physics, self.method, launches, logbook, begin)
        return int(_follow_all(physics, self.method, launches, logbook, begin))

    def ground_below(self, x: Floats) -> Floats:
        """Return height above the ground, facet and side for R points x (R, 3) m, as `Reference.ground_below`."""
        out = np.empty((len(x), 3))
        _ground_below_all(self.locator, self.facets, np.ascontiguousarray(x), out)
        return out


Engine = Reference | Compiled


def follow_bodies(
    compiled: bool, physics: Physics, method: Any, launches: Launches, logbook: Logbook, begin: int
) -> int:  # fmt: skip
    """Fly bodies with a shape, and write their flights into the logbook, as `Reference.follow` does.

    The code for bodies is imported here, so that other scenes do not load it.

    compiled : True for the compiled engine; method : contact search of the engine, as in `Reference`
    begin : number of the first rock to fly

    Returns the number of the first body whose path did not fit into the record; the number of bodies if all fitted.

    Raises
    ------
    MemoryError
        Too many facets lie near one body (`bodies.fly.LARGEST_ROOM`).
    """
    from rpf3d_core.simulation.bodies.fly import follow_each, follow_in_room

    if not compiled:
        from rpf3d_core.detection import vtk_swept  # noqa: F401  (only this engine needs its rules)
    loop_of = follow_each if compiled else follow_each.py_func  # type: ignore[attr-defined]
    return int(follow_in_room(loop_of, physics, method, launches, logbook, begin))


def needs_of(models: Models, materials: Any) -> Needed:
    """Return the data of each rock that the models of a scene and the materials of its zones need."""
    return needed_by((models.rebound, models.ground, *links_of(models.effects)), materials)


def _physics(models: Models, engine: Engine, materials: Any, settings: Settings) -> Physics:
    """Return models, terrain, materials and settings as one value for the flight loop."""
    return Physics(
        rebound=models.rebound,
        ground=models.ground,
        effects=models.effects,
        facets=engine.facets,
        materials=materials,
        settings=settings,
        caps=engine.caps,
        pieces=engine.pieces,
    )


def engine_of(name: str, facets: Facets, caps: CapFacets | None = None, pieces: PieceNumbers | None = None) -> Engine:
    """Return a new engine of the given name ("reference" or "compiled") over the facets, with its search structures.

    caps : facets that close the gaps of the terrain (`capped.gap_facets`); None for a terrain without gaps
    pieces : the separate part of the terrain for each facet (`capped.piece_numbers`); None if no parts overlap

    Raises
    ------
    ValueError
        Unknown name, or "compiled" without numba.
    """
    if name == Reference.name:
        return Reference(facets, caps, pieces)
    if name == Compiled.name and HAS_NUMBA:
        return Compiled(facets, caps=caps, pieces=pieces)
    reason = "numba is not installed" if name == Compiled.name else "engines are reference and compiled"
    raise ValueError(f"engine {name!r} cannot be used: {reason}")


def stepping(engine: Engine, dt: float, threshold: float, squared: bool = False, every_step: bool = False) -> Engine:
    """Return a copy of the engine that finds contacts in fixed time steps, to show the errors of that method.

    The method is `detection.stepped`. The heights from `ground_below` of the copy are still exact, and so are the
    heights on which effects depend (`parabola.height_for_effects`).

    dt : time step, s; threshold : distance to a facet below which the rock is in contact, m, or m2 if `squared` is True
    squared : True to compare the squared distance with the threshold
    every_step : True to test each step; False to skip the steps in which the rock cannot reach a facet
    """
    other = copy(engine)
    other.method = stepped(engine.locator, facet_size(engine.facets), dt, threshold, squared, every_step)
    return other


def stepping_over_squares(engine: Engine, x: float, y: float, cell: float, there: Any, dt: float) -> Engine:
    """Return a copy of the engine that finds contacts in fixed time steps on a raster, to show the errors of rasters.

    engine : engine over the raster's facets, row by row; two facets for each square that is flagged in `there`
    there : (ny, nx) True for each square that has ground
    x, y : south-west corner of the first square, m; cell : side of a square, m; dt : time step, s

    A step finds a contact only when the rock is already below the ground. At the lowest ground, the rock is then below
    the bounding box of the terrain. The box of the copy is therefore extended downwards by its own diagonal.

    Unlike in `stepping`, the heights on which effects depend are found in steps, too.
    """
    ny, nx = there.shape
    first = np.where(there, 2 * (np.cumsum(there).reshape(there.shape) - 1), -1).astype(np.int64).ravel()
    other = copy(engine)
    other.method = SteppedRaster(x=x, y=y, cell=cell, nx=nx, ny=ny, facet=first, dt=dt)
    low, high = engine.facets.low, engine.facets.high
    other.facets = engine.facets._replace(low=(low[0], low[1], low[2] - math.dist(low, high)))
    return other


def facet_size(facets: Facets) -> float:
    """Return the typical facet size (m, above 0), from which search lengths are chosen.

    The size is the side of a square with twice the mean facet area of a sample.
    """
    corners = np.asarray(facets.corners)[:: max(len(facets.zone) // SAMPLE, 1)]
    u, w = corners[:, 3:6] - corners[:, :3], corners[:, 6:9] - corners[:, :3]
    return math.sqrt(float(np.linalg.norm(np.cross(u, w), axis=1).mean())) or 1.0


def precompile_flights(engine: Engine, models: Models, materials: Any, settings: Settings) -> None:
    """Compile the functions for flights now, so that the first flight starts at once; no action for `Reference`.

    models, materials, settings : of the flights to come; only their types matter
    """
    if isinstance(engine, Compiled):
        nothing, none = np.empty((0, 3)), np.empty((0, 4), dtype=np.int64)
        first, finals = np.zeros((1, 2), dtype=np.int64), np.empty((0, 8))
        numbers, sizes, bodies = none[:, 0].copy(), nothing[:, 0].copy(), bodies_of(models)
        starts = Starts(x=nothing, v=nothing, source=numbers, rock=numbers, mass=sizes, radius=sizes)
        if bodies:
            starts = starts._replace(shape=numbers, pose=np.empty((0, 4)))
        record = empty_record(0, 0, spins_of(models), bodies)
        logbook = Logbook(record=record, first=first, finals=finals, counts=none)
        engine.follow(models, materials, settings, starts, logbook, 0)


def is_precompiled(models: Models) -> bool:
    """Return True if the disk cache has the compiled flight loop for the models, so that it need not be compiled.

    Only the classes of the rebound model and of the ground model are compared, for bodies only the class of the rebound
    model. So the result may be True although the loop must still be compiled, for example for other effects.
    """
    if bodies_of(models):
        from rpf3d_core.simulation.bodies.fly import follow_each

        return is_cached(follow_each, type(models.rebound))
    return is_cached(_follow_all, type(models.rebound), type(models.ground))


def precompile_index() -> Compiled:
    """Compile all functions that build the search structure of the compiled engine; return an engine over two facets.

    Two facets are used because the corner array of a single facet has another memory layout, and so another numba type.
    """
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    triangles, zone = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), np.zeros(2, dtype=np.int32)
    return Compiled(facets_of(Terrain(corners, triangles, zone, ("",))))


def precompile_ground_below(engine: Engine | None = None) -> None:
    """Compile the search for the ground below points, by a search with zero points.

    engine : the engine to search with; None for an engine over a terrain of two facets
    """
    (engine or precompile_index()).ground_below(np.empty((0, 3)))


@loop
def _follow_all(physics: Physics, locator: Any, launches: Launches, logbook: Logbook, begin: int) -> int:
    """Fly all rocks from number `begin` on; rock i is row i of the launches, and its results are row i of the logbook.

    The loop ends at the first rock whose path does not fit into the record, without results for this rock. Returns the
    number of this rock, or the number of all rocks if all paths fitted.

    locator : contact search of the engine, for lumped masses
    """
    x, v, finals, counts = launches.x, launches.v, logbook.finals, logbook.counts
    for i in range(begin, len(finals)):
        motion = Motion(t=0.0, x=(x[i][0], x[i][1], x[i][2]), v=(v[i][0], v[i][1], v[i][2]), w=ZERO)
        rock = RockContext(rock=rock_of(launches.sizes, i), key=key_of(launches.keys, i), impacts=0)
        written = record_from(logbook.record, logbook.first, i)
        method = locator_for(physics.rebound, locator, rock)
        released = set_down(physics.rebound, method, physics.facets, motion)
        end = follow(physics, method, released, rock, written)
        if not close_rock(logbook.record, end.tally, logbook.first, i):
            return i
        tally, at = end.tally, end.motion.x
        finals[i, 0], finals[i, 1], finals[i, 2], finals[i, 3] = end.motion.t, at[0], at[1], at[2]
        finals[i, 4], finals[i, 5] = tally.path, math.sqrt(tally.speed2)
        finals[i, 6], finals[i, 7] = math.nan, tally.ground_speed
        counts[i, 0], counts[i, 1] = end.outcome, tally.facet
        counts[i, 2], counts[i, 3] = tally.impacts, tally.pieces
    return len(finals)


@loop
def _ground_below_all(locator: Any, facets: Facets, x: Any, out: Any) -> None:
    """Write the height (m) above the ground, the facet below and its side for each of R points into `out` (R, 3).

    x : (R, 3) m, the points; locator : contact search of the engine
    """
    for i in range(len(out)):
        height, contact = ground_below(locator, facets, (x[i][0], x[i][1], x[i][2]))
        out[i, 0], out[i, 1], out[i, 2] = height, contact.facet, contact.side
