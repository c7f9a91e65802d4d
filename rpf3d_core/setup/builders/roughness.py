"""Builds the law of roughness that a scene names."""

import math
from typing import Any

from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.model_spec import loaded
from rpf3d_core.scene.roughness import RoughnessSpec
from rpf3d_core.terrain.facets import Terrain

ROCFALL = "rpf3d_core.effects.roughness:RocfallRoughness"
SPREAD = "rpf3d_core.effects.roughness:SpreadRoughness"


def roughness(spec: RoughnessSpec, scene: Scene, terrain: Terrain) -> Any:
    """Return CRSP's law for an amplitude, RocFall's law for an angle, or RocFall's law with a lateral part if given."""
    if spec.angle_sd_deg is not None and spec.lateral_sd_deg is not None:
        return loaded(SPREAD)(math.radians(spec.angle_sd_deg), math.radians(spec.lateral_sd_deg))
    if spec.angle_sd_deg is not None:
        return loaded(ROCFALL)(math.radians(spec.angle_sd_deg))
    return spec.physics()(spec.amplitude, spec.deviates)
