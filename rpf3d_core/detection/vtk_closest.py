"""The facet closest to a point as the thesis asks for it: by VTK's own search (section 3.4)."""

from typing import Any

from vtkmodules.vtkCommonCore import reference
from vtkmodules.vtkCommonDataModel import vtkGenericCell

from rpf3d_core.detection.closest import Closest, closest_facet
from rpf3d_core.detection.vtk_locator import VtkLocator
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec


@closest_facet.rule(VtkLocator)
def closest_by_vtk(locator: VtkLocator, facets: Facets, x: Vec, radius: float) -> Closest:
    """`FindClosestPointWithinRadius` of VTK's static cell locator; it says nothing beyond the radius (m)."""
    facet: Any = reference(-1)
    squared: Any = reference(0.0)
    search: Any = locator.locator.FindClosestPointWithinRadius
    found = search(x, radius, [0.0, 0.0, 0.0], vtkGenericCell(), facet, reference(0), squared)
    return Closest(float(squared) ** 0.5, int(facet)) if found else Closest(radius, -1)
