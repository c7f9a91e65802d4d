"""Convert a scene file to the data that a survey and a radar would send, in the map frame."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rpf3d_core.ensemble.releases import ranges_of
from rpf3d_core.errors import SceneError
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import check_releases, prepare, releases_in_ranges
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.map_frame import FARTHEST, MapFrame
from rpf3d_ros.messages.terrain_messages import MeshSurvey

ROUND_ORIGIN = 1000.0
"""Step (m) to which a suggested map_origin is rounded: short to type, and close enough to the terrain."""


@dataclass(frozen=True, eq=False)
class SceneContent:
    """The terrain and the releases of a scene, as a survey and a radar would report them.

    mesh : the terrain, map frame
    positions : (R, 3) m, map frame; velocities : (R, 3) m/s, z up
    """

    mesh: MeshSurvey
    positions: FloatArray
    velocities: FloatArray

    @property
    def speeds(self) -> tuple[float, float]:
        """The least and the greatest release speed (m/s)."""
        speed = np.linalg.norm(self.velocities, axis=1)
        return float(speed.min()), float(speed.max())


def scene_content(path: Path, frame: MapFrame) -> SceneContent:
    """Read a scene file, and return the scene's terrain and releases in the map frame.

    Raises InputError if the scene is refused, or if its terrain is too far from the map's origin for float32 messages.
    """
    prepared = prepare(read_scene(path))
    terrain = prepared.terrain
    releases = releases_in_ranges(prepared, ranges_of([source.rocks for source in prepared.sources]))
    check_releases(prepared, releases)
    shift = np.array(terrain.frame.origin) - np.array(frame.origin)
    vertices = terrain.vertices + shift
    if float(np.abs(vertices).max()) > FARTHEST:
        near = (ROUND_ORIGIN * np.round((vertices.mean(axis=0) + frame.origin) / ROUND_ORIGIN)).tolist()
        raise SceneError(f"{path}: the terrain lies beyond {FARTHEST:.0e} m from map_origin; set map_origin to {near}")
    return SceneContent(
        mesh=MeshSurvey(vertices, terrain.triangles), positions=releases.x + shift, velocities=releases.v
    )
