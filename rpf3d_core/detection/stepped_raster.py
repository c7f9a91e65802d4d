"""Find contacts on a raster of heights in fixed time steps, as most fast programs do: only for comparison.

The contact is at the first step at which the rock is below the ground of its cell; the place where the rock passed
through the ground is not computed. A raster has no vertical faces and no overhangs. As with `stepped`, only the search
for contacts differs from the exact method.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, position, velocity
from rpf3d_core.detection.contact import NO_CONTACT, Contact, PreviousContact, first_contact
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import dot, subtract


class SteppedRaster(NamedTuple):
    """The fixed-step method on a raster, that is, on a terrain that consists of squares of two facets each.

    x, y : m, south-west corner of the first square; cell : m, side of a square
    nx, ny : number of squares eastwards and northwards
    facet : (nx ny,) first facet of each square, south-east of its diagonal, -1 for a hole; the second facet of the
        square has the next number; the squares are in rows from the south, each row from the west
    dt : time step, s
    """

    x: float
    y: float
    cell: float
    nx: int
    ny: int
    facet: Any
    dt: float


@first_contact.rule(SteppedRaster)
def first_contact_below_cells(
    method: SteppedRaster, facets: Facets, arc: Arc, left: PreviousContact, end: float
) -> Contact:
    """Return the contact at the first step where the rock is below the facet of its cell and moves into the facet.

    method : the raster and the time step; end : s, later steps are not tested; left : not used
    """
    step = 1.0
    while step * method.dt < end:
        t = step * method.dt
        x = position(arc, t)
        f = facet_over(method, x[0], x[1])
        step += 1.0
        if f >= 0 and _below(facets, f, x):
            approach = -dot(stored_normal(facets, f), velocity(arc, t))
            if approach > 0.0:
                return Contact(t=t, facet=f, side=1.0, approach=approach)
    return NO_CONTACT


@kernel
def facet_over(method: SteppedRaster, x: float, y: float) -> int:
    """Return the facet of the raster at the point x, y (m) in plan; -1 outside the raster or in a hole."""
    u, v = (x - method.x) / method.cell, (y - method.y) / method.cell
    if not (0.0 <= u < method.nx and 0.0 <= v < method.ny):
        return -1
    i, j = math.floor(u), math.floor(v)
    first: int = method.facet[j * method.nx + i]
    return first + (0 if u - i >= v - j else 1) if first >= 0 else -1


@kernel
def _below(facets: Facets, f: int, x: Vec) -> bool:
    """Return True if point x (m) is below the plane of facet f."""
    return dot(stored_normal(facets, f), subtract(x, corner(facets, f, 0))) < 0.0
