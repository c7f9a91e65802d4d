"""The messages of survey and radar in the demo: a pit, a bench that fills with muck, and rocks from the bench above."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from std_msgs.msg import Header

from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING
from rpf3d_core.errors import SceneError
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import Facets, Terrain, facets_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.cloud_messages import cloud_of_grid
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.scene_content import scene_content
from rpf3d_ros.messages.stamps import stamp_of
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

CORNER, STEP, COLUMNS, ROWS = (-586.0, -92.0), 1.5, 52, 112
"""Grid of the second survey: south-western corner (m), step (m), columns, rows.

The grid covers two benches above the haul ramp, and the edge of the ramp.
"""

TOP, EDGE, SLOPE = 1664.5, -581.0, 0.72
"""The crest that fails: height (m) and easting (m); tangent of the slope angle of its muck, 36 degrees."""
BEND, BENT = (10.0, 70.0), 8.0
"""Northings (m) between which the wall bends eastwards; eastward offset (m) of the crest beyond the bend."""
HALF_LENGTH = 55.0
"""Half the length of the muck along the wall (m); beyond this length, the muck slopes down at the same angle."""


@dataclass(frozen=True, eq=False)
class ShiftContent:
    """The published data of the demo.

    mesh : CDR bytes of the pit
    places : (S, 3) m, map frame, positions of the sources; velocities : (S, 3) m/s
    bench, muck : (H, W, 3) m, map frame, grids of the two benches before and after the crest has failed
    """

    mesh: bytes
    places: FloatArray
    velocities: FloatArray
    bench: FloatArray
    muck: FloatArray

    @property
    def speed(self) -> float:
        """The speed (m/s) of every source, taken from the first source."""
        return float(np.linalg.norm(self.velocities[0]))


def shift_content(scene: Path, sources: int) -> ShiftContent:
    """Return the messages of the demo, made from its scene.

    scene : the scene file; sources : number of sources, taken evenly from the releases of the scene

    Raises InputError if the terrain of the scene has no ground, or holes, at the two benches of the second survey.
    """
    content = scene_content(scene, MapFrame())
    some = np.linspace(0, len(content.positions) - 1, sources).round().astype(int)
    mesh = content.mesh
    zone = np.zeros(len(mesh.triangles), np.int32)
    terrain = Terrain(vertices=mesh.vertices, triangles=mesh.triangles, zone=zone, zones=("terrain",))
    bench = surveyed_again(terrain)
    if np.isnan(bench).any():
        where = extent_of(bench)
        raise SceneError(
            f"{scene}: the shift surveys two benches again, {where}, but this scene has no ground or has holes there:"
            " use config/scenes/shift.yaml or a scene of the same pit"
        )
    return ShiftContent(
        mesh=cdr_of_mesh(mesh),
        places=content.positions[some],
        velocities=content.velocities[some],
        bench=bench,
        muck=with_muck(bench),
    )


def surveyed_again(terrain: Terrain) -> FloatArray:
    """Return the ground at the two benches of the second survey as a grid (ROWS, COLUMNS, 3) m, in the terrain's axes.

    The height of a point without ground is NaN.
    """
    facets = facets_of(terrain)
    x, y = np.meshgrid(CORNER[0] + STEP * np.arange(COLUMNS), CORNER[1] + STEP * np.arange(ROWS))
    z = heights_at(engine_of("compiled" if HAS_NUMBA else "reference", facets), facets, x.ravel(), y.ravel())
    return np.stack([x, y, z.reshape(x.shape)], axis=-1)


def extent_of(points: FloatArray) -> str:
    """Return where points (H, W, 3) m lie in plan, as text for a message."""
    (west, south), (east, north) = (each(points[..., :2], axis=(0, 1)) for each in (np.min, np.max))
    return f"x from {west:g} to {east:g} m, y from {south:g} to {north:g} m"


def heights_at(engine: Engine, facets: Facets, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the heights (N,) m of the highest ground at x, y (N,) m, in the axes of `facets`; NaN without ground.

    engine : an engine that was made for `facets`
    """
    top = float(facets.high[2]) + ABOVE_EVERYTHING
    below = engine.ground_below(np.column_stack([x, y, np.full(len(x), top)]))
    return np.where(below[:, 1] < 0, np.nan, top - below[:, 0])


def with_muck(bench: FloatArray) -> FloatArray:
    """Return the grid (H, W, 3) m after the crest of the upper bench has failed and its muck fills the lower bench.

    bench : (H, W, 3) m, the grid before the failure
    """
    x, y, z = np.moveaxis(bench, -1, 0)
    edge = EDGE + BENT * np.clip((y - BEND[0]) / (BEND[1] - BEND[0]), 0.0, 1.0)
    heap = TOP - SLOPE * (x - edge) - SLOPE * np.clip(np.abs(y) - HALF_LENGTH, 0.0, None)
    return np.stack([x, y, np.where(x > edge, np.maximum(z, heap), z)], axis=-1)


def patch_message(points: FloatArray, stamp_ns: int) -> object:
    """Return a grid of points (H, W, 3) m, map frame, as a PointCloud2 for terrain/update; stamp_ns : stamp (ns)."""
    header = Header(frame_id=MapFrame().name, stamp=stamp_of(stamp_ns))
    return cloud_of_grid(header, GridSurvey(points))
