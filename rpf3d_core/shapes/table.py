"""The shapes of an ensemble in flat arrays, which compiled code reads."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.shapes.polyhedron import Polyhedron, scaled_to_volume

UNIT_SPHERE_VOLUME = 4.0 / 3.0 * math.pi
"""Volume of every shape in a table (m3): that of a sphere with radius 1 m."""


class ShapeTable(NamedTuple):
    """Several polyhedra in flat arrays: K shapes, all of the volume of a sphere with radius 1 m.

    So the size of a rock is one factor, the radius of the sphere of equal volume. The corners of shape k are first[k]
    to first[k + 1] - 1, its faces face_first[k] to face_first[k + 1] - 1. All arrays are contiguous, float64 or int64.

    corners : (sum C, 3) m, with C the number of corners of a shape, and F below the number of its faces
    first : (K + 1,) first corner of each shape
    face_first : (K + 1,) first face of each shape
    faces : (sum F, 2) first entry in `ring` and number of corners of each face
    ring : (R,) corners of the faces, anticlockwise from outside, as numbers within the shape
    normals : (sum F, 3) outward unit normals
    moments : (K, 3) principal moments per unit of mass, ascending, m2
    reach : (K,) largest distance of a corner from the centre of mass, m
    radius : (K,) radius of the sphere of equal volume, m: exactly 1
    shares : (K,) sum of the weights up to each shape as a share of all weights; the last is exactly 1
    """

    corners: Any
    first: Any
    face_first: Any
    faces: Any
    ring: Any
    normals: Any
    moments: Any
    reach: Any
    radius: Any
    shares: Any


def shape_table(polyhedra: Sequence[Polyhedron], weights: Sequence[float]) -> ShapeTable:
    """Return a table of polyhedra, which are scaled to the volume of a sphere with radius 1 m.

    weights : K numbers >= 0, not all 0: how often each shape is drawn, relative to the others

    Raises
    ------
    InputError
        There is no shape, or the weights are negative, not finite, all 0, or not one for each shape.
    """
    if len(polyhedra) == 0 or len(polyhedra) != len(weights):
        raise InputError(f"there are {len(polyhedra)} shapes and {len(weights)} weights; each shape needs one weight")
    scaled = [scaled_to_volume(polyhedron, UNIT_SPHERE_VOLUME) for polyhedron in polyhedra]
    sizes = np.array([len(face) for shape in scaled for face in shape.faces], dtype=np.int64)
    return ShapeTable(
        corners=np.concatenate([shape.corners for shape in scaled]),
        first=_starts(len(shape.corners) for shape in scaled),
        face_first=_starts(len(shape.faces) for shape in scaled),
        faces=np.stack([_starts(sizes)[:-1], sizes], axis=1),
        ring=np.array([corner for shape in scaled for face in shape.faces for corner in face], dtype=np.int64),
        normals=np.concatenate([shape.normals for shape in scaled]),
        moments=np.stack([shape.moments for shape in scaled]),
        reach=np.array([_reach(shape) for shape in scaled]),
        radius=np.ones(len(scaled)),
        shares=_shares(weights),
    )


def _starts(counts: Iterable[int]) -> NDArray[np.int64]:
    """Return the indices (K + 1,) at which K consecutive parts begin, and the total length as the last index.

    counts : number of elements of each part
    """
    return np.cumsum([0, *counts], dtype=np.int64)


def _reach(polyhedron: Polyhedron) -> float:
    """Return the largest distance (m) of a corner from the centre of mass."""
    x, y, z = polyhedron.corners.T
    return float(np.sqrt(x * x + y * y + z * z).max())


def _shares(weights: Sequence[float]) -> NDArray[np.float64]:
    """Return the cumulative shares (K,) of weights; a shape with weight 0 has the same value as the previous shape."""
    for place, weight in enumerate(weights):
        if not 0.0 <= weight < math.inf:
            raise InputError(f"the weight of shape number {place} (from 0) is {weight}; a weight must be 0 or more")
    total: NDArray[np.float64] = np.cumsum(np.asarray(weights, dtype=np.float64))
    if not 0.0 < total[-1] < math.inf:
        raise InputError(f"the weights of the shapes add up to {total[-1]}; at least one weight must be above 0")
    total /= total[-1]
    return total
