"""Tests of the table of shapes for compiled code: its layout, its scale, and values computed by a compiled loop."""

import math
from typing import Any

import numpy as np
import pytest
from bodies.solid_checks import integrals

from rpf3d_core.errors import InputError
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.shapes.families import box, family
from rpf3d_core.shapes.table import ShapeTable, shape_table

BODIES = [box((1.0, 2.0, 3.0)), family("eota221"), family("column")]
TABLE = shape_table(BODIES, [1.0, 2.0, 5.0])
SPHERE = 4.0 / 3.0 * math.pi


@loop
def read_back(table: ShapeTable, volumes: Any, gaps: Any) -> None:
    """Write each shape's volume (K,), from pyramids over faces, and the largest height (K,) of a corner over a face."""
    for k in range(len(table.radius)):
        volumes[k], gaps[k] = 0.0, -1.0
        for face in range(table.face_first[k], table.face_first[k + 1]):
            n = table.normals[face]
            entry, size = table.faces[face, 0], table.faces[face, 1]
            first = table.corners[table.first[k] + table.ring[entry]]
            height = first[0] * n[0] + first[1] * n[1] + first[2] * n[2]
            for i in range(1, size - 1):
                a = table.corners[table.first[k] + table.ring[entry + i]]
                b = table.corners[table.first[k] + table.ring[entry + i + 1]]
                ux, uy, uz = a[0] - first[0], a[1] - first[1], a[2] - first[2]
                vx, vy, vz = b[0] - first[0], b[1] - first[1], b[2] - first[2]
                double = n[0] * (uy * vz - uz * vy) + n[1] * (uz * vx - ux * vz) + n[2] * (ux * vy - uy * vx)
                volumes[k] += height * double / 6.0
            for corner in range(table.first[k], table.first[k + 1]):
                c = table.corners[corner]
                gaps[k] = max(gaps[k], c[0] * n[0] + c[1] * n[1] + c[2] * n[2] - height)


def test_compiled_code_reads_closed_solids_of_the_volume_of_the_unit_sphere_from_the_table():
    compiled, plain = np.zeros((2, 3)), np.zeros((2, 3))
    read_back(TABLE, *compiled)
    read_back.py_func(TABLE, *plain)
    assert np.array_equal(compiled, plain)
    assert compiled[0] == pytest.approx(3 * [SPHERE], rel=1e-12)
    assert np.abs(compiled[1]).max() < 1e-14


def test_every_array_is_contiguous_and_of_64_bits():
    whole = {"first", "face_first", "faces", "ring"}
    for name, array in TABLE._asdict().items():
        assert array.dtype == (np.int64 if name in whole else np.float64), name
        assert array.flags.c_contiguous, name


def test_the_shapes_follow_each_other_in_the_arrays():
    assert TABLE.first.tolist() == [0, 8, 32, 56]
    assert TABLE.face_first.tolist() == [0, 6, 32, 76]
    assert TABLE.faces[:, 1].tolist() == [len(face) for body in BODIES for face in body.faces]
    for k, body in enumerate(BODIES):
        rows = TABLE.faces[TABLE.face_first[k] : TABLE.face_first[k + 1]]
        assert tuple(tuple(TABLE.ring[begin : begin + size].tolist()) for begin, size in rows) == body.faces
        assert np.array_equal(TABLE.normals[TABLE.face_first[k] : TABLE.face_first[k + 1]], body.normals)
    assert TABLE.faces[-1].sum() == len(TABLE.ring)


def test_every_shape_has_the_volume_of_a_sphere_with_radius_1():
    assert np.array_equal(TABLE.radius, np.ones(3))
    for k in range(3):
        volume, _, inertia = integrals(TABLE.corners[TABLE.first[k] : TABLE.first[k + 1]])
        assert volume == pytest.approx(SPHERE, rel=1e-12)
        assert TABLE.moments[k] == pytest.approx(np.diag(inertia), rel=1e-12)


def test_the_reach_is_the_distance_of_the_farthest_corner_half_the_diagonal_of_a_box():
    scale = (SPHERE / 6.0) ** (1 / 3)
    assert TABLE.reach[0] == pytest.approx(scale * math.sqrt(1 + 4 + 9) / 2, rel=1e-14)
    for k in range(3):
        corners = TABLE.corners[TABLE.first[k] : TABLE.first[k + 1]]
        assert TABLE.reach[k] == pytest.approx(np.linalg.norm(corners, axis=1).max(), rel=1e-15)


def test_the_size_of_the_bodies_does_not_matter():
    one = shape_table([box((1.0, 2.0, 3.0))], [1.0])
    other = shape_table([box((0.2, 0.4, 0.6))], [7.0])
    for mine, theirs in zip(one, other, strict=True):
        assert mine == pytest.approx(theirs, rel=1e-14)


@pytest.mark.parametrize(
    ("weights", "shares"),
    [
        ([1, 2, 5], [0.125, 0.375, 1.0]),
        ([0, 1, 1], [0.0, 0.5, 1.0]),
        ([0.1, 0.2, 0], [1 / 3, 1.0, 1.0]),
        ([0.1, 0.7, 0.1], [1 / 9, 8 / 9, 1.0]),
    ],
)
def test_shares_are_cumulative_and_end_at_exactly_1(weights, shares):
    table = shape_table(BODIES, weights)
    assert table.shares == pytest.approx(shares, rel=1e-15)
    assert table.shares[-1] == 1.0
    assert (table.shares[1] == 1.0) == (weights[2] == 0), "a shape without weight is never drawn"


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([1, 2], "3 shapes and 2 weights"),
        ([1, -1, 1], r"number 1 \(from 0\) is -1"),
        ([1, 1, math.nan], r"number 2 \(from 0\) is nan"),
        ([1, math.inf, 1], "is inf"),
        ([0, 0, 0], "at least one weight"),
    ],
)
def test_weights_that_cannot_be_drawn_by_are_refused(weights, message):
    with pytest.raises(InputError, match=message):
        shape_table(BODIES, weights)


def test_a_table_without_shapes_is_refused():
    with pytest.raises(InputError, match="0 shapes and 0 weights"):
        shape_table([], [])
