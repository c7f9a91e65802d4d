"""Build the contact model of rocks with a shape from a scene."""

import math

import numpy as np

from rpf3d_core.kinetics.rigid_body import RigidBody
from rpf3d_core.kinetics.slippage import SlipFriction
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.shapes import RigidSpec
from rpf3d_core.scene.zone_materials import material_of
from rpf3d_core.setup.shapes import table_of
from rpf3d_core.terrain.facets import Terrain


def rigid_body_of(spec: RigidSpec, scene: Scene, terrain: Terrain) -> RigidBody:
    """Return the contact model of rocks with a shape: the shapes, accuracy (m) and slip friction of the scene."""
    return RigidBody(shapes=table_of(scene), accuracy=spec.accuracy, slip=slip_friction_of(scene, terrain))


def slip_friction_of(scene: Scene, terrain: Terrain) -> SlipFriction | None:
    """Return the slip friction of each zone, NaN in zones without slip friction; None if no zone has slip friction."""
    found = [material_of(scene, zone).slip_friction for zone in terrain.zones]
    if not any(found):
        return None
    rows = [(math.nan,) * 4 if slip is None else (slip.mu_min, slip.mu_max, slip.kappa, slip.beta) for slip in found]
    mu_min, mu_max, kappa, beta = (np.array(column) for column in zip(*rows, strict=True))
    return SlipFriction(mu_min=mu_min, mu_max=mu_max, kappa=kappa, beta=beta)
