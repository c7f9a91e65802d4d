"""Build the effect drag layer of a scene (a forest that slows rocks), with its outlines in the local frame."""

from pathlib import Path

import numpy as np

from rpf3d_core.effects.drag_layer import DragLayer
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.air import DragLayerSpec
from rpf3d_core.setup.areas import outlines_on
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray


def drag_layer(spec: DragLayerSpec, scene: Scene, terrain: Terrain) -> DragLayer:
    """Return the parameters of the drag layer in the form that the flight loops read.

    Raises
    ------
    InputError
        The polygons are damaged, or lie off the terrain.
    """
    edges = _edges_of(spec, scene, terrain) if spec.polygons else np.empty((0, 4))
    return DragLayer(
        coefficient=spec.coefficient, height=spec.height, accuracy=spec.accuracy, gravity=scene.gravity, edges=edges
    )


def _edges_of(spec: DragLayerSpec, scene: Scene, terrain: Terrain) -> FloatArray:
    """Return the edges (E, 4) m of the layer's outlines in plan, local frame: x and y of the start, then of the end.

    Overlapping polygons are united. Errors are as in `drag_layer`.
    """
    polygons: Path = spec.polygons  # type: ignore[assignment]  # the caller has checked that there are some
    rings = outlines_on(terrain, polygons, f"{scene.path}: `effects.drag_layer.polygons`")
    return np.concatenate([np.concatenate([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])
