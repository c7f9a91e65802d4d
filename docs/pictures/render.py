"""Render a result folder's terrain.vtp and trajectories.vtp off screen: the picture in the README.

python docs/pictures/render.py out/demo docs/pictures/demo.png
"""

import sys
from pathlib import Path

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (registers the OpenGL back end)
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonColor import vtkNamedColors
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTubeFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkColorTransferFunction,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)

ZONE_COLOURS = {"face": (140, 146, 150), "ramp": (186, 143, 124), "floor": (196, 196, 192), "spill": (205, 176, 92)}
OTHER_ZONE = (214, 196, 158)
HIT = (255, 255, 255)
FASTEST = 20.0  # m/s, the top of the colour scale


def read(path: Path) -> vtkPolyData:
    """Return the mesh or the lines in a .vtp file."""
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def terrain_actor(data: vtkPolyData) -> vtkActor:
    """Return the terrain to draw: facets coloured by zone, hit facets white as in the thesis' trace maps."""
    names = data.GetFieldData().GetAbstractArray("zone_names")
    table = np.array([zone_colour(names.GetValue(i)) for i in range(names.GetNumberOfValues())], dtype=np.uint8)
    colours = table[vtk_to_numpy(data.GetCellData().GetArray("zone"))]
    colours[vtk_to_numpy(data.GetCellData().GetArray("hit")) > 0] = HIT
    data.GetCellData().SetScalars(numpy_to_vtk(colours, deep=True))
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.25)
    return actor


def zone_colour(name: str) -> tuple[int, int, int]:
    """Return the colour of a zone as red, green and blue."""
    return ZONE_COLOURS.get(name, OTHER_ZONE)


def trajectory_actor(data: vtkPolyData) -> vtkActor:
    """Return the paths to draw: tubes coloured by speed."""
    tubes = vtkTubeFilter()
    tubes.SetInputData(data)
    tubes.SetRadius(0.22)
    tubes.SetNumberOfSides(8)
    colours = vtkColorTransferFunction()
    for share, red, green, blue in ((0.0, 0.2, 0.2, 0.7), (0.5, 0.95, 0.75, 0.1), (1.0, 0.8, 0.05, 0.05)):
        colours.AddRGBPoint(share * FASTEST, red, green, blue)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(tubes.GetOutputPort())
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray("speed")
    mapper.SetLookupTable(colours)
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


def render(folder: Path, picture: Path) -> None:
    """Write the picture of a result folder: a view from above the pit, down the wall that the rocks fell from."""
    terrain, paths = read(folder / "terrain.vtp"), read(folder / "trajectories.vtp")
    renderer = vtkRenderer()
    renderer.SetBackground(vtkNamedColors().GetColor3d("AliceBlue"))
    renderer.AddActor(terrain_actor(terrain))
    renderer.AddActor(trajectory_actor(paths))
    x0, x1, _, _, z0, z1 = paths.GetBounds()
    camera = renderer.GetActiveCamera()
    camera.SetViewUp(0.0, 0.0, 1.0)
    camera.SetFocalPoint(0.5 * (x0 + x1) + 15.0, -60.0, 0.5 * (z0 + z1) - 8.0)
    camera.SetPosition(x1 + 150.0, -185.0, z1 + 45.0)
    renderer.ResetCameraClippingRange()
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(1280, 720)
    window.AddRenderer(renderer)
    window.Render()
    capture = vtkWindowToImageFilter()
    capture.SetInput(window)
    writer = vtkPNGWriter()
    writer.SetFileName(str(picture))
    writer.SetInputConnection(capture.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    render(Path(sys.argv[1]), Path(sys.argv[2]))
