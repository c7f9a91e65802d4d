"""What survey and radar send in the demo's shift: a pit, a bench that muck fills, and rocks from the bench above it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from std_msgs.msg import Header

from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING
from rpf3d_core.errors import SceneError
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import Facets, Terrain, facets_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.scene_content import scene_content
from rpf3d_ros.messages.stamps import stamp_of
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

CORNER, STEP, COLUMNS, ROWS = (-586.0, -92.0), 1.5, 52, 112
"""South-western corner (m), step (m) and points of what is surveyed again: two benches above the ramp, and its edge."""

TOP, EDGE, SLOPE = 1664.5, -581.0, 0.72
"""Height (m) and easting (m) of the crest that failed; tan of the angle that its muck lies at, 36 degrees."""
BEND, BENT = (10.0, 70.0), 8.0
"""The wall bends eastwards from one northing (m) to the other, by so much (m)."""
HALF_LENGTH = 55.0
"""m along the wall; beyond, the muck falls off at the same slope."""


@dataclass(frozen=True, eq=False)
class ShiftContent:
    """What is sent: mesh as CDR; places (S, 3) m and velocities (S, 3) m/s; bench, muck (H, W, 3) m, map frame."""

    mesh: bytes
    places: FloatArray
    velocities: FloatArray
    bench: FloatArray
    muck: FloatArray

    @property
    def speed(self) -> float:
        """m/s, of every source."""
        return float(np.linalg.norm(self.velocities[0]))


def shift_content(scene: Path, sources: int) -> ShiftContent:
    """Read the scene of the shift; so many of its rocks are the sources. Raises InputError where it does not fit."""
    content = scene_content(scene, MapFrame())
    some = np.linspace(0, len(content.positions) - 1, sources).round().astype(int)
    terrain = Terrain(content.mesh.vertices, content.mesh.triangles, np.zeros(len(content.mesh.triangles), np.int32),
                      ("terrain",))  # fmt: skip
    bench = surveyed_again(terrain)
    if np.isnan(bench).any():
        where = extent_of(bench)
        raise SceneError(
            f"{scene}: the shift surveys two benches again, {where}, and this scene has no ground there, or holes;"
            " play it on config/scenes/shift.yaml or on a scene of the same pit"
        )
    return ShiftContent(
        cdr_of_mesh(content.mesh), content.positions[some], content.velocities[some], bench, with_muck(bench)
    )


def surveyed_again(terrain: Terrain) -> FloatArray:
    """The ground of a part as a grid (ROWS, COLUMNS, 3) m."""
    facets = facets_of(terrain)
    x, y = np.meshgrid(CORNER[0] + STEP * np.arange(COLUMNS), CORNER[1] + STEP * np.arange(ROWS))
    z = heights_at(engine_of("compiled" if HAS_NUMBA else "reference", facets), facets, x.ravel(), y.ravel())
    return np.stack([x, y, z.reshape(x.shape)], axis=-1)


def extent_of(points: FloatArray) -> str:
    """In words, where points (H, W, 3) m lie in plan."""
    (west, south), (east, north) = (each(points[..., :2], axis=(0, 1)) for each in (np.min, np.max))
    return f"x from {west:g} to {east:g} m, y from {south:g} to {north:g} m"


def heights_at(engine: Engine, facets: Facets, x: FloatArray, y: FloatArray) -> FloatArray:
    """Height (N,) m of the ground at places (N,) m; NaN where there is none."""
    top = float(facets.high[2]) + ABOVE_EVERYTHING
    below = engine.ground_below(np.column_stack([x, y, np.full(len(x), top)]))
    return np.where(below[:, 1] < 0, np.nan, top - below[:, 0])


def with_muck(bench: FloatArray) -> FloatArray:
    """The grid (H, W, 3) m after the crest of the upper bench has failed and fills the lower one."""
    x, y, z = np.moveaxis(bench, -1, 0)
    edge = EDGE + BENT * np.clip((y - BEND[0]) / (BEND[1] - BEND[0]), 0.0, 1.0)
    heap = TOP - SLOPE * (x - edge) - SLOPE * np.clip(np.abs(y) - HALF_LENGTH, 0.0, None)
    return np.stack([x, y, np.where(x > edge, np.maximum(z, heap), z)], axis=-1)


def patch_message(points: FloatArray, stamp_ns: int) -> object:
    """A PointCloud2 of a grid (H, W, 3) m, map frame, for terrain/update."""
    header = Header(frame_id=MapFrame().name, stamp=stamp_of(stamp_ns))
    return cloud_of_columns(header, {name: points[..., i] for i, name in enumerate("xyz")})
