"""What rebounds of a spinning sphere have in common."""

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import dot, norm, scale


@kernel
def heading(v_t: Vec, rolling: Vec) -> Vec:
    """Unit direction of a rock along the ground: where it goes or, standing, where its spin would roll it.

    v_t : (3,) m/s along the ground; rolling : (3,) the direction of w x n. Zero where both are.
    """
    there = v_t if dot(v_t, v_t) > 0.0 else rolling
    speed = norm(there)
    return scale(1.0 / speed, there) if speed > 0.0 else ZERO
