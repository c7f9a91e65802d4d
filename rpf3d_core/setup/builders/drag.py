"""Build the effect air drag of a scene."""

from rpf3d_core.effects.drag import Drag
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.air import DragSpec
from rpf3d_core.terrain.facets import Terrain


def drag(spec: DragSpec, scene: Scene, terrain: Terrain) -> Drag:
    """Return the parameters of air drag in the form that the flight loops read."""
    return Drag(coefficient=spec.coefficient, density=spec.density, accuracy=spec.accuracy, gravity=scene.gravity)
