from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import ascii_stl, grid, write_binary_stl
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkIOGeometry import vtkOBJWriter
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter
from vtkmodules.vtkIOPLY import vtkPLYWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats import stl
from rpf3d_core.formats.surface import facet_count
from rpf3d_core.setup.terrain import read_surface

VERTICES, TRIANGLES = grid(6, 7)
CORNERS = VERTICES[TRIANGLES]

FLOAT32 = 1e-6  # largest error (m) of coordinates up to 8 m in float32, or in the six digits of VTK's text writers
TEXT_DIGITS = 1e-4  # largest error (m): OBJ and text files of VTK have six digits


def corners_of(surface):
    triangles = surface.triangles
    return (surface.points if triangles is None else surface.points[triangles]).reshape(-1, 3, 3)


def polygons(cells):
    data, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(VERTICES.astype(np.float32), deep=True))
    data.SetPoints(points)
    array = vtkCellArray()
    offsets = np.cumsum([0] + [len(cell) for cell in cells])
    array.SetData(*(numpy_to_vtkIdTypeArray(a.astype(np.int64), deep=True) for a in (offsets, np.concatenate(cells))))
    data.SetPolys(array)
    return data


def write(path, data, binary=True):
    writers = {".ply": vtkPLYWriter, ".obj": vtkOBJWriter, ".vtk": vtkPolyDataWriter, ".vtp": vtkXMLPolyDataWriter}
    writer = writers[path.suffix]()
    writer.SetInputData(data)
    writer.SetFileName(str(path))
    if path.suffix == ".vtp":
        writer.SetDataMode(writer.Appended if binary else writer.Ascii)
    elif path.suffix != ".obj":
        writer.SetFileType(2 if binary else 1)
    assert writer.Write()
    return path


KINDS = [
    pytest.param(f"m{suffix}", binary, id=f"{suffix[1:]} {'binary' if binary else 'text'}")
    for suffix in (".ply", ".vtk", ".vtp", ".obj")
    for binary in (True, False)
    if not (suffix == ".obj" and binary)
]


def test_a_binary_stl_is_read_corner_by_corner(tmp_path):
    surface = read_surface(write_binary_stl(tmp_path / "m.stl", CORNERS))
    assert np.array_equal(corners_of(surface), CORNERS.astype(np.float32))


@pytest.mark.parametrize("records", [7, len(CORNERS)])
def test_a_binary_stl_is_read_whole_however_many_facets_are_held_at_a_time(tmp_path, monkeypatch, records):
    monkeypatch.setattr(stl, "RECORDS_AT_A_TIME", records)
    assert len(CORNERS) % 7, "the last block is a part of one"
    surface = read_surface(write_binary_stl(tmp_path / "m.stl", CORNERS))
    np.testing.assert_array_equal(corners_of(surface), CORNERS.astype(np.float32))


def test_a_binary_stl_may_begin_with_the_word_solid(tmp_path):
    surface = read_surface(write_binary_stl(tmp_path / "m.STL", CORNERS, header=b"solid made by some program"))
    assert facet_count(surface) == len(CORNERS)


def test_an_ascii_stl_keeps_every_digit_at_survey_coordinates(tmp_path):
    there = CORNERS + np.array([500000.0, 4500000.0, 1700.0])
    (tmp_path / "m.stl").write_text(ascii_stl(there))
    assert np.array_equal(corners_of(read_surface(tmp_path / "m.stl")), there)


def test_an_ascii_stl_may_hold_several_solids_and_windows_line_ends(tmp_path):
    text = ascii_stl(CORNERS[:3]) + ascii_stl(CORNERS[3:])
    (tmp_path / "m.stl").write_bytes(text.replace("\n", "\r\n").encode())
    assert np.array_equal(corners_of(read_surface(tmp_path / "m.stl")), CORNERS)


@pytest.mark.parametrize(("name", "binary"), KINDS)
def test_triangles_are_read_from_every_format(tmp_path, name, binary):
    surface = read_surface(write(tmp_path / name, polygons(TRIANGLES), binary))
    assert np.abs(corners_of(surface) - CORNERS).max() < (FLOAT32 if binary else TEXT_DIGITS)


@pytest.mark.parametrize(("name", "binary"), KINDS)
def test_polygons_of_mixed_sizes_become_triangles_of_the_same_area(tmp_path, name, binary):
    quads = TRIANGLES.reshape(-1, 6)[:, [0, 1, 2, 5]]
    cells = [*quads[:-1], TRIANGLES[-2], TRIANGLES[-1]]
    surface = read_surface(write(tmp_path / name, polygons(cells), binary))
    edges = np.diff(corners_of(surface)[..., :2], axis=1)
    plan = np.cross(np.pad(edges[:, 0], ((0, 0), (0, 1))), np.pad(edges[:, 1], ((0, 0), (0, 1))))[:, 2] / 2
    assert facet_count(surface) == len(TRIANGLES)
    assert plan.sum() == pytest.approx(30.0, rel=FLOAT32)


def test_a_big_endian_ply_with_further_columns_is_read(tmp_path):
    header = (
        "ply\nformat binary_big_endian 1.0\ncomment by hand\nelement vertex 3\nproperty double x\nproperty double y\n"
        "property double z\nproperty uchar red\nelement face 1\nproperty list uchar uint vertex_indices\n"
        "property float quality\nend_header\n"
    )
    vertices = np.zeros(3, [("p", ">f8", 3), ("red", "u1")])
    vertices["p"] = CORNERS[0]
    face = np.array([(3, (2, 0, 1), 0.5)], [("n", "u1"), ("c", ">u4", 3), ("q", ">f4")])
    (tmp_path / "m.ply").write_bytes(header.encode() + vertices.tobytes() + face.tobytes())
    assert np.array_equal(corners_of(read_surface(tmp_path / "m.ply"))[0], CORNERS[0][[2, 0, 1]])


def test_an_obj_keeps_every_digit_and_understands_negative_and_slashed_indices(tmp_path):
    text = "v 500000.125001 4500000.25 1\nv 500001 4500000 1\nv 500000 4500001 1\nvt 0 0\nvn 0 0 1\n"
    (tmp_path / "m.obj").write_text(text + "f 1/1/1 2/1/1 3/1/1\nf -3 -2 -1\n")
    corners = corners_of(read_surface(tmp_path / "m.obj"))
    assert len(corners) == 2
    assert corners[1][0].tolist() == [500000.125001, 4500000.25, 1.0]


def refusal_of(path):
    with pytest.raises(TerrainError) as refused:
        read_surface(path)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)
    return str(refused.value)


@pytest.mark.parametrize(("name", "binary"), [kind for kind in KINDS if "obj" not in kind.id])
@pytest.mark.parametrize("share", [0.9, 0.66, 0.33, 0.05])
def test_a_truncated_file_is_refused_and_nothing_is_printed(tmp_path, capfd, name, binary, share):
    path = write(tmp_path / name, polygons(TRIANGLES), binary)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    refusal_of(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("end", ["f 1 2", "f 1", "v 1 0"])
def test_an_obj_that_ends_within_a_line_is_refused_and_nothing_is_printed(tmp_path, capfd, end):
    # A file that ends between two lines is a smaller valid mesh, because OBJ announces no counts.
    (tmp_path / "m.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{end}")
    refusal_of(tmp_path / "m.obj")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["m.stl", "m.ply", "m.obj", "m.vtp", "m.vtk"])
@pytest.mark.parametrize(
    "content", [b"", b"<html><body>404 Not Found</body></html>\n" * 9], ids=["empty", "a web page"]
)
def test_a_file_that_is_no_mesh_is_refused_and_nothing_is_printed(tmp_path, capfd, name, content):
    (tmp_path / name).write_bytes(content)
    refusal_of(tmp_path / name)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("announced", [len(CORNERS) + 1, 4_000_000_000, 1])
def test_a_binary_stl_that_announces_another_number_of_triangles_is_refused(tmp_path, announced):
    refusal = refusal_of(write_binary_stl(tmp_path / "m.stl", CORNERS, announced))
    assert f"{announced:,} triangles" in refusal
    assert f"room for {len(CORNERS):,}" in refusal


def test_a_truncated_binary_stl_is_refused(tmp_path):
    path = write_binary_stl(tmp_path / "m.stl", CORNERS)
    path.write_bytes(path.read_bytes()[:-7])
    assert "truncated" in refusal_of(path)


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (lambda text: text[: text.rindex("endfacet")], "ends after line 420 without `endsolid`"),
        (lambda text: text[: text.rindex("vertex") + 9], "must be `vertex x y z`"),
        (lambda text: text.replace("outer loop", "inner loop", 1), "line 3 must be `outer loop`"),
        (lambda text: text.replace("vertex", "vertex one", 1), "line 4 must be `vertex x y z`"),
    ],
    ids=["truncated", "truncated in a line", "a wrong word", "no number"],
)
def test_a_damaged_ascii_stl_is_refused_with_the_line(tmp_path, damage, expected):
    (tmp_path / "m.stl").write_text(damage(ascii_stl(CORNERS)))
    assert expected in refusal_of(tmp_path / "m.stl")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_vertex_that_is_not_finite_is_refused_with_the_number_of_its_facet(tmp_path, value):
    corners = CORNERS.copy()
    corners[17, 1, 2] = value
    assert "facet number 17 " in refusal_of(write_binary_stl(tmp_path / "m.stl", corners))
    (tmp_path / "text.stl").write_text(ascii_stl(corners))
    assert "facet number 17 " in refusal_of(tmp_path / "text.stl")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ("m.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
                  "POLYGONS 1 4\n3 0 1 8\n"),
        ("m.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 8\n"),
    ],
)  # fmt: skip
def test_a_facet_on_a_point_that_does_not_exist_is_refused(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert "names point 8, but the file has points 0 to 2" in refusal_of(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4000000000 float\n0 0 0\n"),
        ("m.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n"
                  "property float y\nproperty float z\nelement face 4000000000\n"
                  "property list uchar int vertex_indices\nend_header\n"),
        ("m.vtp", '<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="4000000000" NumberOfPolys="1">'
                  "</Piece></PolyData></VTKFile>"),
    ],
)  # fmt: skip
def test_a_count_that_the_file_cannot_hold_is_refused_before_anything_is_allocated(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert "4,000,000,000" in refusal_of(tmp_path / name)


def test_a_mesh_without_triangles_is_refused(tmp_path):
    (tmp_path / "m.stl").write_text("solid nothing\nendsolid nothing\n")
    assert "holds no triangles" in refusal_of(tmp_path / "m.stl")


def test_an_unknown_extension_is_refused_with_the_known_ones(tmp_path):
    (tmp_path / "m.dwg").write_text("x")
    refusal = refusal_of(tmp_path / "m.dwg")
    assert all(known in refusal for known in (".stl", ".ply", ".obj", ".vtp", ".vtk", ".asc", ".tif"))


def test_a_missing_file_is_refused(tmp_path):
    assert "No such file" in refusal_of(tmp_path / "m.stl")


@pytest.mark.parametrize("value", ["nan", "inf", "-1e300"])
def test_a_point_that_no_facet_has_is_left_out_whatever_it_is(tmp_path, value):
    (tmp_path / "m.obj").write_text(f"v 1 2 3\nv {value} 0 0\nv 4 2 3\nv 1 5 3\nf 1 3 4\n")
    surface = read_surface(tmp_path / "m.obj")
    assert surface.points.tolist() == [[1, 2, 3], [4, 2, 3], [1, 5, 3]]
    assert surface.triangles.tolist() == [[0, 1, 2]]


def test_a_vertex_beyond_all_maps_is_refused(tmp_path):
    corners = CORNERS.copy()
    corners[3, 0, 0] = 2e9
    refusal = refusal_of(write_binary_stl(tmp_path / "m.stl", corners))
    assert "facet number 3 " in refusal and "1,000,000,000 m" in refusal


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)


@pytest.mark.parametrize(
    ("sound", "damaged", "expected"),
    [
        ("format ascii 1.0\n", "", "must have a line `format`"),
        ("list uchar", "list float", "'property list float int vertex_indices'"),
        ("int vertex", "float vertex", "'property list uchar float vertex_indices'"),
        ("face 1", "face -1", "'element face -1'"),
        ("vertex 3", "vertex -3", "'element vertex -3'"),
        ("3 0 1 2", "3 0 1 99999999999999999999999", "damaged"),
        ("3 0 1 2", "2 0 1", "face number 0 (from 0) has 2 corners, fewer than 3"),
        ("0 0 0\n1 0 0\n0 1 0\n", "0 0 0 1\n0 0 0 1\n0 0 0 1\n", "the vertex '0 0 0 1' must have 3 numbers"),
    ],
)
def test_a_damaged_ply_is_refused(tmp_path, sound, damaged, expected):
    (tmp_path / "m.ply").write_text(PLY)
    assert facet_count(read_surface(tmp_path / "m.ply")) == 1
    (tmp_path / "m.ply").write_text(PLY.replace(sound, damaged))
    assert expected in refusal_of(tmp_path / "m.ply")


def test_a_binary_ply_with_a_face_of_two_corners_or_a_count_beyond_all_is_refused(tmp_path):
    header = PLY[: PLY.index("0 0 0")].replace("ascii", "binary_little_endian").encode()
    body = CORNERS[0].astype("<f4").tobytes()
    (tmp_path / "m.ply").write_bytes(header + body + b"\2" + np.array([0, 1], "<i4").tobytes())
    assert "has 2 corners" in refusal_of(tmp_path / "m.ply")
    (tmp_path / "m.ply").write_bytes(header.replace(b"vertex 3", b"vertex " + b"9" * 30) + body)
    assert "truncated or damaged" in refusal_of(tmp_path / "m.ply")


@pytest.mark.parametrize("name", ["m.vtk", "m.vtp"])
def test_a_polygon_of_two_corners_is_refused(tmp_path, name):
    path = write(tmp_path / name, polygons([*TRIANGLES[:3], TRIANGLES[3][:2], *TRIANGLES[4:]]))
    assert "facet number 3 (from 0) has 2 corners" in refusal_of(path)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\npoints 4000000000 float\n0 0 0\n"),
        ("m.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
                  "Polygons 1 4000000000\n3 0 1 2\n"),
        ("m.vtp", "<VTKFile type='PolyData'><PolyData><Piece NumberOfPoints = '4000000000' NumberOfPolys='1'>"
                  "</Piece></PolyData></VTKFile>"),
    ],
)  # fmt: skip
def test_a_count_that_the_file_cannot_hold_is_found_however_it_is_written(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert "announces 4,000,000,000 points or cells" in refusal_of(tmp_path / name)


def test_a_file_that_breaks_vtk_down_is_refused_and_one_beside_the_caller_is_read(tmp_path, monkeypatch):
    path = write(tmp_path / "m.vtk", polygons(TRIANGLES))
    monkeypatch.chdir(tmp_path)
    assert facet_count(read_surface(Path("m.vtk"))) == len(TRIANGLES)
    # The file seems to be of an older version, in which cells are written in another way.
    path.write_bytes(path.read_bytes().replace(b"Version 5.1", b"Version nan"))
    refusal_of(path)
