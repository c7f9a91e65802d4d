"""Build the effect fragmentation of a scene: convert angles to radians, and energy loss to a factor of speed."""

import math

from rpf3d_core.effects.fragmentation import Fragmentation
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.fragmentation import FragmentationSpec
from rpf3d_core.terrain.facets import Terrain


def fragmentation(spec: FragmentationSpec, scene: Scene, terrain: Terrain) -> Fragmentation:
    """Return the parameters of fragmentation in the form that the flight loops read."""
    return Fragmentation(
        surface_factor=spec.surface_factor,
        surface_exponent=spec.surface_exponent,
        least_ratio=spec.least_ratio,
        spread=spec.spread,
        least_volume=spec.least_volume,
        speed_kept=math.sqrt(1.0 - spec.energy_lost),
        cone=math.radians(0.5 * spec.cone_deg),
        least_angle=math.radians(spec.least_angle_deg),
        generations=spec.generations,
    )
