"""Builds fragmentation for a scene: converts angles to radians, and the energy loss to a factor of speed."""

import math

from rpf3d_core.effects.fragmentation import Fragmentation
from rpf3d_core.scene.fragmentation import FragmentationSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.terrain.facets import Terrain


def fragmentation(offer: FragmentationSpec, scene: Scene, terrain: Terrain) -> Fragmentation:
    """Return the parameters of fragmentation for the kernels."""
    return Fragmentation(
        offer.surface_factor, offer.surface_exponent, offer.least_ratio, offer.spread, offer.least_volume,
        math.sqrt(1.0 - offer.energy_lost), math.radians(0.5 * offer.cone_deg), math.radians(offer.least_angle_deg),
        offer.generations,
    )  # fmt: skip
