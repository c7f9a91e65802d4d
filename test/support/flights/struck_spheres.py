"""Compute a single impact of a rigid sphere."""

import numpy as np

from rpf3d_core.kinetics.coulomb_sphere import CoulombSphere
from rpf3d_core.kinetics.rebound import rebound
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import ZERO, Motion, Rock

UP = (0.0, 0.0, 1.0)
FULL = 1e9
"""Coefficient of friction that prevents all slip at a contact."""


def struck(v, w, e, mu, radius=0.5, e_t=0.0, mu_r=0.0, n=UP):
    """Return the velocity (3,) m/s and the spin (3,) rad/s of a sphere after an impact.

    v, w : before the impact; e, e_t : normal and tangential restitution (-); mu : impact friction (-); radius : m
    mu_r : rolling resistance of the ground (-); n : unit normal of the ground
    """
    model, ground = CoulombSphere(mu, e_t), Surface(e, 0.8, 0.3, 0.5, mu_r)
    rock = RockContext(Rock(1000.0, radius), None, 0)
    after = rebound(model, ground, Motion(0.0, ZERO, tuple(v), tuple(w)), n, rock)
    return np.array(after.v), np.array(after.w)
