"""Find the facet closest to a point with VTK's own search, as in the thesis (section 3.4)."""

from typing import Any

from vtkmodules.vtkCommonCore import reference
from vtkmodules.vtkCommonDataModel import vtkGenericCell

from rpf3d_core.detection.closest import Closest, closest_facet
from rpf3d_core.detection.vtk_locator import VtkLocator
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec


@closest_facet.rule(VtkLocator)
def closest_by_vtk(locator: VtkLocator, facets: Facets, x: Vec, radius: float) -> Closest:
    """Return the facet closest to x (m) by VTK's search; facet -1 if there is no facet within the radius (m)."""
    facet: Any = reference(-1)
    squared: Any = reference(0.0)
    search: Any = locator.locator.FindClosestPointWithinRadius
    found = search(x, radius, [0.0, 0.0, 0.0], vtkGenericCell(), facet, reference(0), squared)
    return Closest(float(squared) ** 0.5, int(facet)) if found else Closest(radius, -1)
