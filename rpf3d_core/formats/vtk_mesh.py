"""Convert triangles into VTK's data type, which VTK's filters and locators need."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

from rpf3d_core.terrain.frame import FloatArray


def triangle_mesh(vertices: FloatArray, triangles: NDArray[np.integer]) -> vtkPolyData:
    """Return vertices (V, 3) m and triangles (F, 3) as VTK poly data in double precision, for VTK's filters.

    VTK uses contiguous vertices, and triangles of the type int32, without a copy, and keeps these arrays alive: copies
    would double the memory. Other arrays are copied.
    """
    points, data = vtkPoints(), vtkPolyData()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(vertices)))
    data.SetPoints(points)
    data.SetPolys(_cells(np.arange(0, 3 * len(triangles) + 1, 3, dtype=np.int32), triangles.ravel()))
    return data


def _cells(offsets: NDArray[np.integer], connectivity: NDArray[np.integer]) -> Any:
    """Return cells such as triangles as VTK's cell array, with 32-bit indices.

    The corners of cell i are connectivity[offsets[i] : offsets[i + 1]].

    offsets : (C + 1,) for C cells; connectivity : (N,)
    """
    cells = vtkCellArray()
    cells.SetData(*(numpy_to_vtk(numbers.astype(np.int32, copy=False)) for numbers in (offsets, connectivity)))
    return cells
