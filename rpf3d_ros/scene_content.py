"""A scene file as what the survey and the radar would send, in the map frame."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rpf3d_core.errors import SceneError
from rpf3d_core.io.scene import read_scene
from rpf3d_core.io.terrain import read_terrain
from rpf3d_core.run import build_engine, scene_releases
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.map_frame import FARTHEST, MapFrame
from rpf3d_ros.terrain_messages import MeshSurvey

ROUND_ORIGIN = 1000.0
"""Step (m) of the map_origin that is suggested: short to type, close enough."""


@dataclass(frozen=True, eq=False)
class SceneContent:
    """mesh : map frame; positions : (R, 3) m, map frame; velocities : (R, 3) m/s, z up."""

    mesh: MeshSurvey
    positions: FloatArray
    velocities: FloatArray

    @property
    def speeds(self) -> tuple[float, float]:
        """Least and greatest speed of release (m/s)."""
        speed = np.linalg.norm(self.velocities, axis=1)
        return float(speed.min()), float(speed.max())


def scene_content(path: Path, frame: MapFrame) -> SceneContent:
    """Read a scene, its terrain and its releases.

    Raises InputError where the scene is refused, or lies too far from the map's origin for float32 messages.
    """
    scene = read_scene(path)
    terrain, _ = read_terrain(scene)
    releases = scene_releases(scene, terrain, build_engine(scene, terrain))
    shift = np.array(terrain.frame.origin) - np.array(frame.origin)
    vertices = terrain.vertices + shift
    if float(np.abs(vertices).max()) > FARTHEST:
        near = (ROUND_ORIGIN * np.round((vertices.mean(axis=0) + frame.origin) / ROUND_ORIGIN)).tolist()
        raise SceneError(f"{path}: the terrain lies beyond {FARTHEST:.0e} m from map_origin; set map_origin to {near}")
    return SceneContent(MeshSurvey(vertices, terrain.triangles), releases.x + shift, releases.v)
