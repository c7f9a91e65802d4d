"""Families of blocks: boxes, ideal bodies that are equant, flat or long, and the norm blocks of rockfall tests."""

import math
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.shapes.directions import fibonacci_sphere
from rpf3d_core.shapes.polyhedron import Polyhedron, polyhedron_of, scaled_to_volume
from rpf3d_core.terrain.frame import FloatArray

CORNERS = 24
"""Number of corners of the ideal bodies, as many as a norm block has."""

CUT = 0.25
"""Share (-) of each length of a norm block that is cut off at each of the two ends."""


def box(lengths: Sequence[float]) -> Polyhedron:
    """Return a box with three lengths (m).

    Raises
    ------
    InputError
        The lengths are not three positive, finite numbers, the shortest is at most 1e-5 of the longest, or the box is
        too small or too large for `polyhedron_of`.
    """
    if len(lengths) != 3 or not all(0.0 < length < math.inf for length in lengths):
        raise InputError(f"the lengths of a box are {list(lengths)}; they must be three positive numbers, in metres")
    name = " x ".join(f"{length:g}" for length in lengths)
    return polyhedron_of(0.5 * _signs() * np.array(lengths, dtype=np.float64), f"box {name}")


def family(name: str) -> Polyhedron:
    """Return the block of a family, with a volume of 1 m3.

    name : `equant`, `plate`, `column`, `eota111` or `eota221`

    `equant`, `plate`, `column` : ideal bodies of 24 corners and 44 faces, inside boxes of 1:1:1, 1:1:0.4 and 1:1:2.2.
    Their corners are 24 points of a Fibonacci sphere, d, pushed out to |x|^3 + |y|^3 + |z|^3 = 1, that is
    d / (|dx|^3 + |dy|^3 + |dz|^3)^(1/3), then stretched so that they fill the box. The points of a Fibonacci sphere
    follow no symmetry: no two faces are parallel within 0.25 degrees.

    `eota111`, `eota221` : norm blocks (standard blocks for tests of nets) of ETAG 027 and EAD 340059, with 24 corners
    and 26 faces: boxes of a : a : a and a : a : a/2 whose edges and corners are cut off. At both ends of each edge, a
    quarter of its length is cut off. The block then has 17/24 of the volume of its box, and 1 m3 needs lengths of
    1.1218 m, or 1.4134 and 0.7067 m. This cut follows from the published lengths for 1 m3, 1.122 m, and 1.4136 and
    0.7068 m: their boxes have 1.4125 and 1.4124 m3, so the block has a share of 0.7080 of the box in both cases, and
    17/24 is 0.7083. If only the corners of a box were cut off (a truncated cube, also with 24 corners), the share would
    be at least 5/6.

    Raises
    ------
    InputError
        The family does not exist.
    """
    if name not in FAMILIES:
        raise InputError(f"the family of shapes {name!r} does not exist; known families are {', '.join(FAMILIES)}")
    make, lengths = FAMILIES[name]
    return scaled_to_volume(polyhedron_of(make() * np.array(lengths), name), 1.0)


def ball(corners: int) -> Polyhedron:
    """Return a polyhedron of 1 m3 that is nearly a ball: the hull of `corners` points of a Fibonacci sphere."""
    return scaled_to_volume(polyhedron_of(fibonacci_sphere(corners), "ball"), 1.0)


def _signs() -> FloatArray:
    """Return the corners (8, 3) of a cube with half length 1."""
    return np.array(list(product((-1.0, 1.0), repeat=3)))


def _ideal() -> FloatArray:
    """Return the corners (24, 3) of an ideal body, between a ball and a cube, which fill the box from -1 to 1."""
    points = fibonacci_sphere(CORNERS)
    points = points / np.cbrt(np.abs(points * points * points).sum(axis=1))[:, None]
    low, high = points.min(axis=0), points.max(axis=0)
    filled: FloatArray = (2.0 * points - (high + low)) / (high - low)
    return filled


def _cut_cube() -> FloatArray:
    """Return the corners (24, 3) of a cube with half length 1 whose edges and corners are cut off."""
    inner = 1.0 - 2.0 * CUT
    places = [np.where(np.arange(3) == axis, 1.0, inner) for axis in range(3)]
    return np.concatenate([_signs() * place for place in places])


FAMILIES: dict[str, tuple[Callable[[], FloatArray], tuple[float, float, float]]] = {
    "equant": (_ideal, (1.0, 1.0, 1.0)),
    "plate": (_ideal, (1.0, 1.0, 0.4)),
    "column": (_ideal, (1.0, 1.0, 2.2)),
    "eota111": (_cut_cube, (1.0, 1.0, 1.0)),
    "eota221": (_cut_cube, (1.0, 1.0, 0.5)),
}
"""The corners of each family within a box from -1 to 1, and the proportions of the box."""
