"""The forest's drag layer from a scene: where it stands, in the terrain's local frame."""

import numpy as np
import shapely

from rpf3d_core.effects.drag_layer import DragLayer
from rpf3d_core.errors import InputError
from rpf3d_core.io.areas import local_outlines
from rpf3d_core.io.coverage import extents, lies_off
from rpf3d_core.io.polygons import read_polygons
from rpf3d_core.io.scene_effects_air import DragLayerSpec
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray


def drag_layer(offer: DragLayerSpec, scene: Scene, terrain: Terrain) -> DragLayer:
    """The effect as the kernels take it.

    Raises
    ------
    InputError
        The polygons are damaged, or lie off the terrain.
    """
    edges = _edges_of(offer, scene, terrain) if offer.polygons else np.empty((0, 4))
    return DragLayer(offer.coefficient, offer.height, offer.accuracy, scene.gravity, edges)


def _edges_of(offer: DragLayerSpec, scene: Scene, terrain: Terrain) -> FloatArray:
    """Edges (E, 4) m of the outlines of a forest; polygons that overlap are one."""
    polygons = read_polygons(offer.polygons)  # type: ignore[arg-type]  # there is one
    union = shapely.union_all(list(polygons.geoms))
    forest = union if isinstance(union, shapely.MultiPolygon) else shapely.MultiPolygon([union])
    if lies_off(terrain, forest):
        where = extents(terrain, shapely.get_coordinates(forest))
        raise InputError(f"{scene.path}: `effects.drag_layer.polygons` lie off the terrain: {where}")
    rings = local_outlines(terrain.frame, forest)
    return np.concatenate([np.concatenate([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])
