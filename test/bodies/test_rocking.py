"""Tests of Housner's rocking block: the spin after its first impact on the other edge."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import Terms, about, drop, flown_over, ground, product
from flights.scenes_of_facets import grid_triangles, terrain_of

from rpf3d_core.shapes.families import box

H = 5.0
"""Half height (m) of the block."""
ACCURACIES = (4e-3, 2e-3, 1e-3, 0.5e-3)
UPRIGHT = about((0.0, 1.0, 0.0), -0.5 * math.pi)
"""Orientation in which the longest side of a box, its first axis, is upright."""


def share_of_spin(slenderness: float, accuracy: float) -> float:
    """Return the spin after the first impact over the spin before it, of a block that is released on one edge."""
    b = slenderness * H
    lengths = (2.0 * H, 2.0 * b * 1.1, 2.0 * b)  # the width is the shortest side, the third axis
    block = box(lengths)
    tilt = 0.9 * math.atan(slenderness)
    q = product(about((0.0, 1.0, 0.0), tilt), UPRIGHT)
    x = math.cos(tilt) * np.array([0.0, 0.0, H]) + math.sin(tilt) * np.array([H, 0.0, 0.0])
    x += np.array([0.0, 0.0, b * math.sin(tilt) + 1.6 * accuracy])
    corners = [(u, v, 0.0) for u in (-30.0, 30.3) for v in (-30.0, 30.1)]
    plane = terrain_of(corners, grid_triangles(2, 2))
    end = flown_over(plane, [block], drop([block], x, q), Terms((ground(10.0),), accuracy, 20_000, 10.0))
    blows = end.blows()
    fast = blows[:, 0] > 0.1  # at first, the edge below the release falls a few millimetres
    return float(blows[fast][0, 10] / blows[fast][0, 9])


@pytest.mark.parametrize("slenderness", [0.2, 0.4])
def test_the_spin_after_the_first_impact_is_that_of_housner(slenderness):
    """The first impact contains no time step, so its error does not depend on the accuracy."""
    exact = 1.0 - 1.5 * math.sin(math.atan(slenderness)) ** 2
    errors = np.array([abs(share_of_spin(slenderness, accuracy) - exact) for accuracy in ACCURACIES])
    assert (errors < 1e-5).all(), errors
