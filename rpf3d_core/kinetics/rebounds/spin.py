"""The direction of a spinning sphere after an impact, which several rebound models need."""

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import dot, norm, scale


@kernel
def heading(v_t: Vec, rolling: Vec) -> Vec:
    """Return the unit direction (3,) along the ground in which a spinning rock leaves an impact.

    The result is the direction of v_t; if v_t is zero, the direction of `rolling`; if both are zero, zero.

    v_t : (3,) m/s, velocity along the ground before the impact
    rolling : (3,) vector along w x n, the direction in which the spin rolls the rock
    """
    there = v_t if dot(v_t, v_t) > 0.0 else rolling
    speed = norm(there)
    return scale(1.0 / speed, there) if speed > 0.0 else ZERO
