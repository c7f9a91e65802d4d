"""Areas of interest: polygons in plan."""

import numpy as np
import shapely
from shapely.geometry import MultiPolygon

from rpf3d_core.io.polygons import read_polygons
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.terrain.frame import FloatArray, Frame

REACHED_BY = (
    "a rock reached an area if its path crosses it in plan, at whatever height: exact in flight, and along chords of "
    "slides that bend"
)


def read_areas(scene: Scene) -> dict[str, MultiPolygon]:
    """The areas of interest by name, in the input's plan coordinates; `InputError` as `read_polygons`.

    Polygons of one area that overlap are one: the overlap is not outside.
    """
    return {area.name: _united(read_polygons(area.polygons)) for area in scene.areas_of_interest}


def _united(polygons: MultiPolygon) -> MultiPolygon:
    union = shapely.union_all(list(polygons.geoms))
    return union if isinstance(union, MultiPolygon) else MultiPolygon([union])


def local_outlines(frame: Frame, polygons: MultiPolygon) -> list[FloatArray]:
    """Outer and inner rings (N, 2) m in plan, local frame."""
    rings = [ring for polygon in polygons.geoms for ring in (polygon.exterior, *polygon.interiors)]
    return [_local_plan(frame, np.asarray(ring.coords)[:, :2]) for ring in rings]


def _local_plan(frame: Frame, plan: FloatArray) -> FloatArray:
    level = np.zeros(len(plan))
    columns = (plan[:, 0], plan[:, 1], level) if frame.up == "z" else (plan[:, 0], level, plan[:, 1])
    return frame.points_to_local(np.stack(columns, axis=1))[:, :2]
