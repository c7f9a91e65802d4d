"""Tests of files of scanned blocks: cubes with known faults, all formats, and four blocks of the Authume quarry."""

from itertools import product

import numpy as np
import pytest
from bodies.solid_checks import assert_is_a_closed_convex_solid, chirality
from input_files.terrain_files import SHARED_DATA, ascii_stl, write_binary_stl
from scipy.spatial import ConvexHull

from rpf3d_core.errors import InputError
from rpf3d_core.shapes.block_files import read_block
from rpf3d_core.shapes.directions import fibonacci_sphere

BLOCKS = SHARED_DATA / "authume" / "blocks"
CORNERS = np.array(list(product((0.0, 1.0), repeat=3)))
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])
"""Triangles of a cube of 1 m, anticlockwise from outside."""
CUBE = CORNERS[TRIANGLES]


def round_block(count):
    """Return the facets (F, 3, 3) of the hull of a Fibonacci sphere, anticlockwise from outside."""
    facets = fibonacci_sphere(count)[ConvexHull(fibonacci_sphere(count)).simplices]
    inward = np.linalg.det(facets) < 0.0
    facets[inward] = facets[inward][:, ::-1]
    return facets


def read(tmp_path, facets, corners=100):
    return read_block(write_binary_stl(tmp_path / "block.stl", np.asarray(facets)), corners)


# --- sound files ------------------------------------------------------------------------------------------------------


def test_a_cube_of_12_triangles_becomes_6_faces_and_8_corners(tmp_path):
    body, findings = read(tmp_path, CUBE)
    assert (len(body.faces), len(body.corners), body.name) == (6, 8, "block")
    assert body.volume == pytest.approx(1.0, rel=1e-12)
    assert body.moments == pytest.approx(3 * [1 / 6], rel=1e-12)
    assert findings == ("the rock has 8 corners; 100 were asked for",)


def test_a_convex_block_with_a_corner_in_each_direction_has_no_findings(tmp_path):
    body, findings = read(tmp_path, round_block(60), 60)
    assert len(body.corners) == 60
    assert body.volume == pytest.approx(ConvexHull(fibonacci_sphere(60)).volume, rel=1e-6), "STL has single precision"
    assert findings == ()


def test_every_format_gives_the_same_block(tmp_path):
    text = {
        "a.stl": ascii_stl(CUBE),
        "b.obj": "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
        + "".join(f"f {a + 1} {b + 1} {c + 1} {d + 1}\n" for a, b, c, d in QUADS),
        "c.ply": "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
        + "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS)
        + "".join("4 " + " ".join(map(str, quad)) + "\n" for quad in QUADS),
        "d.vtp": '<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>'
        '<Piece NumberOfPoints="8" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="6"><Points>'
        f'<DataArray type="Float64" NumberOfComponents="3" format="ascii">{" ".join(map(str, CORNERS.ravel()))}'
        '</DataArray></Points><Polys><DataArray type="Int64" Name="connectivity" format="ascii">'
        f'{" ".join(map(str, np.ravel(QUADS)))}</DataArray><DataArray type="Int64" Name="offsets" format="ascii">'
        "4 8 12 16 20 24</DataArray></Polys></Piece></PolyData></VTKFile>",
    }
    expected, _ = read(tmp_path, CUBE)
    for name, content in text.items():
        (tmp_path / name).write_text(content, encoding="ascii")
        body, findings = read_block(tmp_path / name, 100)
        assert (body.name, body.faces, findings[1:]) == (name[0], expected.faces, ())
        assert np.array_equal(body.corners, expected.corners)


@pytest.mark.parametrize(("unit", "per_metre"), [(6, 1.0), (4, 1000.0), (2, 1.0 / 0.3048)])
def test_a_file_that_states_its_unit_gives_the_block_in_metres(tmp_path, unit, per_metre):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed; install the extra `mine`")
    drawing = ezdxf.new(units=unit)
    for facet in CUBE * per_metre:
        drawing.modelspace().add_3dface(facet)
    drawing.saveas(tmp_path / "block.dxf")
    body, findings = read_block(tmp_path / "block.dxf", 100)
    assert body.volume == pytest.approx(1.0, rel=1e-12)
    assert any("converted to metres" in finding for finding in findings) == (per_metre != 1.0)


def test_a_block_at_survey_coordinates_is_the_same_block(tmp_path):
    near, far = tmp_path / "near.stl", tmp_path / "far.stl"
    near.write_text(ascii_stl(round_block(60)), encoding="ascii")
    far.write_text(ascii_stl(round_block(60) + np.array([512_000.0, 4_500_000.0, 800.0])), encoding="ascii")
    (body, findings), (moved, same) = read_block(near, 60), read_block(far, 60)
    assert moved.moments == pytest.approx(body.moments, rel=1e-8)
    assert findings == same == ()


# --- findings ---------------------------------------------------------------------------------------------------------


def test_a_mesh_without_a_facet_is_open_at_three_edges(tmp_path):
    body, findings = read(tmp_path, CUBE[:-1])
    assert len(body.corners) == 8
    assert findings[0] == "the solid is open: 3 edges have one facet only"


def test_a_mesh_that_is_inside_out_is_reported_and_gives_the_same_block(tmp_path):
    body, findings = read(tmp_path, CUBE[:, ::-1])
    assert findings[0].startswith("the solid is inside out")
    assert len(findings) == 2
    expected, _ = read(tmp_path, CUBE)
    assert np.array_equal(body.corners, expected.corners)


def test_a_mesh_with_all_facets_doubled_is_the_same_block(tmp_path):
    expected, _ = read(tmp_path, CUBE)
    for doubles in (CUBE, CUBE[:, ::-1], np.roll(CUBE, 1, axis=1)):
        body, findings = read(tmp_path, np.concatenate([CUBE, doubles]))
        assert findings == (
            "12 facets repeat the corners of another facet; left out",
            "the rock has 8 corners; 100 were asked for",
        )
        assert np.array_equal(body.corners, expected.corners)


def test_facets_without_an_area_are_reported_and_left_out(tmp_path):
    _, findings = read(tmp_path, [*CUBE, [CORNERS[0], CORNERS[0], CORNERS[1]]])
    assert findings == ("1 facet has no area; left out", "the rock has 8 corners; 100 were asked for")


def test_a_mesh_with_one_facet_turned_is_not_compared_with_its_hull(tmp_path):
    _, findings = read(tmp_path, [*CUBE[:-1], CUBE[-1][::-1]])
    assert findings[0].startswith("3 edges join two facets of opposite winding")
    assert len(findings) == 2


def test_two_cubes_apart_are_two_parts_and_not_convex(tmp_path):
    body, findings = read(tmp_path, np.concatenate([CUBE, CUBE + np.array([2.0, 0.0, 0.0])]))
    assert findings[0] == "the mesh has 2 separate parts; the hull encloses all of them"
    assert findings[1].startswith("the solid is not convex: it fills 66.7 % of its hull")
    assert body.volume == pytest.approx(3.0, rel=1e-12)


def test_a_block_is_one_part_in_whatever_order_its_facets_name_their_corners(tmp_path):
    # Only the edges 0-1 and 2-3 of the tetrahedron are the first side of a facet.
    facets = CORNERS[[0, 4, 2, 1]][[[0, 1, 2], [1, 0, 3], [2, 3, 0], [3, 2, 1]]]
    _, findings = read(tmp_path, facets, 40)
    assert not any("parts" in finding for finding in findings)


def test_a_dented_block_is_reported_with_its_share_of_the_hull(tmp_path):
    centre = (0.5, 0.5, 0.5)
    dented = [*CUBE[2:], *([centre, a, b] for a, b in zip(CORNERS[[0, 1, 3, 2]], CORNERS[[1, 3, 2, 0]], strict=True))]
    body, findings = read(tmp_path, dented)
    assert findings[0].startswith("the solid is not convex: it fills 83.3 % of its hull"), "a pyramid of 1/6 is missing"
    assert body.volume == pytest.approx(1.0, rel=1e-12)


def test_parts_that_overlap_are_reported(tmp_path):
    inner = 0.8 * (CUBE - 0.5) + 0.5
    _, findings = read(tmp_path, np.concatenate([CUBE, inner]))
    assert findings[1].startswith("facets overlap: they enclose 151.2 % of the volume of the hull")


def test_a_sheet_inside_a_block_gives_edges_of_more_than_two_facets(tmp_path):
    _, findings = read(tmp_path, [*CUBE, CORNERS[[0, 1, 7]]])
    assert findings[:2] == ("the solid is open: 1 edge has one facet only", "2 edges have more than two facets")


def test_a_hull_that_loses_volume_is_reported(tmp_path):
    body, findings = read(tmp_path, round_block(150), 12)
    share = body.volume / ConvexHull(fibonacci_sphere(150)).volume
    assert len(body.corners) == 12
    assert findings == (f"the rock has {100 * share:.1f} % of the volume of the hull of all points",)


# --- refused ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("corners", [-1, 0, 3, 201])
def test_too_few_or_too_many_corners_are_refused(tmp_path, corners):
    with pytest.raises(InputError, match=rf"block.stl: {corners} corners are asked for; choose 4 to 200"):
        read(tmp_path, CUBE, corners)


@pytest.mark.parametrize(
    ("facets", "message"),
    [
        pytest.param(np.empty((0, 3, 3)), "holds no facets", id="no facets"),
        pytest.param(CUBE[:, :1].repeat(3, axis=1), "no facets with an area", id="points"),
        pytest.param(CUBE * (1, 1, 0), "in one plane", id="flat"),
        pytest.param(CUBE * (1, 0, 0), "no facets with an area", id="a line"),
        pytest.param(np.where(CUBE > 0.5, np.nan, CUBE), "NaN or infinite", id="not a number"),
        pytest.param(np.where(CUBE > 0.5, np.inf, CUBE), "NaN or infinite", id="infinite"),
        pytest.param(1e12 * CUBE, "coordinates are metres", id="too far"),
        pytest.param(CUBE[:1], "3 different corners", id="one facet"),
    ],
)
def test_a_file_without_a_solid_is_refused_by_name(tmp_path, facets, message):
    with pytest.raises(InputError, match=message) as refused:
        read(tmp_path, facets)
    assert str(refused.value).startswith(f"{tmp_path / 'block.stl'}: ")
    assert "terrain" not in str(refused.value).replace(str(tmp_path), "")


def test_a_missing_file_an_unknown_format_and_a_truncated_file_are_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"none.stl: is not a file"):
        read_block(tmp_path / "none.stl", 40)
    with pytest.raises(InputError, match=r"rock.step: has the unknown format '.step'; a rock is read from .stl"):
        read_block(tmp_path / "rock.step", 40)
    write_binary_stl(tmp_path / "cut.stl", CUBE, announced=13)
    with pytest.raises(InputError, match=r"cut.stl: the header"):
        read_block(tmp_path / "cut.stl", 40)


# --- the blocks of the Authume quarry ---------------------------------------------------------------------------------

AUTHUME = pytest.mark.skipif(not BLOCKS.is_dir(), reason="the data of the Authume quarry is not in ../shared/data")
NAMES = pytest.mark.parametrize("name", ["SP1A", "SP2A", "SP2B", "SP3A"])


def scan(name):
    """Return the facets (F, 3, 3) of a scanned block, without the project's readers."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    content = (BLOCKS / f"{name}.stl").read_bytes()
    if content[80:84] == np.uint32((len(content) - 84) // 50).tobytes():
        return np.frombuffer(content, record, offset=84)["corners"].astype(float)
    words = content.decode("ascii").split()
    places = [i for i, word in enumerate(words) if word == "vertex"]
    return np.array([[float(word) for word in words[i + 1 : i + 4]] for i in places]).reshape(-1, 3, 3)


@AUTHUME
@NAMES
@pytest.mark.parametrize("corners", [20, 40, 200])
def test_a_scanned_block_becomes_a_closed_solid_inside_its_hull(name, corners):
    body, _ = read_block(BLOCKS / f"{name}.stl", corners)
    assert_is_a_closed_convex_solid(body, tolerance=2e-6)
    assert 0.4 * corners < len(body.corners) <= corners
    assert body.volume < ConvexHull(scan(name).reshape(-1, 3)).volume


@AUTHUME
@NAMES
def test_the_volume_of_a_scanned_block_is_that_of_the_hull_of_its_outermost_points(name):
    points = scan(name).reshape(-1, 3)
    k = np.arange(40) + 0.5
    z, angle = 1 - 2 * k / 40, np.pi * (3 - 5**0.5) * (k - 0.5)
    directions = np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])
    outermost = points[np.unique(np.argmax(points @ directions, axis=0))]
    body, _ = read_block(BLOCKS / f"{name}.stl", 40)
    assert body.volume == pytest.approx(ConvexHull(outermost).volume, rel=1e-6)
    assert 0.89 < body.volume / ConvexHull(points).volume < 0.91


@AUTHUME
@NAMES
def test_the_findings_on_a_scanned_block_state_its_own_volume_and_its_missing_facet(name):
    facets = scan(name)
    own = np.einsum("ij,ij->i", facets[:, 0], np.cross(facets[:, 1], facets[:, 2])).sum() / 6
    share = own / ConvexHull(facets.reshape(-1, 3)).volume
    _, findings = read_block(BLOCKS / f"{name}.stl", 40)
    is_open = findings[0] == "the solid is open: 3 edges have one facet only"
    assert is_open == (name == "SP1A"), "the file SP1A lacks a triangle"
    assert findings[is_open].startswith("the solid is not convex: it fills ")
    assert float(findings[is_open].split()[7]) == pytest.approx(100 * share, abs=0.1 if is_open else 0.051)
    assert "were asked for" in findings[is_open + 1]
    assert "of the volume of the hull of all points" in findings[is_open + 2]


@AUTHUME
def test_a_mirrored_file_gives_the_mirrored_block(tmp_path):
    facets = scan("SP2A")
    # The hull of a few points, all of which are found, so that the choice of directions does not matter.
    hull = ConvexHull(facets.reshape(-1, 3))
    corners = hull.points[np.random.default_rng(1).choice(hull.vertices, 12, replace=False)]
    few = corners[ConvexHull(corners).simplices]
    body, _ = read(tmp_path, few, 200)
    mirrored, _ = read(tmp_path, few * (-1.0, 1.0, 1.0), 200)
    assert len(body.corners) == len(mirrored.corners) == len(ConvexHull(corners).vertices)
    assert mirrored.volume == pytest.approx(body.volume, rel=1e-12)
    assert mirrored.moments == pytest.approx(body.moments, rel=1e-12)
    assert abs(chirality(body.corners)) > 1e-4
    assert chirality(mirrored.corners) == pytest.approx(-chirality(body.corners), rel=1e-6)


@AUTHUME
@NAMES
def test_a_scanned_block_gives_the_same_bits_each_time(name):
    first, again = (read_block(BLOCKS / f"{name}.stl", 40)[0] for _ in range(2))
    assert np.array_equal(first.corners, again.corners)
    assert np.array_equal(first.normals, again.normals)
    assert first.faces == again.faces
