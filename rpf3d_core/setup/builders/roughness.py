"""Build the effect roughness of a scene, with the law that the scene names."""

import math
from typing import Any

from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.roughness import RoughnessSpec
from rpf3d_core.scene.models.spec import loaded
from rpf3d_core.terrain.facets import Terrain

ROCFALL = "rpf3d_core.effects.roughness:RocfallRoughness"
SPREAD = "rpf3d_core.effects.roughness:SpreadRoughness"


def roughness(spec: RoughnessSpec, scene: Scene, terrain: Terrain) -> Any:
    """Return the law of roughness that a scene names, in the form that the flight loops read.

    An amplitude selects the law of CRSP, `angle_sd_deg` the law of RocFall. `lateral_sd_deg` adds a lateral angle.
    """
    if spec.angle_sd_deg is not None and spec.lateral_sd_deg is not None:
        return loaded(SPREAD)(math.radians(spec.angle_sd_deg), math.radians(spec.lateral_sd_deg))
    if spec.angle_sd_deg is not None:
        return loaded(ROCFALL)(math.radians(spec.angle_sd_deg))
    return spec.physics()(spec.amplitude, spec.deviates)
