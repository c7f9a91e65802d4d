"""Air drag from a scene: it is as accurate as the scene asks for under the scene's gravity."""

from rpf3d_core.effects.drag import Drag
from rpf3d_core.scene.air import DragSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.terrain.facets import Terrain


def drag(offer: DragSpec, scene: Scene, terrain: Terrain) -> Drag:
    """The effect as the kernels take it."""
    return Drag(offer.coefficient, offer.density, offer.accuracy, scene.gravity)
