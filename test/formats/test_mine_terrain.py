"""Tests of terrain in mine formats: readers return the mesh that was written, mostly by other libraries."""

import io
import zipfile
import zlib

import numpy as np
import pytest
from input_files.mine_files import at_site, write_dxf, write_landxml, write_omf, write_surpac
from input_files.terrain_files import grid, scene_of

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.meshes import read_stl
from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import scene_digest
from rpf3d_core.setup.terrain import read_surface, read_terrain

VERTICES, TRIANGLES = grid(4, 5, 2.0)
SITE = at_site(VERTICES)
EZDXF = "ezdxf is not installed: it is in the extra `test`"
OMF = "omf is not installed: it is in the extra `test`"


def corners_of(mesh: FileMesh) -> np.ndarray:
    """Return the corners (F, 3, 3) m of a mesh."""
    return mesh.points.reshape(-1, 3, 3) if mesh.triangles is None else mesh.points[mesh.triangles]


def zone_names(mesh: FileMesh) -> list[str]:
    """Return the zone name of each facet."""
    assert mesh.zone is not None
    return [mesh.zones[i] for i in mesh.zone]


def refusal_of(path) -> str:
    with pytest.raises(TerrainError) as caught:
        read_surface(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(str(path.parent))
    return line


def test_faces_of_a_dxf_keep_their_digits_and_layers(tmp_path):
    pytest.importorskip("ezdxf", reason=EZDXF)
    mesh = read_surface(write_dxf(tmp_path / "pit.dxf", SITE, TRIANGLES))
    assert np.array_equal(corners_of(mesh), SITE[TRIANGLES])
    assert zone_names(mesh) == ["wall", "floor"] * (len(TRIANGLES) // 2)
    assert (mesh.remarks, mesh.unit) == ((), "m")


def test_mesh_polyface_grid_and_closed_polylines_of_a_dxf_are_read_and_the_rest_is_counted(tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason=EZDXF)
    from ezdxf.render import MeshBuilder

    document = ezdxf.new("R2010")
    space = document.modelspace()
    with space.add_mesh(dxfattribs={"layer": "mesh"}).edit_data() as data:
        data.vertices = SITE.tolist()
        data.faces = [*TRIANGLES[2:].tolist(), [0, 1, 6, 5]]
    faces = MeshBuilder()
    faces.vertices, faces.faces = [ezdxf.math.Vec3(v) for v in SITE], TRIANGLES.tolist()
    faces.render_polyface(space, dxfattribs={"layer": "polyface"})
    sheet = space.add_polymesh((4, 5), dxfattribs={"layer": "grid"})
    for row in range(4):
        for column in range(5):
            sheet.set_mesh_vertex((row, column), SITE[5 * row + column])
    space.add_polyline3d(SITE[TRIANGLES[0]].tolist(), close=True, dxfattribs={"layer": "ring"})
    space.add_polyline3d(SITE[[0, 1, 6, 5]].tolist(), close=True, dxfattribs={"layer": "ring"})
    space.add_polyline3d(SITE[:9].tolist(), close=True)
    space.add_lwpolyline([(0, 0), (1, 1)])
    document.blocks.new("B").add_3dface(SITE[:4])
    space.add_blockref("B", (0, 0))
    document.saveas(tmp_path / "all.dxf")
    mesh = read_surface(tmp_path / "all.dxf")
    found = {zone: corners_of(mesh)[[name == zone for name in zone_names(mesh)]] for zone in mesh.zones}
    assert np.array_equal(found["polyface"], SITE[TRIANGLES])
    assert np.array_equal(found["mesh"], SITE[[*TRIANGLES[2:].tolist(), [0, 1, 6], [0, 6, 5]]])
    assert np.array_equal(found["ring"], SITE[[TRIANGLES[0], [0, 1, 6], [0, 6, 5]]])
    assert _area(found["grid"]) == pytest.approx(_area(SITE[TRIANGLES]), rel=0.05) and len(found["grid"]) == 24
    left, rings = mesh.remarks
    assert all(part in left for part in ("1 INSERT", "1 LWPOLYLINE", "1 POLYLINE", "explode blocks"))
    assert "all.dxf: ring: 2 closed polylines were read as ground; if they are areas, remove them" in rings


@pytest.mark.parametrize("ground", [True, False])
def test_a_closed_polyline_beside_other_ground_of_a_dxf_is_named(tmp_path, ground):
    ezdxf = pytest.importorskip("ezdxf", reason=EZDXF)
    document = ezdxf.new("R2010")
    space = document.modelspace()
    if ground:
        space.add_3dface(SITE[TRIANGLES[0]], dxfattribs={"layer": "FACE"})
    space.add_polyline3d(SITE[[0, 1, 6, 5]].tolist(), close=True, dxfattribs={"layer": "AREA_WORK"})
    document.saveas(tmp_path / "a.dxf")
    told = "a.dxf: AREA_WORK: 1 closed polyline was read as ground; if it is an area, remove it from this file"
    assert [told in remark for remark in read_surface(tmp_path / "a.dxf").remarks] == [True] * ground


def _area(corners: np.ndarray) -> float:
    return float(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum())


def test_the_unit_of_a_dxf_is_reported_and_converted_only_if_the_scene_asks(tmp_path):
    pytest.importorskip("ezdxf", reason=EZDXF)
    path = write_dxf(tmp_path / "pit.dxf", VERTICES * 1000.0, TRIANGLES, units=4)
    _, faults = read_terrain(scene_of(path))
    assert "pit.dxf: states that it is in millimetres, and is read in metres" in faults.remarks[0]
    assert faults.high[0] == pytest.approx(8000.0)
    scene = scene_of(path)
    told = scene.terrain.files[0].model_copy(update={"unit": "mm"})
    terrain, faults = read_terrain(scene.model_copy(update={
        "terrain": scene.terrain.model_copy(update={"files": (told,)})}))  # fmt: skip
    assert faults.remarks == () and faults.high[0] == pytest.approx(8.0)
    assert np.abs(terrain.frame.points_to_input(terrain.vertices)[:, 0]).max() == pytest.approx(8.0)


def test_a_drawing_in_metres_that_is_read_in_feet_is_reported(tmp_path):
    """All lengths and falls would be a third of the true ones, and the energies would look safe."""
    pytest.importorskip("ezdxf", reason=EZDXF)
    scene = scene_of(write_dxf(tmp_path / "pit.dxf", VERTICES, TRIANGLES))
    assert read_terrain(scene)[1].remarks == ()
    told = scene.terrain.files[0].model_copy(update={"unit": "ft"})
    _, faults = read_terrain(scene.model_copy(update={"terrain": scene.terrain.model_copy(update={"files": (told,)})}))
    (remark,) = faults.remarks
    assert remark.startswith("pit.dxf: states that it is in metres, and is read in feet")
    assert remark.endswith("if it is in metres, leave out its `unit: ft`")


def test_layers_are_zones_unless_the_scene_names_one_and_the_digest_knows(tmp_path):
    pytest.importorskip("ezdxf", reason=EZDXF)
    path = write_dxf(tmp_path / "pit.dxf", SITE, TRIANGLES)
    one = scene_of(path)
    values = one.model_dump(exclude={"path"}, exclude_unset=True)
    values["terrain"]["files"] = [{"path": str(path)}]
    several = Scene.model_validate({**values, "path": one.path})
    assert set(read_terrain(several)[0].zones) == {"wall", "floor"}
    assert read_terrain(one)[0].zones == ("pit",)
    values["terrain"]["files"] = [{"path": str(path), "zone": "terrain"}]
    assert scene_digest(several) != scene_digest(Scene.model_validate({**values, "path": one.path}))


def test_landxml_is_northing_first_with_surfaces_as_zones_and_its_reference_system(tmp_path):
    mesh = read_surface(write_landxml(tmp_path / "pit.xml", SITE, TRIANGLES))
    assert np.array_equal(corners_of(mesh), SITE[TRIANGLES])
    assert (mesh.zones, mesh.crs, mesh.unit) == (("topo",), "EPSG:32719", "m")
    text = (tmp_path / "pit.xml").read_text()
    hidden = text.replace("<F>", '<F i="1">', 3).replace('linearUnit="meter"', 'linearUnit="USSurveyFoot"')
    (tmp_path / "hidden.xml").write_text(hidden)
    fewer = read_surface(tmp_path / "hidden.xml")
    assert np.array_equal(corners_of(fewer), SITE[TRIANGLES[3:]]) and fewer.unit == "us_ft"
    assert "3 faces are marked as invisible" in fewer.remarks[0]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("<Pnts>", '<!DOCTYPE x [<!ENTITY a "b">]><Pnts>', "not complete XML"),
        ("<LandXML", '<!DOCTYPE LandXML [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>\n<LandXML', "document type"),
        ("<F>1 2 7</F>", "<F>1 2 999</F>", "names a point that does not exist"),
        ("<F>1 2 7</F>", "<F>1 2</F>", "three point numbers"),
        ("<F>1 2 7</F>", "<F>1 2</F><F>7 1 2 7</F>", "three point numbers"),
        ('id="3"', 'id="2"', "the same id"),
        ("</LandXML>", "", "not complete XML"),
    ],
)
def test_a_wrong_landxml_is_refused(tmp_path, old, new, told):
    text = write_landxml(tmp_path / "pit.xml", SITE, TRIANGLES).read_text()
    assert old in text
    (tmp_path / "pit.xml").write_text(text.replace(old, new, 1))
    assert told in refusal_of(tmp_path / "pit.xml")


def test_surpac_is_northing_first_and_reads_the_points_next_to_it(tmp_path):
    mesh = read_surface(write_surpac(tmp_path / "pit.dtm", SITE, TRIANGLES))
    assert np.array_equal(corners_of(mesh), SITE[TRIANGLES]) and mesh.remarks == ()
    (tmp_path / "pit.dtm").write_text((tmp_path / "pit.dtm").read_text().replace(" 1, 2, 7,", " 1, 2, 777,"))
    assert "names point 777, but the .str file has points 1 to 20" in refusal_of(tmp_path / "pit.dtm")
    (tmp_path / "pit.str").unlink()
    assert "its points are in pit.str next to it, which is missing" in refusal_of(tmp_path / "pit.dtm")


def test_a_changed_string_file_changes_the_digest_of_its_scene(tmp_path):
    scene = scene_of(write_surpac(tmp_path / "pit.dtm", SITE, TRIANGLES))
    before = scene_digest(scene)
    strings = tmp_path / "pit.str"
    strings.write_text(strings.read_text().replace("801.", "802.", 1))
    assert scene_digest(scene) != before


def test_an_omf_surface_has_the_origin_of_its_project(tmp_path):
    pytest.importorskip("omf", reason=OMF)
    mesh = read_surface(write_omf(tmp_path / "pit.omf", SITE, TRIANGLES))
    assert np.abs(corners_of(mesh) - SITE[TRIANGLES]).max() < 1e-8 and mesh.zones == ("topo",)


def test_an_omf_grid_of_heights_is_read_as_its_library_understands_it(tmp_path):
    omf = pytest.importorskip("omf", reason=OMF)
    geometry = omf.SurfaceGridGeometry(
        origin=[1.0, 2.0, 3.0], axis_u=[1, 0, 0], axis_v=[0, 1, 0], tensor_u=[2.0, 3.0], tensor_v=[5.0],
        offset_w=np.arange(6.0),
    )  # fmt: skip
    project = omf.Project(name="p", elements=[omf.SurfaceElement(name="", geometry=geometry)])
    omf.OMFWriter(project, str(tmp_path / "g.omf"))
    mesh = read_surface(tmp_path / "g.omf")
    assert mesh.points.tolist() == [[1, 2, 3], [3, 2, 4], [6, 2, 5], [1, 7, 6], [3, 7, 7], [6, 7, 8]]
    assert len(mesh.triangles) == 4 and mesh.zones == ("surface_1",)


def test_surfaces_of_an_omf_with_the_same_name_are_different_zones(tmp_path):
    omf = pytest.importorskip("omf", reason=OMF)
    geometry = omf.SurfaceGeometry(vertices=SITE, triangles=TRIANGLES)
    elements = [omf.SurfaceElement(name=name, geometry=geometry) for name in ("a_3", "a", "a", "surface_4", "")]
    omf.OMFWriter(omf.Project(name="p", elements=elements), str(tmp_path / "same.omf"))
    assert read_surface(tmp_path / "same.omf").zones == ("a_3", "a", "a_4", "surface_4", "surface_5")


def test_an_array_of_an_omf_that_would_fill_the_memory_is_refused(tmp_path):
    """The array is a zip bomb: 300 MB of zeros take 0.3 MB in the file."""
    pytest.importorskip("omf", reason=OMF)
    path = write_omf(tmp_path / "pit.omf", SITE, TRIANGLES)
    data = path.read_bytes()
    bomb = zlib.compress(bytes(300_000_000), 9)
    begin = int.from_bytes(data[52:60], "little")
    import json

    content = json.loads(data[begin:])
    for element in content.values():
        if isinstance(element.get("array"), dict) and element["array"]["dtype"] == "<f8":
            element["array"].update(start=60, length=len(bomb))
    path.write_bytes(data[:52] + (60 + len(bomb)).to_bytes(8, "little") + bomb + json.dumps(content).encode())
    assert "expands beyond" in refusal_of(path)


def zipped(*names: str, comment: bytes = b"") -> bytes:
    """Return the bytes of a ZIP archive with these files, which are empty."""
    into = io.BytesIO()
    with zipfile.ZipFile(into, "w") as archive:
        archive.comment = comment
        for name in names:
            archive.writestr(name, b"")
    return into.getvalue()


def test_an_stl_file_may_begin_like_another_file_in_its_free_text(tmp_path):
    facet = np.zeros(1, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facet["corners"] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    (tmp_path / "a.stl").write_bytes(b"ply of a pit".ljust(80) + (1).to_bytes(4, "little") + facet.tobytes())
    assert len(read_stl(tmp_path / "a.stl").points) == 3


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("a.dxf", b"AutoCAD Binary DXF\r\n\x1a\0", "save it as DXF in text"),
        ("a.dxf", b"  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n", "ends after line 6 without `EOF`"),
        ("a.dxf", b"  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n  0\nEOF\n", "holds no faces"),
        ("a.dxf", b"  0\nSECTION\n  x\nENTITIES\n", "line 3: must be a group code"),
        ("a.dxf", b"  0\nSECTION\n 10\n1,5\n  0\nEOF\n", "line 4: must be a number, but is '1,5'"),
        ("a.dxf", b"x" * 300_000, "a line of more than"),
        ("a.dtm", b"x\n", "its points are in a.str next to it"),
        ("a.omf", b"PK\3\4" + bytes(99), "is a damaged ZIP archive, neither OMF 1 nor OMF 2"),
        ("a.omf", zipped("1.parquet", "index.json.gz"), "is an OMF 2 file"),
        ("a.omf", zipped("1.parquet", comment=b"Open Mining Format 2.0"), "is an OMF 2 file"),
        ("a.omf", zipped("pit.dxf", "b", "c", "d"), "is a ZIP archive of pit.dxf, b, c, ..., neither"),
        ("a.stl", b"  999\r\nmade by\r\n  0\r\nSECTION\r\n  2\r\n" + bytes(99), "is not an STL file but a DXF file"),
        ("a.stl", b"0\nSECTION\n", "give it the ending .dxf"),
        ("a.stl", b"AC1032" + bytes(99), "is not an STL file but a DWG drawing: save the drawing as DXF"),
        ("a.stl", b"ply\nformat ascii 1.0\n" + b" " * 99, "a PLY file: give it the ending .ply"),
        ("a.omf", bytes(99), "is not an OMF 1 file"),
        ("a.dwg", b"AC1032", "save the drawing as DXF"),
        ("a.00t", b"x", "export the triangulation from Vulcan as DXF"),
    ],
)
def test_files_of_another_kind_are_refused_with_advice(tmp_path, name, content, told):
    (tmp_path / name).write_bytes(content)
    assert told in refusal_of(tmp_path / name)
