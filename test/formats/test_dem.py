import gzip

import numpy as np
import pytest
import rasterio
from input_files.terrain_files import SHARED_DATA
from rasterio.transform import from_origin

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.grids import read_dem
from rpf3d_core.formats.surface import facet_count

HEIGHTS = "7 8 9\n4 5 6\n1 2 3\n"  # row by row from the north
CORNER = "ncols 3\nnrows 3\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n"
CENTRE = "ncols 3\nnrows 3\nxllcenter 105\nyllcenter 205\ncellsize 10\nNODATA_value -9999\n"

ALPS = SHARED_DATA / "alps" / "avaKot.asc.gz"
TSCHAMUT = SHARED_DATA / "tschamut2014" / "terrain.asc"


def surface_of(tmp_path, text, name="dem.asc"):
    (tmp_path / name).write_text(text)
    return read_dem(tmp_path / name)


def up(surface):
    a, b, c = surface.points[surface.triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)[:, 2]


@pytest.mark.parametrize("header", [CORNER, CENTRE], ids=["xllcorner", "xllcenter"])
def test_an_elevation_belongs_to_the_centre_of_its_cell(tmp_path, header):
    surface = surface_of(tmp_path, header + HEIGHTS)
    heights = {(x, y): z for x, y, z in surface.points.tolist()}
    assert heights[105.0, 205.0] == 1.0
    assert heights[125.0, 205.0] == 3.0
    assert heights[105.0, 225.0] == 7.0
    assert len(heights) == 9


def test_every_square_is_two_triangles_that_look_up_cut_from_north_west_to_south_east(tmp_path):
    surface = surface_of(tmp_path, CORNER + HEIGHTS)
    assert facet_count(surface) == 8
    assert up(surface).tolist() == [100.0] * 8  # twice the area of half a square of 10 m
    for one, other in surface.triangles.reshape(-1, 2, 3):
        a, b = surface.points[np.intersect1d(one, other)]
        assert (b - a)[:2].tolist() == [10.0, -10.0]


def test_a_square_with_a_corner_without_data_is_a_hole(tmp_path):
    surface = surface_of(tmp_path, CORNER + "7 8 9\n4 5 6\n1 2 -9999\n")
    assert facet_count(surface) == 6
    assert len(surface.points) == 8
    assert surface.points[:, 2].min() == 1.0


def test_without_a_nodata_key_minus_9999_is_without_data(tmp_path):
    header = CORNER.replace("NODATA_value -9999\n", "")
    surface = surface_of(tmp_path, header + "7 8 9\n4 5 6\n1 2 -9999\n")
    assert (facet_count(surface), surface.points[:, 2].min()) == (6, 1.0)
    assert facet_count(surface_of(tmp_path, CORNER.replace("-9999", "-1") + "7 8 9\n4 5 6\n1 2 -9999\n")) == 8


def test_nan_is_without_data_too(tmp_path):
    assert facet_count(surface_of(tmp_path, CORNER + "nan 8 9\n4 5 6\n1 2 3\n")) == 6


def test_elevations_keep_every_digit(tmp_path):
    surface = surface_of(tmp_path, CORNER + HEIGHTS.replace("7", "2207.123456789"))
    assert surface.points[0, 2] == 2207.123456789


def test_a_compressed_grid_is_the_same_grid(tmp_path):
    plain = surface_of(tmp_path, CORNER + HEIGHTS)
    (tmp_path / "dem.asc.gz").write_bytes(gzip.compress((CORNER + HEIGHTS).encode()))
    packed = read_dem(tmp_path / "dem.asc.gz")
    assert np.array_equal(plain.points, packed.points)
    assert np.array_equal(plain.triangles, packed.triangles)


def write_geotiff(path, heights, transform, **profile):
    rows, columns = heights.shape
    options = {"driver": "GTiff", "height": rows, "width": columns, "count": 1, "dtype": heights.dtype, **profile}
    with rasterio.open(path, "w", transform=transform, **options) as grid:
        grid.write(heights, 1)
    return path


def test_a_geotiff_is_the_same_mesh_as_the_text_grid(tmp_path):
    heights = np.array([[7, 8, 9], [4, 5, 6], [1, 2, -9999]], dtype=np.float32)
    path = write_geotiff(tmp_path / "d.tif", heights, from_origin(100, 230, 10, 10), nodata=-9999, crs="EPSG:31287")
    text = surface_of(tmp_path, CORNER + "7 8 9\n4 5 6\n1 2 -9999\n")
    tiff = read_dem(path)
    assert np.array_equal(text.points, tiff.points)
    assert np.array_equal(text.triangles, tiff.triangles)


def test_a_geotiff_that_runs_northwards_looks_up_too(tmp_path):
    heights = np.arange(12, dtype=np.float64).reshape(3, 4)
    path = write_geotiff(tmp_path / "d.tiff", heights, rasterio.Affine(2, 0, 50, 0, 2, 70), crs="EPSG:31287")
    surface = read_dem(path)
    assert surface.points[0].tolist() == [51.0, 71.0, 0.0]
    assert surface.points[-1].tolist() == [57.0, 75.0, 11.0]
    assert (up(surface) > 0).all()


def test_a_grid_in_degrees_is_refused(tmp_path):
    path = write_geotiff(tmp_path / "d.tif", np.zeros((3, 3)), from_origin(11, 47, 1e-4, 1e-4), crs="EPSG:4326")
    with pytest.raises(TerrainError, match=r"d\.tif: is in degrees .*metres"):
        read_dem(path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (CORNER + "7 8 9\n4 5 6\n1 2\n", "has 8 elevations, but its header announces 3 rows of 3"),
        (CORNER + HEIGHTS + "1 2 3\n", "has 12 elevations"),
        (CORNER.replace("3", "3000") + HEIGHTS, "has 9 elevations"),
        (CORNER + HEIGHTS.replace("5", "five"), "every elevation must be a number"),
        (CORNER.replace("ncols 3", "ncols -3") + HEIGHTS, "cannot be read as an elevation grid"),
        ("<html></html>\n", "cannot be read as an elevation grid"),
        (CORNER.replace("3", "300000") + HEIGHTS, "more than can be numbered"),
    ],
    ids=["truncated", "too long", "announces more", "a word", "negative size", "a web page", "huge"],
)
def test_a_damaged_text_grid_is_refused(tmp_path, capfd, text, expected):
    with pytest.raises(TerrainError) as refused:
        surface_of(tmp_path, text)
    assert expected in str(refused.value)
    assert str(tmp_path / "dem.asc") in str(refused.value)
    assert capfd.readouterr() == ("", "")


def test_a_damaged_geotiff_or_archive_is_refused(tmp_path, capfd):
    path = write_geotiff(tmp_path / "d.tif", np.random.default_rng(1).random((200, 200)), from_origin(0, 0, 1, 1))
    path.write_bytes(path.read_bytes()[:50000])
    archive = tmp_path / "d.asc.gz"
    archive.write_bytes(gzip.compress((CORNER + HEIGHTS).encode())[:40])
    for damaged in (path, archive):
        with pytest.raises(TerrainError, match="cannot be read as an elevation grid"):
            read_dem(damaged)
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(not ALPS.exists(), reason="needs the Alpine elevation model of the shared reference data")
def test_the_alpine_grid_is_read_with_its_missing_part():
    surface = read_dem(ALPS)
    with gzip.open(ALPS, "rt") as file:
        heights = np.array([line.split() for line in file.readlines()[6:]], dtype=float)
    assert heights.shape == (517, 439)
    assert len(surface.points) == (heights != -9999).sum()
    assert surface.points[:, 2].min() == heights[heights != -9999].min()
    assert surface.points[:, 2].max() == heights.max()
    full = [heights[i : i + 516, j : j + 438] != -9999 for i in (0, 1) for j in (0, 1)]
    assert facet_count(surface) == 2 * np.logical_and.reduce(full).sum()


@pytest.mark.skipif(not TSCHAMUT.exists(), reason="needs the Tschamut 2014 terrain of the shared reference data")
def test_the_tschamut_grid_starts_half_a_cell_inside_its_corner():
    surface = read_dem(TSCHAMUT)
    assert len(surface.points) == 43 * 46
    assert surface.points[:, :2].min(axis=0).tolist() == [-32.5, 87.5]
    assert surface.points[:, :2].max(axis=0).tolist() == [177.5, 312.5]
    assert facet_count(surface) == 2 * 42 * 45
