"""Tests of point clouds: read as written, and converted to a surface that keeps the gaps."""

from pathlib import Path

import numpy as np
import pytest
from input_files.mine_files import EAST, NORTH, write_e57, write_landxml, write_las
from input_files.terrain_files import scene_of

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.apart import read_apart
from rpf3d_core.formats.apart_child import SECONDS, SECONDS_PER_MEGABYTE
from rpf3d_core.formats.mine.clouds import read_cloud
from rpf3d_core.formats.mine.las import las_arrays
from rpf3d_core.setup.terrain import read_surface, read_terrain
from rpf3d_core.terrain.cloud_surface import CloudChoice, CloudSurface, cloud_surface

LASPY = "laspy is not installed: it is in the extra `mine`"
PYE57 = "pye57 is not installed: it is in the extra `mine`"


def hill(plan: np.ndarray) -> np.ndarray:
    """Return the points (N, 3) m of a smooth hill above places (N, 2) m."""
    return np.column_stack([plan, 8.0 * np.sin(plan[:, 0] / 25.0) + 5.0 * np.cos(plan[:, 1] / 15.0)])


def spread(count: int, width: float, seed: int = 4) -> np.ndarray:
    """Return points (count, 3) m of the hill at random places of a square of side `width` (m)."""
    return hill(np.random.default_rng(seed).random((count, 2)) * width)


def plan_areas(surface: CloudSurface) -> np.ndarray:
    """Return the signed areas (F,) m2 of the triangles in plan, positive if anticlockwise."""
    a, b, c = (surface.points[surface.triangles[:, k], :2] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def sides_of(surface: CloudSurface) -> tuple[np.ndarray, np.ndarray]:
    """Return the undirected sides (S, 2) of the triangles, and the number of triangles of each side (S,)."""
    sides = np.concatenate([surface.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    return np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)


def test_the_surface_covers_the_plan_once_and_its_points_are_points_of_the_cloud():
    points = spread(20_000, 100.0)
    surface = cloud_surface(points)
    given = {tuple(point) for point in points.tolist()}
    assert all(tuple(point) in given for point in surface.points.tolist())
    assert (plan_areas(surface) > 0.0).all(), "every triangle faces up"
    _, count = sides_of(surface)
    assert count.max() == 2
    import shapely

    outline = shapely.union_all(shapely.polygons(surface.points[surface.triangles][:, :, :2]))
    assert plan_areas(surface).sum() == pytest.approx(outline.area, rel=1e-9), "triangles overlap"
    assert plan_areas(surface).sum() == pytest.approx(100.0**2, rel=0.05)
    middle = surface.points[surface.triangles].mean(axis=1)
    assert np.abs(middle[:, 2] - hill(middle[:, :2])[:, 2]).max() < 0.2


def test_the_lowest_point_of_each_cell_is_kept_so_plants_are_left_out():
    ground = spread(20_000, 100.0)
    plants = spread(4_000, 100.0, seed=5) + np.array([0.0, 0.0, 3.0])
    surface = cloud_surface(np.concatenate([ground, plants]), choice=CloudChoice(cell=2.0))
    above = surface.points[:, 2] - hill(surface.points[:, :2])[:, 2]
    assert (above > 1.0).mean() < 0.01
    lowest = {}
    low = np.concatenate([ground, plants])[:, :2].min(axis=0)
    for x, y, z in np.concatenate([ground, plants]).tolist():
        cell = (np.floor((x - low[0]) / 2.0 + 0.5), np.floor((y - low[1]) / 2.0 + 0.5))
        lowest[cell] = min(lowest.get(cell, np.inf), z)
    assert set(surface.points[:, 2].tolist()) <= set(lowest.values())


def test_a_gap_of_the_survey_stays_a_hole_and_small_ones_are_closed():
    points = spread(40_000, 100.0)
    points = points[np.hypot(points[:, 0] - 50.0, points[:, 1] - 50.0) > 12.0]
    surface = cloud_surface(points)
    assert len(surface.holes) == 1 and surface.closed > 10
    assert surface.holes[0] == pytest.approx(np.pi * 12.0**2, rel=0.15)
    whole = cloud_surface(points, choice=CloudChoice(widest=40.0))
    assert len(whole.holes) == 0
    assert plan_areas(whole).sum() == pytest.approx(plan_areas(surface).sum() + surface.holes[0], rel=1e-9)
    rough = cloud_surface(points, choice=CloudChoice(widest=0.0))
    assert rough.closed == 0 and len(rough.holes) > 10


def test_a_grid_of_points_keeps_every_point():
    x, y = np.meshgrid(np.arange(30) * 2.5 + EAST, np.arange(20) * 2.5 + NORTH)
    points = hill(np.column_stack([x.ravel(), y.ravel()]))
    surface = cloud_surface(np.random.default_rng(1).permutation(points))
    assert surface.cell == 2.5 and len(surface.points) == 600 and len(surface.triangles) == 2 * 29 * 19
    assert {tuple(p) for p in surface.points.tolist()} == {tuple(p) for p in points.tolist()}


@pytest.mark.parametrize(
    ("points", "choice", "told"),
    [
        (np.zeros((2, 3)), CloudChoice(), "at least three"),
        (np.column_stack([np.arange(9.0), np.zeros((9, 2))]), CloudChoice(), "lie on one line"),
        (np.array([[0, 0, 0], [1, 0, 0], [0, 1, np.nan]]), CloudChoice(), "NaN or infinite"),
        (spread(100, 100.0), CloudChoice(cell=0.1), "no three neighbouring cells"),
        (spread(100, 1e8), CloudChoice(cell=1e-3), "too small"),
        (spread(100, 10.0), CloudChoice(classes=(2,)), "has no classes"),
    ],
)
def test_a_cloud_without_a_surface_is_refused(points, choice, told):
    with pytest.raises(TerrainError, match=told):
        cloud_surface(points, choice=choice)


def test_classes_of_ground_are_chosen_and_noise_is_left_out():
    points, classes = spread(5_000, 50.0), np.ones(5_000, np.uint8)
    classes[:100] = 7
    assert cloud_surface(points, classes).ground == 4_900
    classes[100:3_100] = 2
    assert cloud_surface(points, classes).ground == 3_000
    assert cloud_surface(points, classes, CloudChoice(classes=(1, 2))).ground == 4_900


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_a_las_file_is_read_with_classes_and_reference_system(tmp_path, name):
    pytest.importorskip("laspy", reason=LASPY)
    pytest.importorskip("pyproj", reason="pyproj is not installed: it is in the extra `mine`")
    points = np.round(spread(5_000, 50.0) + np.array([EAST, NORTH, 800.0]), 3)
    classes = np.where(np.arange(5_000) % 3 == 0, 2, 5).astype(np.uint8)
    cloud = read_cloud(write_las(tmp_path / name, points, classes, crs=32719))
    assert np.abs(cloud.points - points).max() < 1e-6
    assert np.array_equal(cloud.classes, classes) and cloud.crs == "EPSG:32719" and not cloud.single
    mesh = read_surface(tmp_path / name)
    assert "1,667 of them ground" in mesh.remarks[-1] and mesh.crs == "EPSG:32719"


@pytest.mark.parametrize("name", ["a.las", "a.xml"])
def test_a_terrain_in_degrees_is_refused_and_a_wrong_statement_is_ignored(tmp_path, name):
    def written(points: np.ndarray) -> Path:
        if name == "a.las":
            return write_las(tmp_path / name, points, crs=4326)
        path = write_landxml(tmp_path / name, points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
        path.write_text(path.read_text().replace("32719", "4326"))
        return path

    pytest.importorskip("laspy", reason=LASPY)
    pytest.importorskip("pyproj", reason="pyproj is not installed: it is in the extra `mine`")
    points = spread(600, 50.0)
    with pytest.raises(TerrainError, match=rf"{name}: is in degrees \(EPSG:4326\); reproject it"):
        read_surface(written(points + np.array([-69.0, -21.0, 0.0])))
    mesh = read_surface(written(points + np.array([EAST, NORTH, 800.0])))
    assert mesh.crs is None
    (remark,) = [remark for remark in mesh.remarks if "EPSG:4326" in remark]
    assert "outside the range of degrees" in remark


def test_an_e57_file_is_read_and_its_single_precision_is_reported(tmp_path):
    pytest.importorskip("pye57", reason=PYE57)
    points = spread(5_000, 50.0)
    near = read_cloud(write_e57(tmp_path / "near.e57", points))
    assert near.single and np.abs(near.points - points).max() < 1e-5
    write_e57(tmp_path / "far.e57", points + np.array([EAST, NORTH, 0.0]))
    assert read_terrain(scene_of(tmp_path / "near.e57"))[1].remarks[1:] == ()
    remark = read_terrain(scene_of(tmp_path / "far.e57"))[1].remarks[1]
    assert "steps of 0.5 m at 7654050 m" in remark and "off by up to 0.25 m" in remark


def test_a_damaged_e57_file_is_refused_with_one_sentence_of_the_reason(tmp_path):
    pytest.importorskip("pye57", reason=PYE57)
    path = write_e57(tmp_path / "a.e57", spread(500, 10.0))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(TerrainError) as refusal:
        read_cloud(path)
    assert str(refusal.value) == (
        f"{path}: cannot be read as an E57 file: checksum mismatch, file is corrupted; export it again"
    )


def test_entities_in_the_xml_of_an_e57_are_refused(tmp_path):
    pytest.importorskip("pye57", reason=PYE57)
    path = write_e57(tmp_path / "a.e57", spread(100, 10.0))
    data = path.read_bytes()
    at = data.index(b"<e57Root")
    path.write_bytes(data[:at] + b"<!DOCTYPE x" + data[at + 11 :])
    with pytest.raises(TerrainError, match="document type"):
        read_cloud(path)


def test_a_reader_in_a_process_of_its_own_is_stopped_by_its_limits(tmp_path, monkeypatch):
    program = "import resource\nresource.setrlimit(resource.RLIMIT_CPU, (1, 1))\nwhile True:\n    pass\n"
    (tmp_path / "endless.py").write_text("def read(path):\n    " + program.replace("\n", "\n    ").rstrip() + "\n")
    (tmp_path / "greedy.py").write_text("def read(path):\n    return {'a': bytearray(2**36)}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "a.laz").write_bytes(b"x")
    with pytest.raises(TerrainError, match="asks for more memory than it can need"):
        read_apart(tmp_path / "a.laz", "greedy:read")
    with pytest.raises(TerrainError, match="breaks down on it"):
        read_apart(tmp_path / "a.laz", "endless:read")


def test_the_process_that_reads_has_a_limit_of_time(tmp_path, monkeypatch):
    reader = "import resource\ndef read(path):\n    return {'most': resource.getrlimit(resource.RLIMIT_CPU)[0]}\n"
    (tmp_path / "limits.py").write_text(reader)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "a.laz").write_bytes(bytes(3_000_000))
    assert read_apart(tmp_path / "a.laz", "limits:read")["most"] == SECONDS + 3 * SECONDS_PER_MEGABYTE


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", "# east north rl\n{rows}"),
        ("a.csv", "northing,easting,rl\n{swapped}"),
        ("a.txt", "{rows}"),
    ],
)
def test_text_is_read_with_and_without_a_header(tmp_path, name, text):
    points = np.round(spread(300, 20.0), 3)
    separator = "," if name.endswith("csv") else " "
    rows, swapped = (
        "\n".join(separator.join(map(repr, row)) for row in points[:, order].tolist())
        for order in ([0, 1, 2], [1, 0, 2])
    )
    (tmp_path / name).write_text(text.format(rows=rows, swapped=swapped) + "\n")
    assert np.array_equal(read_cloud(tmp_path / name).points, points)


def test_a_wrong_line_of_a_text_is_named(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z\n1,2,3\n4,5,six\n")
    with pytest.raises(TerrainError, match=r"a\.csv, line 3, column 3 \(z\): z must be a plain, finite number"):
        read_cloud(tmp_path / "a.csv")


def test_a_las_header_with_a_huge_count_is_refused_before_memory_is_asked_for(tmp_path):
    pytest.importorskip("laspy", reason=LASPY)
    path = write_las(tmp_path / "a.las", spread(100, 10.0))
    data = bytearray(path.read_bytes())
    data[247:255] = (4_000_000_000).to_bytes(8, "little")
    path.write_bytes(data)
    with pytest.raises(TerrainError, match="announces 4,000,000,000 points"):
        las_arrays(path)


@pytest.mark.parametrize("quote", ["", '"'])
@pytest.mark.parametrize("name", ["class", "Classification"])
def test_a_column_of_classes_of_a_csv_is_read(tmp_path, name, quote):
    rows = [f"{x},{y},1.5,{quote}{2 if x else 6}{quote}" for x in range(3) for y in range(3)]
    (tmp_path / "a.csv").write_text("\n".join([f"Easting,Northing,Elevation,{name}", *rows]))
    cloud = read_cloud(tmp_path / "a.csv")
    assert cloud.classes is not None and cloud.classes.tolist() == [6] * 3 + [2] * 6
    assert cloud.points[3].tolist() == [1.0, 0.0, 1.5] and cloud.remarks == ()


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ("x,y,z,intensity,class\n1,2,3,9,2\n", "a.csv: not read: column intensity"),
        ("x,y,z,class\n1,2,3,2\n1,3,3,rock\n", "'class' gives classes of points only if each cell is a whole number"),
        ("x,y,z,class\n1,2,3,2\n1,3,3,2.5\n", "'class' gives classes of points only if each cell is a whole number"),
        ("x,y,z,class\n1,2,3,2\n1,3,3,256\n", "a.csv: not read: column class; "),
        ("x,y,z,class,CLASS\n1,2,3,2,2\n", "a.csv: not read: columns class, CLASS"),
        ("1 2 3 40 50\n2 3 4 50 60\n", "a.csv: not read: columns 4, 5"),
    ],
)
def test_columns_that_are_not_read_are_named(tmp_path, text, note):
    (tmp_path / "a.csv").write_text(text)
    cloud = read_cloud(tmp_path / "a.csv")
    assert len(cloud.points) == len(text.splitlines()) - text.startswith("x")
    (remark,) = cloud.remarks
    assert note in remark
    assert (cloud.classes is None) == ("intensity" not in text)
