"""Functions that the rebounds of a spinning sphere share."""

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import dot, norm, scale


@kernel
def heading(v_t: Vec, rolling: Vec) -> Vec:
    """Return the unit direction of a rock along the ground: of its motion or, without motion, of its spin's rolling.

    v_t : (3,) m/s along the ground; rolling : (3,) the direction of w x n. Zero if both are zero.
    """
    there = v_t if dot(v_t, v_t) > 0.0 else rolling
    speed = norm(there)
    return scale(1.0 / speed, there) if speed > 0.0 else ZERO
