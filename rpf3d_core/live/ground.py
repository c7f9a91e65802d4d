"""The terrain that rocks fly over in a live simulator: built from a whole survey, and changed by patches.

A terrain is built from a whole survey in memory that no terrain in use occupies. Meanwhile, rocks can fly over another
terrain. A patch changes the arrays of the terrain in use: no rock may fly over this terrain during the change, and the
terrain from before the patch must not be used afterwards.

Parts of a terrain that share no vertex, called pieces in the code, may pass through each other in a mesh survey. Only a
mesh survey is tested for such parts: clouds have one height at each place in plan, and so do grids, except at small
folds (`live.plausible`). A patch removes all facets in its footprint.

Only a mesh survey can have open seams; narrow ones are closed before the search structure is built. A patch is joined
to the terrain at vertices of the patch and of the terrain, so it adds no T-junction.
"""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.detection.bucket_grid import CellRectangle
from rpf3d_core.detection.bucket_locator import BucketLocator, bucket_locator
from rpf3d_core.detection.bucket_patch import Plan
from rpf3d_core.detection.caps import CapFacets, CapLocator
from rpf3d_core.detection.footprint import STAYS
from rpf3d_core.detection.terrain_pieces import PieceNumbers
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.jit.memory import Share, Threads, halves
from rpf3d_core.live.closed_mesh import closed_mesh
from rpf3d_core.live.digests import digest_of
from rpf3d_core.live.patched_arrays import IndexedTerrain, with_patch
from rpf3d_core.live.patching import PatchChange, change_of
from rpf3d_core.live.plausible import TALLEST_FACE, check_heights, check_no_fold
from rpf3d_core.live.reused_memory import Room, Rooms
from rpf3d_core.live.survey import MOST_POINTS, CloudSurvey, GridSurvey, MeshSurvey, Survey, check_points, points_of
from rpf3d_core.simulation.capped import APART, caps_within, pieces_that_cross
from rpf3d_core.simulation.engines import Compiled, Engine, Reference
from rpf3d_core.terrain.closed_seams import may_have_seams
from rpf3d_core.terrain.cloud import cloud_mesh
from rpf3d_core.terrain.facets import Facets, Terrain, contact_tolerance, facets_from, lay_out, unit_normals
from rpf3d_core.terrain.frame import FloatArray, Frame
from rpf3d_core.terrain.grid_rows import Mesh, grid_mesh
from rpf3d_core.terrain.mesh.border import border_after, border_of, net_sides
from rpf3d_core.terrain.mesh.mesh_ready import ready_mesh

ZONE = "terrain"
"""Name of the zone of every facet of a live terrain, because surveys have no zones."""
WELD = 1e-4
"""Distance (m) below which vertices of a mesh survey are merged, unless the user sets another distance."""
THREADS = 2
"""Number of threads that compute the data of a terrain; each thread computes one half of the facets."""


class Changed(NamedTuple):
    """The part of the terrain that the last patch changed, so that only this part is computed again.

    block : range of search cells (buckets) in which facets were removed or added
    low, high : corners in plan of the box of these facets, m, local frame
    """

    block: CellRectangle
    low: Plan
    high: Plan


class TerrainSurveys(NamedTuple):
    """The surveys that a terrain was made from; digests, stamps (ns) and closed seams as in `LiveTerrain`."""

    digest: str
    whole_digest: str
    stamp_ns: int
    whole_ns: int
    closed_seams: int = 0


class Border(NamedTuple):
    """The border of a terrain (boundary and rims of holes), with the caps that catch flights through gaps.

    sides : (B, 3, 3) m, sides of facets without a neighbour: begin, end, and third corner of the facet
    caps : triangles over the gaps that the sides enclose; never None, because flights would have to be compiled again
        if a patch opened the first gap
    """

    sides: FloatArray
    caps: CapFacets


@dataclass(frozen=True, eq=False)
class LiveTerrain:
    """The terrain of a live simulator, with everything that is needed to fly rocks over it.

    terrain, facets : the triangles; engine : flies rocks over the facets; all three use the same memory (`room`). The
        engine is compiled, unless `Workshop` uses the reference engine
    digest : SHA-256 (hex) of the whole survey; after a patch, of the patch and the digest before the patch
    whole_digest : SHA-256 (hex) of the whole survey without patches, to notice that the same survey is published again;
        "" if it is not known. A patch never changes this digest, not even a patch that replaces the whole terrain
    stamp_ns : stamp (ns) of the last survey or patch
    received_ns : time (ns) when the terrain was built or last patched, by the machine's clock
    whole_ns : stamp (ns) of the whole survey; a patch keeps this stamp, because the terrain around the patch stays old.
        A patch that replaces the whole terrain counts as a whole survey
    patches : number of patches since the terrain was built from a whole survey
    locator : search structure over the facets; room : the memory of all arrays
    border : the sides of facets without a neighbour, and the caps over the gaps that these sides enclose
    pieces : for each facet the number of its part of the mesh (parts share no vertex), if two parts can pass through
        each other; else `APART`; never None, so that flights are compiled once
    changed : where the last patch changed the terrain; None if the terrain was built from a whole survey
    closed_seams : number of vertices at which seams of the whole survey were closed
    """

    terrain: Terrain
    facets: Facets
    engine: Engine
    digest: str
    whole_digest: str
    stamp_ns: int
    whole_ns: int
    received_ns: int
    patches: int
    locator: BucketLocator
    room: Room
    border: Border
    pieces: PieceNumbers
    changed: Changed | None = None
    closed_seams: int = 0


class Workshop:
    """Builds the terrains of a live simulator from surveys, while other threads fly rocks or patch a terrain.

    Parameters
    ----------
    weld : float
        Distance (m) below which vertices of a mesh are merged.
    most_points : int
        Largest number of points in a survey.
    longest_edge : float, optional
        m; triangles of a cloud or grid with a longer side in plan are left out. If None, the limit for a cloud is
        `terrain.cloud.GAP` times the median of the longest sides of its triangles, and a grid has no limit.
    reference : bool
        True to use the reference engine, which is slow.
    must_face_up : bool
        True to refuse a mesh if more of its facets face down than up; False to turn its facets over.
    tallest_face : float
        m; a survey or patch with a steep facet that is taller is refused (`live.plausible`).
    """

    def __init__(
        self, weld: float = WELD, most_points: int = MOST_POINTS, longest_edge: float | None = None,
        reference: bool = not HAS_NUMBA, must_face_up: bool = False, tallest_face: float = TALLEST_FACE,
    ) -> None:  # fmt: skip
        self._weld, self._most, self._longest, self._reference = weld, most_points, longest_edge, reference
        self._must_face_up, self._tallest = must_face_up, tallest_face
        self._share: Share = Threads(THREADS)
        self._aside = ThreadPoolExecutor(1, thread_name_prefix="digest")
        self._rooms = Rooms()

    def whole(
        self, survey: Survey, stamp_ns: int = 0, digest: str = "", whole_ns: int | None = None,
        whole_digest: str | None = None,
    ) -> LiveTerrain:  # fmt: skip
        """Return the terrain built from a whole survey, ready for flights.

        Raises TerrainError if the survey is too large, is not a terrain, or has a shape that no ground has
        (`live.plausible`).

        stamp_ns : stamp of the survey (ns); digest : the digest of the survey if it is known, "" to compute it
        whole_ns, whole_digest : stamp (ns) and digest of the whole survey without patches, if `survey` already includes
            patches ("" if the digest is not known); None to use stamp and digest of `survey`
        """
        check_points(points_of(survey), self._most)
        hashed = self._aside.submit(lambda: digest or digest_of(survey))
        with self._rooms.free_one() as room:
            room.begin()
            mesh, closed = self._mesh(survey, room), 0
            sides = border_of(mesh.vertices, mesh.triangles, room.memory)
            if isinstance(survey, MeshSurvey) and may_have_seams(sides):
                mesh, closed = closed_mesh(mesh, room.memory)
            if closed:
                sides = border_of(mesh.vertices, mesh.triangles, room.memory)
            terrain = self._terrain(mesh, room)
            facets = _laid_out(terrain, room, self._share)
            check_heights(terrain, facets.corners, facets.normals, self._tallest)
            if isinstance(survey, GridSurvey):
                check_no_fold(terrain, facets.normals, survey.points)
            locator = bucket_locator(facets, room.memory, self._share)
            border = _border(sides, facets.tolerance)
            indexed = IndexedTerrain(terrain=terrain, facets=facets, locator=locator)
            pieces = pieces_that_cross(terrain) if isinstance(survey, MeshSurvey) else APART
            known = hashed.result()
            surveys = TerrainSurveys(
                digest=known,
                whole_digest=known if whole_digest is None else whole_digest,
                stamp_ns=stamp_ns,
                whole_ns=stamp_ns if whole_ns is None else whole_ns,
                closed_seams=closed,
            )
            return self._ground(indexed, room, border, border.caps, pieces, surveys)

    def patched(self, ground: LiveTerrain, patch: CloudSurvey | GridSurvey, stamp_ns: int = 0) -> LiveTerrain:
        """Return the terrain after a patch, that is a survey of a part of the terrain.

        The result uses the memory of `ground`, so `ground` must not be used afterwards. `live.patching` describes which
        facets a patch replaces. If no facet of `ground` stays, the result is built as a whole survey from the patch
        alone, in other memory, and `ground` is unchanged.

        ground : the terrain before the patch; patch : the survey; stamp_ns : stamp of the patch (ns)

        Raises
        ------
        TerrainError
            The patch is too large, is not a terrain, has a steep facet that is too tall, folds over itself in plan,
            does not touch the terrain, reaches far beyond the terrain, has facets far wider than those of the terrain,
            or cannot be joined to the terrain. The terrain is then unchanged.
        ValueError
            `ground` has been patched already; only the terrain after that patch is valid.
        """
        check_points(points_of(patch), self._most)
        if ground.room.patches != ground.patches:
            raise ValueError("this terrain has been patched already; patch the newest terrain")
        marks = ground.room.memory.longer("marks", len(ground.facets.zone))
        try:
            mesh = self._patch_mesh(patch, ground.terrain.frame.origin)
            corners = mesh.vertices[mesh.triangles].reshape(-1, 9)
            check_heights(ground.terrain, corners, unit_normals(mesh.vertices, mesh.triangles), self._tallest)
            change = change_of(mesh, ground.terrain, ground.facets, ground.locator, marks)
            if change is not None:
                return self._changed(ground, change, digest_of(patch, ground.digest), stamp_ns)
        finally:
            ground.room.memory.longer("marks", len(marks))[:] = STAYS  # the array may have moved if it has grown
        return self.whole(patch, stamp_ns, whole_digest=ground.whole_digest)

    @property
    def size(self) -> int:
        """Size (bytes) of the memory of all terrains, in use or kept for the next terrain."""
        return self._rooms.size

    def _changed(self, ground: LiveTerrain, change: PatchChange, digest: str, stamp_ns: int) -> LiveTerrain:
        border = _border_after(ground, change)
        indexed = with_patch(ground.terrain, ground.facets, ground.locator, change, ground.room, self._share)
        changed = Changed(block=change.block, low=change.low, high=change.high)
        pieces = pieces_that_cross(indexed.terrain) if ground.pieces.overlap else APART
        surveys = TerrainSurveys(
            digest, ground.whole_digest, stamp_ns=stamp_ns, whole_ns=ground.whole_ns, closed_seams=ground.closed_seams
        )
        caps = ground.engine.caps if border is ground.border else None  # most patches keep the caps and their locator
        return self._ground(indexed, ground.room, border, caps or border.caps, pieces, surveys, changed)

    def _ground(
        self, indexed: IndexedTerrain, room: Room, border: Border, caps: CapFacets | CapLocator, pieces: PieceNumbers,
        surveys: TerrainSurveys, changed: Changed | None = None,
    ) -> LiveTerrain:  # fmt: skip
        """Return the terrain with a new engine, and register the terrain and the engine as users of the memory `room`.

        caps : the caps of the border, or an existing locator over these caps
        """
        terrain, facets, locator = indexed
        engine: Engine = Reference(facets, caps, pieces) if self._reference else Compiled(facets, locator, caps, pieces)
        ground = LiveTerrain(
            terrain=terrain,
            facets=facets,
            engine=engine,
            digest=surveys.digest,
            whole_digest=surveys.whole_digest,
            stamp_ns=surveys.stamp_ns,
            whole_ns=surveys.whole_ns,
            received_ns=time.time_ns(),
            patches=room.patches,
            locator=locator,
            room=room,
            border=border,
            pieces=pieces,
            changed=changed,
            closed_seams=surveys.closed_seams,
        )
        room.used_by(ground, terrain, engine)
        return ground

    def _mesh(self, survey: Survey, room: Room) -> Mesh:
        if isinstance(survey, GridSurvey):
            return grid_mesh(survey.points, room.memory, self._share, longest_edge=self._longest)
        if isinstance(survey, MeshSurvey):
            return ready_mesh(
                survey.vertices, survey.triangles, ZONE, self._weld, room.memory, self._share, self._must_face_up
            )
        return _kept(cloud_mesh(survey.points, self._longest), room)

    def _patch_mesh(self, patch: CloudSurvey | GridSurvey, origin: tuple[float, float, float]) -> Mesh:
        if isinstance(patch, GridSurvey):
            return grid_mesh(patch.points, origin=origin, longest_edge=self._longest)
        return cloud_mesh(patch.points, self._longest, origin)

    def _terrain(self, mesh: Mesh, room: Room) -> Terrain:
        zone = room.memory("zone", len(mesh.triangles), np.int32)
        zone[:] = 0
        return Terrain(mesh.vertices, mesh.triangles, zone, (ZONE,), Frame(mesh.origin))


def _kept(mesh: Mesh, room: Room) -> Mesh:
    """Return a copy of the mesh with its arrays in `room`, the memory of a live terrain, so patches can change them."""
    vertices = room.memory("vertices", mesh.vertices.size, np.float64).reshape(-1, 3)
    triangles = room.memory("triangles", mesh.triangles.size, np.int32).reshape(-1, 3)
    vertices[:], triangles[:] = mesh.vertices, mesh.triangles
    return Mesh(vertices=vertices, triangles=triangles, origin=mesh.origin)


def _laid_out(terrain: Terrain, room: Room, share: Share) -> Facets:
    """Return the facets of a terrain, with their arrays in the memory of this terrain (`room`).

    share : runs functions in parallel
    """
    count = len(terrain.triangles)
    geometry = room.memory("geometry", 12 * count, np.float64).reshape(-1, 12)
    room.memory("marks", count, np.uint8)[:] = STAYS
    boxes = np.array([[[np.inf] * 3, [-np.inf] * 3]] * 2)
    parts: list[Callable[[], Any]] = [
        lambda k=k, a=a, b=b: lay_out(terrain.vertices, terrain.triangles, a, b, geometry, boxes[k])  # type: ignore[misc]
        for k, (a, b) in enumerate(halves(count))
    ]
    share(parts)
    (x, y, z), (u, v, w) = boxes[:, 0].min(axis=0).tolist(), boxes[:, 1].max(axis=0).tolist()
    tolerance = contact_tolerance((x, y, z), (u, v, w), terrain.frame.origin)
    return facets_from(geometry, terrain.zone, (x, y, z), (u, v, w), tolerance)


def _border(sides: FloatArray, tolerance: float) -> Border:
    """Return the border of a terrain with the caps over its gaps.

    sides : (B, 3, 3) m, sides of facets without a neighbour: begin, end, and third corner of the facet
    tolerance : m, contact tolerance
    """
    return Border(sides, caps_within(sides, tolerance))


def _border_after(ground: LiveTerrain, change: PatchChange) -> Border:
    """Return the border of a terrain after a patch; most patches change neither its sides nor its caps."""
    sides = net_sides(ground.terrain.triangles[change.gone], change.triangles)
    if len(sides) == 0:
        return ground.border
    old, coming = sides < len(ground.terrain.vertices), np.maximum(sides - len(ground.terrain.vertices), 0)
    placed = ground.terrain.vertices[np.where(old, sides, 0)]
    placed[~old] = change.vertices[coming[~old]]
    return _border(border_after(ground.border.sides, placed), ground.facets.tolerance)
