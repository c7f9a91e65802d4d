"""Tests of all bands and cells of the GeoTIFFs, and of their places."""

import numpy as np
import pytest
import rasterio
from flights.flights_on_a_floor import FRAMES, SURVEY, SURVEY_Y_UP, floor
from hazards.hazard_layers import Points, laid_out, lines_of_rocks, maps_of

from rpf3d_core.errors import InputError
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.hazard.quantities import STATISTICS
from rpf3d_core.results.hazard_files import geotiffs as module
from rpf3d_core.results.hazard_files.geotiffs import write_hazard_rasters
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.zones import in_plan

NAMES = {
    "reach_probability", "first_arrival_s", "passages", "impacts", "deposits", "energy_j", "speed_m_s", "height_m",
}  # fmt: skip
CRS = "EPSG:31287"
CELL = 2.0


@pytest.fixture(params=FRAMES, ids=lambda frame: f"{frame.up}-up at {frame.origin[0]:.0f}")
def terrain(request):
    return floor(request.param)


@pytest.fixture
def maps(terrain):
    return maps_of(terrain, lines_of_rocks(terrain), CELL)


def written(folder, terrain, maps, crs=None):
    write_hazard_rasters(folder, terrain, maps, crs)
    return {path.stem: rasterio.open(path) for path in folder.iterdir()}


def centres(terrain, raster):
    """Return the plan coordinates (C, 2) m, in the input's axes, of the centres of all cells."""
    row, column = np.divmod(np.arange(raster.nx * raster.ny), raster.nx)
    local = np.stack([raster.x + (column + 0.5) * raster.cell, raster.y + (row + 0.5) * raster.cell], axis=1)
    return in_plan(terrain.frame, np.append(local, np.zeros((len(local), 1)), axis=1))


def at_centres(file, terrain, raster):
    """Return the bands (C, B) at the centres of the cells, found by the transform in the file."""
    return np.array(list(file.sample(centres(terrain, raster))))


def test_there_is_a_file_a_quantity(tmp_path, terrain, maps):
    assert set(written(tmp_path, terrain, maps)) == NAMES


def test_every_cell_comes_back_at_its_own_coordinates(tmp_path, terrain, maps):
    files, cells = written(tmp_path, terrain, maps), laid_out(maps.cells)
    for name in ("passages", "impacts", "deposits"):
        np.testing.assert_array_equal(at_centres(files[name], terrain, maps.raster)[:, 0], getattr(cells, name))
    reach = at_centres(files["reach_probability"], terrain, maps.raster)[:, 0]
    np.testing.assert_array_equal(reach, (cells.rocks / maps.flown).astype(np.float32))
    arrival = at_centres(files["first_arrival_s"], terrain, maps.raster)[:, 0]
    np.testing.assert_array_equal(arrival, cells.first_arrival.astype(np.float32))
    assert np.isnan(arrival).any() and (reach > 0).any()


@pytest.mark.parametrize("name", ["energy_j", "speed_m_s", "height_m"])
def test_every_band_of_a_spread_comes_back_under_its_name(tmp_path, terrain, maps, name):
    file = written(tmp_path, terrain, maps)[name]
    assert file.descriptions == STATISTICS == ("max", "mean", "p50", "p90", "p95", "p99")
    bands = at_centres(file, terrain, maps.raster)
    spread = getattr(laid_out(maps.cells), name.split("_")[0])
    fields = ("largest", "mean", "p50", "p90", "p95", "p99")
    assert len({float(np.nansum(getattr(spread, field))) for field in fields}) == 6  # bands that could be mixed up
    for band, field in enumerate(fields):
        np.testing.assert_array_equal(bands[:, band], getattr(spread, field).astype(np.float32))


def test_a_file_says_where_it_lies_what_it_holds_and_what_is_no_data(tmp_path):
    terrain = floor(SURVEY)
    maps = maps_of(terrain, lines_of_rocks(terrain), CELL)
    files = written(tmp_path, terrain, maps, CRS)
    raster = maps.raster
    for name, file in files.items():
        assert file.crs.to_epsg() == 31287
        assert file.compression.name == "deflate" and (file.width, file.height) == (raster.nx, raster.ny)
        assert file.transform.a == CELL and file.transform.e == -CELL and file.transform.b == file.transform.d == 0.0
        assert (file.bounds.left, file.bounds.top) == (499_980.0, 4_499_980.0 + raster.ny * CELL)
        assert file.tags()["ROCKS"] == "300" and file.tags()["QUANTITY"] == name and file.tags()["AXES"] == "x y"
        assert file.units[0] == file.tags()["UNITS"]
    assert [files[name].units[0] for name in ("energy_j", "speed_m_s", "height_m", "first_arrival_s")] == [
        "J", "m/s", "m", "s",
    ]  # fmt: skip
    assert "different rocks" in files["energy_j"].tags()["MEANING"]
    assert np.isnan(files["energy_j"].nodata) and files["impacts"].nodata == 2**32 - 1
    assert files["impacts"].dtypes == ("uint32",) and set(files["energy_j"].dtypes) == {"float32"}


def test_no_rock_is_no_data_in_statistics_and_zero_in_counts_and_shares(tmp_path):
    terrain = floor()
    maps = maps_of(terrain, lines_of_rocks(terrain), CELL)
    files = written(tmp_path, terrain, maps)
    rocks = laid_out(maps.cells).rocks
    nobody = rocks == 0
    few = ~nobody & (rocks < FEWEST_ROCKS)
    assert nobody.any() and few.any() and (rocks >= FEWEST_ROCKS).any()

    def known(name, band):
        mask = files[name].read_masks(band)
        return mask[::-1].ravel() > 0  # of the raster's order: rows from the south

    for name in ("reach_probability", "passages", "impacts", "deposits"):
        assert known(name, 1).all()
    np.testing.assert_array_equal(known("first_arrival_s", 1), ~nobody)
    for name in ("energy_j", "speed_m_s", "height_m"):
        for band in (1, 2):
            np.testing.assert_array_equal(known(name, band), ~nobody)
        for band in (3, 4, 5, 6):
            np.testing.assert_array_equal(known(name, band), ~nobody & ~few)


def test_plan_axes_of_a_terrain_whose_y_points_up_are_x_and_z_and_have_no_reference_system(tmp_path):
    terrain = floor(SURVEY_Y_UP)
    maps = maps_of(terrain, lines_of_rocks(terrain), CELL)
    file = written(tmp_path, terrain, maps, CRS)["deposits"]
    assert file.crs is None and file.tags()["AXES"] == "x z"
    assert file.transform.e == -CELL
    assert file.bounds.bottom < -4_500_000.0 < file.bounds.top  # z runs south: the negative of the northing


def test_a_large_raster_is_written_in_tiles(tmp_path, monkeypatch):
    terrain = floor()
    maps = maps_of(terrain, lines_of_rocks(terrain, 5), 0.1)
    assert written(tmp_path, terrain, maps)["energy_j"].block_shapes[0][1] == maps.raster.nx
    monkeypatch.setattr(module, "LARGE", 400)
    files, cells = written(tmp_path, terrain, maps), laid_out(maps.cells)
    assert files["energy_j"].block_shapes[0] == (256, 256)
    for band, name in enumerate(vars(cells.energy), start=1):
        expected = getattr(cells.energy, name).astype(np.float32)
        np.testing.assert_array_equal(files["energy_j"].read(band)[::-1].ravel(), expected)
    np.testing.assert_array_equal(files["passages"].read(1)[::-1].ravel(), cells.passages)


@pytest.mark.parametrize("up", ["z", "y"])
def test_tiles_that_no_rock_came_to_hold_no_data_and_count_none(tmp_path, monkeypatch, up):
    monkeypatch.setattr(module, "LARGE", 60)
    monkeypatch.setattr(module, "TILE", 16)
    terrain = floor(SURVEY if up == "z" else SURVEY_Y_UP)
    maps = maps_of(terrain, lines_of_rocks(terrain, 3), 0.5)
    files, cells = written(tmp_path, terrain, maps), laid_out(maps.cells)
    reached = cells.rocks.reshape(maps.raster.ny, maps.raster.nx) > 0
    assert not reached[:16, :16].any() and reached.any(), "there are tiles without rocks, and others"
    for name, expected in (("first_arrival_s", cells.first_arrival), ("impacts", cells.impacts)):
        found = at_centres(files[name], terrain, maps.raster)[:, 0]
        np.testing.assert_array_equal(found, expected.astype(found.dtype))


@pytest.mark.filterwarnings("error")
def test_cells_of_a_metre_from_a_corner_at_the_origin_keep_their_place(tmp_path):
    flat = floor()  # GDAL takes such a transform for none at all in other formats
    terrain = Terrain(flat.vertices * 0.999 + (20.0, -20.5, 0.0), flat.triangles, flat.zone, flat.zones)
    file = written(tmp_path, terrain, maps_of(terrain, lines_of_rocks(terrain, 3), 1.0))["passages"]
    assert tuple(file.transform)[:6] == (1.0, 0.0, 0.0, 0.0, -1.0, 0.0)


def test_counts_beyond_32_bits_are_not_cut(tmp_path):
    terrain = floor()
    maps = maps_of(terrain, lines_of_rocks(terrain), CELL)
    maps.cells.passages[7] = 2**40 + 1
    file = written(tmp_path, terrain, maps)["passages"]
    assert at_centres(file, terrain, maps.raster)[maps.cells.cell[7], 0] == 2**40 + 1


def test_no_rocks_make_empty_maps(tmp_path):
    terrain, none = floor(), np.empty(0)
    maps = maps_of(terrain, Points(none.astype(int), np.empty((0, 2)), none, none, none, none.astype(bool)), CELL)
    files = written(tmp_path, terrain, maps)
    assert files["reach_probability"].read(1).max() == 0.0
    assert np.isnan(files["height_m"].read()).all()


@pytest.mark.parametrize(
    ("crs", "words"), [("EPSG:999999", "no known"), ("nowhere", "no known"), ("EPSG:4326", "degrees")]
)
@pytest.mark.parametrize("frame", [SURVEY, SURVEY_Y_UP])
def test_a_reference_system_that_is_none_or_in_degrees_is_refused(tmp_path, crs, words, frame):
    terrain = floor(frame)
    with pytest.raises(InputError, match=words) as refused:
        write_hazard_rasters(tmp_path, terrain, maps_of(terrain, lines_of_rocks(terrain, 3), CELL), crs)
    assert "terrain.crs" in str(refused.value) and crs in str(refused.value)
    assert list(tmp_path.iterdir()) == []
