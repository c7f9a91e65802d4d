"""Tests that a terrain written as a mesh file is read back unchanged, in the input's coordinates."""

from pathlib import Path

import numpy as np
import pytest
from flights.flights_on_a_floor import SURVEY, SURVEY_Y_UP, UNMOVED, floor
from programs.command_line import ROOT, python

from rpf3d_core.errors import InputError
from rpf3d_core.results.mesh_writer import WRITERS, check_mesh_path, write_mesh
from rpf3d_core.setup.terrain import read_surface
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

SINGLE = 2.0**-24
"""Relative rounding error (-) of float32, which STL uses."""
FULL = 20_000
"""Largest size (bytes) of a file in tests of a full disk; the mesh takes more in each format."""


def corners_of(path: Path) -> np.ndarray:
    surface = read_surface(path)
    points = np.asarray(surface.points, dtype=float)
    return points.reshape(-1, 3, 3) if surface.triangles is None else points[surface.triangles]


def expected(terrain: Terrain) -> np.ndarray:
    return np.asarray(terrain.frame.points_to_input(terrain.vertices))[terrain.triangles]


@pytest.mark.parametrize("frame", [UNMOVED, SURVEY, SURVEY_Y_UP], ids=["unmoved", "survey", "survey, y up"])
@pytest.mark.parametrize("extension", WRITERS)
def test_facets_read_back_as_they_were_written(tmp_path: Path, extension: str, frame: Frame) -> None:
    terrain = floor(frame)
    path = tmp_path / f"floor{extension}"
    write_mesh(path, terrain)
    corners = expected(terrain)
    rounding = SINGLE * np.abs(corners).max() if extension == ".stl" else 0.0
    np.testing.assert_allclose(corners_of(path), corners, rtol=0.0, atol=rounding)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("extension", sorted(set(WRITERS) - {".vtp"}))
def test_vtk_reads_what_is_not_written_by_it(tmp_path: Path, extension: str) -> None:
    from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
    from vtkmodules.vtkIOPLY import vtkPLYReader

    terrain = floor()
    write_mesh(tmp_path / f"floor{extension}", terrain)
    reader = {".stl": vtkSTLReader, ".ply": vtkPLYReader, ".obj": vtkOBJReader}[extension]()
    reader.SetFileName(str(tmp_path / f"floor{extension}"))
    reader.Update()
    mesh = reader.GetOutput()
    assert mesh.GetNumberOfPolys() == len(terrain.triangles)
    assert mesh.GetNumberOfPoints() == len(terrain.vertices)
    assert mesh.GetBounds() == (-20.0, 20.0, -20.0, 20.0, 0.0, 0.0)


def test_vtp_keeps_the_zones(tmp_path: Path) -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    terrain = floor()
    write_mesh(tmp_path / "floor.vtp", terrain)
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "floor.vtp"))
    reader.Update()
    cells = reader.GetOutput().GetCellData()
    np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray("zone")), terrain.zone)
    assert not vtk_to_numpy(cells.GetArray("hit")).any()


def test_the_extension_may_be_written_in_capitals(tmp_path: Path) -> None:
    for extension in WRITERS:
        path = tmp_path / f"floor{extension.upper()}"
        write_mesh(path, floor())
        assert len(corners_of(path)) == len(floor().triangles)


def test_an_unknown_extension_a_missing_folder_and_a_folder_are_refused(tmp_path: Path) -> None:
    (tmp_path / "pit.stl").mkdir()
    for name, sentence in [
        ("floor.xyz", r"floor.xyz: the extension must be one of \.vtp, \.stl, \.ply, \.obj"),
        ("floor", "the extension must be"),
        ("none/floor.stl", "there is no folder .*none"),
        ("pit.stl", "is a folder; the mesh needs the path of a file"),
    ]:
        for refuses in (check_mesh_path, lambda path: write_mesh(path, floor())):
            with pytest.raises(InputError, match=sentence):
                refuses(tmp_path / name)
    assert [path.name for path in tmp_path.rglob("*")] == ["pit.stl"]


@pytest.mark.long
@pytest.mark.parametrize("extension", WRITERS)
def test_a_disk_that_fills_up_is_an_error_and_leaves_the_mesh_that_was_there(tmp_path: Path, extension: str) -> None:
    # A limit on the size of files stands for the disk: it stops any write in its middle.
    path = tmp_path / f"floor{extension}"
    path.write_text("precious")
    done = python(
        "import resource, sys; from pathlib import Path\n"
        f"sys.path.insert(0, {str(ROOT / 'test' / 'support')!r})\n"
        "from flights.flights_on_a_floor import floor; from rpf3d_core.errors import InputError\n"
        "from rpf3d_core.results.mesh_writer import write_mesh\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({FULL}, {FULL}))\n"
        f"try:\n    write_mesh(Path({str(path)!r}), floor(cells=60))\n"
        "except InputError as fault:\n    print(fault)\n"
    )
    assert done.stdout.startswith(f"{path}: could not be written"), done.stderr
    assert ".part" not in done.stdout
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name] and path.read_text() == "precious"
