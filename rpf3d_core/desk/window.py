"""The VTK window whose content trame sends to the browser, where vtk.js draws it; this process draws nothing."""

from typing import Any

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  # registers the classes that the window is made of
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer
from vtkmodules.vtkRenderingOpenGL2 import vtkGenericOpenGLRenderWindow

from rpf3d_core.desk.shapes import DrawnMesh, Lines
from rpf3d_core.terrain.frame import FloatArray

NAMES = GROUND, MAP, PATHS, RELEASES, CRESTS, AREAS, BARRIERS, DRAWN = (
    "ground", "map", "paths", "releases", "crests", "areas", "barriers", "drawn",
)  # fmt: skip
"""Names of the parts that the window shows; DRAWN is the drawing of the user."""
COLOURS = {
    PATHS: (0.06, 0.13, 0.25), RELEASES: (0.70, 0.0, 0.48), CRESTS: (0.70, 0.0, 0.48), AREAS: (0.0, 0.35, 0.75),
    DRAWN: (0.0, 0.55, 0.1),
}  # fmt: skip
POINT_SIZE, LINE_WIDTH, THIN = 9.0, 3.0, 1.2
SOUTH = np.array([0.0, -1.0])
DISTANCE, LEVEL, RAISED = 1.6, 0.8, 0.6
"""Distance of the camera from the middle of the viewed points, divided by the diagonal of their box (-); horizontal and
vertical component (-) of the unit vector from the middle to the camera.
"""


class VtkWindow:
    """The content of the view, with a VTK actor for each name of NAMES.

    The actors are never replaced: trame-vtk identifies objects by their addresses, and a new object may get the address
    of a deleted one. The browser would then draw new triangles in old colours.
    """

    def __init__(self) -> None:
        """Make an empty window; a generic VTK window needs no display."""
        self.render_window: Any = vtkGenericOpenGLRenderWindow()
        self.renderer: Any = vtkRenderer()
        self.renderer.SetBackground(1.0, 1.0, 1.0)
        self.render_window.AddRenderer(self.renderer)
        self._actors = {name: self._hidden(name) for name in NAMES}

    def show_mesh(self, name: str, mesh: DrawnMesh | None) -> None:
        """Show the triangles of a mesh in their own colours under a name of NAMES; None hides this part."""
        data = self._data(name, mesh is not None)
        if mesh is None:
            return
        data.SetPoints(_points(mesh.vertices))
        data.SetPolys(_cells(np.arange(0, 3 * len(mesh.triangles) + 1, 3), mesh.triangles.ravel()))
        colours = numpy_to_vtk(np.ascontiguousarray(mesh.colours), deep=True)
        colours.SetName("colours")
        data.GetCellData().SetScalars(colours)

    def show_lines(self, name: str, lines: Lines, width: float = LINE_WIDTH) -> None:
        """Show polylines under a name of NAMES; width : pixels."""
        data = self._data(name, len(lines.points) > 0)
        if len(lines.points):
            data.SetPoints(_points(lines.points))
            data.SetLines(_cells(lines.starts, np.arange(len(lines.points))))
            self._actors[name].GetProperty().SetLineWidth(width)

    def show_points(self, name: str, points: FloatArray) -> None:
        """Show points (N, 3) m under a name of NAMES; under the name DRAWN, a line joins the points."""
        data = self._data(name, len(points) > 0)
        if not len(points):
            return
        data.SetPoints(_points(points))
        data.SetVerts(_cells(np.arange(len(points) + 1), np.arange(len(points))))
        if name == DRAWN:
            data.SetLines(_cells(np.array([0, len(points)]), np.arange(len(points))))

    def look_at(self, points: FloatArray, side: FloatArray = SOUTH) -> None:
        """Turn the camera so that points (N, 3) m fill the view.

        side : (2,) unit vector in plan from the points to the camera
        """
        low, high = points.min(axis=0), points.max(axis=0)
        middle, size = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 1.0)
        camera = self.renderer.GetActiveCamera()
        camera.SetFocalPoint(*middle)
        camera.SetPosition(*(middle + DISTANCE * size * np.array([*(LEVEL * side), RAISED])))
        camera.SetViewUp(0.0, 0.0, 1.0)

    def next_number(self) -> int:
        """Return a new number for the present content, larger than all numbers before.

        trame-vtk sends this number, the window's modification time, with the content. The browser reports this number
        plus one for content that it has drawn. If it has drawn the same content more than once, it adds one each time.
        """
        self.render_window.Modified()
        return int(self.render_window.GetMTime())

    def _data(self, name: str, shown: bool) -> Any:
        """Show or hide the part of the view with a name of NAMES, and return its VTK data, which the caller fills."""
        self._actors[name].SetVisibility(shown)
        return self._actors[name].GetMapper().GetInput()

    def _hidden(self, name: str) -> Any:
        """Return a hidden VTK actor for a name of NAMES, in its colour of COLOURS or in the colours of its mesh."""
        mapper, actor = vtkPolyDataMapper(), vtkActor()
        mapper.SetInputData(vtkPolyData())
        actor.SetMapper(mapper)
        actor.GetProperty().LightingOff()
        actor.GetProperty().SetPointSize(POINT_SIZE)
        actor.GetProperty().SetLineWidth(LINE_WIDTH)
        if name in COLOURS:
            mapper.ScalarVisibilityOff()
            actor.GetProperty().SetColor(*COLOURS[name])
        else:
            mapper.SetColorModeToDirectScalars()
            mapper.SetScalarModeToUseCellData()
        actor.SetPickable(name in (GROUND, MAP))
        actor.VisibilityOff()
        self.renderer.AddActor(actor)
        return actor


def _points(points: FloatArray) -> Any:
    found = vtkPoints()
    found.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float32), deep=True))
    return found


def _cells(starts: NDArray[Any], corners: NDArray[Any]) -> Any:
    """Return a VTK cell array of N cells, such as triangles.

    starts : (N + 1,) index in `corners` of each cell's first corner, then K; corners : (K,) indices of points
    """
    cells = vtkCellArray()
    cells.SetData(
        numpy_to_vtkIdTypeArray(starts.astype(np.int64), deep=True),
        numpy_to_vtkIdTypeArray(corners.astype(np.int64), deep=True),
    )
    return cells
