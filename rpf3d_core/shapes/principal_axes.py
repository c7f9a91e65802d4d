"""Compute principal moments and axes of a body, by rotations in a fixed order.

Source: Jacobi 1846, J. reine angew. Math. 30:51.
"""

import math
from collections.abc import Sequence

Row = tuple[float, ...]

ROUNDING = 1e-12
"""Share of the trace of an inertia tensor below which products of inertia, and differences of moments, count as 0."""

CONVERGED = 1e-17
"""Share of the trace at which a product of inertia needs no further rotation."""

MOST_SWEEPS = 30
"""Largest number of sweeps over the three products of inertia; convergence is quadratic, so about 6 are enough."""

SIDES = ((0, 1, 2), (0, 2, 1), (1, 2, 0))
"""Row and column (p, q) of each of the three products of inertia, and the remaining index r."""


def principal_axes(tensor: Sequence[Sequence[float]]) -> tuple[Row, tuple[Row, ...]]:
    """Return the principal moments (3,) of an inertia tensor, ascending, and their axes (3, 3), right-handed.

    The axes are unit vectors, one for each moment. If the tensor is diagonal to rounding, the axes are those of the
    input, in the order of the moments; the third axis may be reversed. Moments that are equal to rounding are made
    equal, and their axes keep the order of the input.

    tensor : (3, 3), symmetric
    """
    trace = tensor[0][0] + tensor[1][1] + tensor[2][2]
    a = [
        [0.0 if i != j and abs(tensor[i][j]) <= ROUNDING * trace else tensor[i][j] for j in range(3)] for i in range(3)
    ]
    axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for _ in range(MOST_SWEEPS):
        for p, q, r in SIDES:
            if abs(a[p][q]) > CONVERGED * trace:
                _rotate(a, axes, p, q, r)
    return _ascending([a[0][0], a[1][1], a[2][2]], axes, ROUNDING * trace)


def _rotate(a: list[list[float]], axes: list[list[float]], p: int, q: int, r: int) -> None:
    """Rotate the axes p and q of a symmetric tensor `a`, in place, so that its component (p, q) becomes 0.

    The smaller of the two possible angles is taken (Golub & Van Loan 2013, section 8.5.2).

    a : (3, 3); axes : (3, 3) unit vectors, one in each row, turned in the same way
    p, q, r : 0, 1 and 2 in any order; r is the axis that does not move
    """
    ratio = 0.5 * (a[q][q] - a[p][p]) / a[p][q]
    t = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
    c = 1.0 / math.sqrt(t * t + 1.0)
    s = t * c
    a[p][p], a[q][q] = a[p][p] - t * a[p][q], a[q][q] + t * a[p][q]
    a[p][q] = a[q][p] = 0.0
    first, second = a[p][r], a[q][r]
    a[p][r] = a[r][p] = c * first - s * second
    a[q][r] = a[r][q] = s * first + c * second
    for k in range(3):
        first, second = axes[p][k], axes[q][k]
        axes[p][k], axes[q][k] = c * first - s * second, s * first + c * second


def _ascending(moments: list[float], axes: list[list[float]], equal: float) -> tuple[Row, tuple[Row, ...]]:
    """Return moments and axes in ascending order of the moments; moments that differ by at most `equal` become equal.

    The axes are right-handed: if the order changes their handedness, the third axis is reversed.
    """
    right_handed = True
    for k in (0, 1, 0):
        if moments[k] > moments[k + 1] + equal:
            moments[k], moments[k + 1] = moments[k + 1], moments[k]
            axes[k], axes[k + 1] = axes[k + 1], axes[k]
            right_handed = not right_handed
    for k in (0, 1):
        if moments[k + 1] - moments[k] <= equal:
            moments[k + 1] = moments[k]
    if not right_handed:
        axes[2] = [-component for component in axes[2]]
    return tuple(moments), tuple(tuple(axis) for axis in axes)
