"""Compute the release velocities of thrown rocks, as from a blast: speed, and direction within a cone."""

import math
from typing import NamedTuple

import numpy as np

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.materials.distributions import FEW, Distribution
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec


class Throw(NamedTuple):
    """Speed and direction of the rocks that a source throws.

    speed : distribution (m/s); azimuth : radians clockwise from +y of the local frame (north)
    elevation : radians above the horizontal
    spread : radians, half the opening angle of the cone of directions, which are spread evenly by solid angle
    """

    speed: Distribution
    azimuth: float
    elevation: float
    spread: float


def axes_of(throw: Throw) -> tuple[Vec, Vec, Vec]:
    """Return the axes of a throw's cone of directions, unit vectors: ahead, horizontally right, and normal to both."""
    sa, ca = math.sin(throw.azimuth), math.cos(throw.azimuth)
    se, ce = math.sin(throw.elevation), math.cos(throw.elevation)
    return (sa * ce, ca * ce, se), (ca, -sa, 0.0), (-sa * se, -ca * se, ce)


def thrown(throw: Throw, speed: FloatArray, tilt: FloatArray, turn: FloatArray) -> FloatArray:
    """Return the release velocities (R, 3) m/s of thrown rocks with speeds (R,) m/s.

    tilt, turn : (R,) uniform numbers in [0, 1) that select the direction in the cone; used only with a spread
    """
    v: FloatArray = speed[:, None] * np.array(axes_of(throw)[0])
    if throw.spread > 0.0:
        closeness = 1.0 - math.cos(throw.spread)
        if len(speed) <= FEW:
            arguments = (speed.tolist(), tilt.tolist(), turn.tolist())
            _throw_all.py_func(axes_of(throw), closeness, *arguments, v)  # type: ignore[attr-defined]
        else:
            _throw_all(axes_of(throw), closeness, speed, tilt, turn, v)
    return v


@loop
def _throw_all(
    axes: tuple[Vec, Vec, Vec], closeness: float, speed: FloatArray, tilt: FloatArray, turn: FloatArray, v: FloatArray
) -> None:
    """Write the velocities v (R, 3) m/s of thrown rocks, with directions spread evenly over the cone.

    Equal steps along the axis of a sphere cut off equal areas of its surface (Archimedes), so the cosine is uniform.
    axes : as from `axes_of`; speed, tilt, turn : as in `thrown`
    closeness : 1 minus the cosine of half the opening angle of the cone (-)
    """
    ahead, right, up = axes
    for i in range(len(v)):
        lost = tilt[i] * closeness
        off = math.sqrt(lost * (2.0 - lost))
        across, along = off * math.cos(2.0 * math.pi * turn[i]), off * math.sin(2.0 * math.pi * turn[i])
        for k in range(3):
            v[i, k] = speed[i] * ((1.0 - lost) * ahead[k] + across * right[k] + along * up[k])
