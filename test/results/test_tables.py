"""Tests of the tables, value by value, in the axes and coordinates of the input."""

import csv
import json
import math

import numpy as np
import pyarrow.parquet as parquet
import pytest
from flights.flights_on_a_floor import BOUNCES, FRAMES, MASS, SOURCES, floor, none_thrown, thrown

from rpf3d_core.ensemble.paths import sample_paths
from rpf3d_core.results.tables import open_tables, write_trajectories

DEPOSIT_COLUMNS = [
    "source", "rock", "piece", "outcome", "x", "y", "z", "t", "path_m", "runout_m", "impacts", "max_speed",
    "max_energy_j", "max_height", "zone", "entered_ground_at_speed", "mass_kg", "diameter_m",
    "release_x", "release_y", "release_z",
]  # fmt: skip
IMPACT_COLUMNS = [
    "source", "rock", "piece", "index", "t", "x", "y", "z", "facet", "zone", "struck",
    "normal_x", "normal_y", "normal_z", "speed_in", "speed_out", "energy_in_j",
]  # fmt: skip
TRAJECTORY_COLUMNS = ["source", "rock", "piece", "t", "x", "y", "z", "speed", "mode"]


DENSITY = 2700.0


def write_tables(folder, sources, terrain, *blocks, impacts=True):
    """Write deposits.csv and, if `impacts`, impacts.parquet of flights, block after block."""
    with open_tables(folder, sources, terrain, DENSITY, impacts) as write:
        for flights in blocks:
            write(flights.deposits, flights.impacts)


def deposit_lines_of(folder):
    with (folder / "deposits.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def in_input_axes(frame, x):
    """Return a local place (3,) m in the axes and coordinates of the input, without the code of `Frame`."""
    east, north, up = np.asarray(x) + np.array(frame.origin)
    return [east, north, up] if frame.up == "z" else [east, up, -north]


@pytest.fixture(params=FRAMES, ids=lambda frame: f"{frame.up}-up at {frame.origin[0]:.0f}")
def terrain(request):
    return floor(request.param)


@pytest.fixture
def deposit_lines(terrain, tmp_path):
    write_tables(tmp_path, SOURCES, terrain, thrown(terrain))
    return deposit_lines_of(tmp_path)


def test_deposits_have_the_columns_of_the_design_and_a_line_a_rock(deposit_lines):
    assert list(deposit_lines[0]) == DEPOSIT_COLUMNS
    assert [(line["source"], line["rock"]) for line in deposit_lines] == [
        (source, str(rock)) for source in SOURCES for rock in range(3)
    ]


def test_deposits_lie_in_the_input_coordinates_to_the_last_bit(terrain, deposit_lines):
    for line, x in zip(deposit_lines, thrown(terrain).deposits.x, strict=True):
        assert [float(line[axis]) for axis in "xyz"] == in_input_axes(terrain.frame, x)


def test_deposits_say_how_each_rock_ended(terrain, deposit_lines):
    deposits = thrown(terrain).deposits
    assert [line["outcome"] for line in deposit_lines] == ["stopped"] * 5 + ["left_terrain"]
    for i, line in enumerate(deposit_lines):
        run = deposits.x[i] - deposits.release[i]
        assert float(line["runout_m"]) == pytest.approx(np.hypot(run[0], run[1]))
        assert float(line["max_energy_j"]) == pytest.approx(0.5 * MASS * float(line["max_speed"]) ** 2)
        assert float(line["t"]) == deposits.t[i]
        assert float(line["path_m"]) == 30.0
        assert int(line["impacts"]) == BOUNCES
        assert float(line["entered_ground_at_speed"]) == deposits.ground_speed[i]
        assert line["zone"] == ("floor" if deposits.x[i, 0] > 0 else "bench_1")


def test_deposits_say_how_heavy_and_large_each_rock_is_and_where_it_started(terrain, deposit_lines):
    for line, release in zip(deposit_lines, thrown(terrain).deposits.release, strict=True):
        assert float(line["mass_kg"]) == MASS
        assert DENSITY * math.pi / 6.0 * float(line["diameter_m"]) ** 3 == pytest.approx(MASS, rel=1e-12)
        assert [float(line[f"release_{axis}"]) for axis in "xyz"] == in_input_axes(terrain.frame, release)


def test_a_value_that_does_not_exist_is_left_empty(terrain, tmp_path):
    flights = thrown(terrain)
    flights.deposits.ground_speed[1], flights.deposits.facet[1] = np.nan, -1
    write_tables(tmp_path, SOURCES, terrain, flights)
    lines = deposit_lines_of(tmp_path)
    assert lines[0]["max_height"] == "" and lines[1]["max_height"] == "5"
    assert lines[1]["entered_ground_at_speed"] == "" and lines[1]["zone"] == ""


def test_impacts_are_written_one_a_line(terrain, tmp_path):
    flights = thrown(terrain)
    write_tables(tmp_path, SOURCES, terrain, flights)
    table = parquet.read_table(tmp_path / "impacts.parquet")
    rows, impacts = table.to_pylist(), flights.impacts
    assert table.column_names == IMPACT_COLUMNS
    assert [row["index"] for row in rows] == list(range(BOUNCES)) * 6
    assert [row["source"] for row in rows] == [SOURCES[0]] * 12 + [SOURCES[1]] * 12
    assert [row["rock"] for row in rows[12:]] == [0] * 4 + [1] * 4 + [2] * 4
    for i, row in enumerate(rows):
        assert [row[axis] for axis in "xyz"] == in_input_axes(terrain.frame, impacts.x[i])
        normal = [0, 0, 1] if terrain.frame.up == "z" else [0, 1, 0]
        assert [row[f"normal_{axis}"] for axis in "xyz"] == normal
        assert row["energy_in_j"] == pytest.approx(0.5 * MASS * impacts.speed_in[i] ** 2)
        assert (row["t"], row["facet"], row["speed_out"]) == (impacts.t[i], impacts.facet[i], impacts.speed_out[i])
        assert row["zone"] == terrain.zones[terrain.zone[impacts.facet[i]]]


def test_trajectories_are_written_one_point_a_line(terrain, tmp_path):
    flights = thrown(terrain)
    samples = sample_paths(flights.paths, [0, 4])
    write_trajectories(tmp_path / "t.parquet", SOURCES, terrain, flights.deposits, samples)
    table = parquet.read_table(tmp_path / "t.parquet")
    rows = table.to_pylist()
    assert table.column_names == TRAJECTORY_COLUMNS
    assert {(row["source"], row["rock"]) for row in rows} == {("crest", 0), ("ledge", 1)}
    assert {row["mode"] for row in rows} == {"flight", "settling", "sliding", "end"}
    for i, row in enumerate(rows):
        assert [row[axis] for axis in "xyz"] == in_input_axes(terrain.frame, samples.x[i])
        assert row["speed"] == pytest.approx(np.linalg.norm(samples.v[i]))


def test_the_schema_states_the_units(terrain, tmp_path):
    write_tables(tmp_path, SOURCES, terrain, thrown(terrain))
    schema = parquet.read_schema(tmp_path / "impacts.parquet")
    assert schema.field("energy_in_j").metadata[b"unit"] == b"J"
    assert schema.field("speed_in").metadata[b"unit"] == b"m/s"


def test_no_rocks_are_tables_without_lines(tmp_path):
    terrain, flights = floor(), none_thrown()
    write_tables(tmp_path, SOURCES, terrain, flights)
    write_trajectories(tmp_path / "t.parquet", SOURCES, terrain, flights.deposits, sample_paths(flights.paths))
    assert (tmp_path / "deposits.csv").read_text() == ",".join(DEPOSIT_COLUMNS) + "\n"
    assert parquet.read_table(tmp_path / "impacts.parquet").shape == (0, len(IMPACT_COLUMNS))
    assert parquet.read_table(tmp_path / "t.parquet").shape == (0, len(TRAJECTORY_COLUMNS))


def test_a_source_name_with_a_comma_and_a_quote_survives(tmp_path):
    terrain = floor()
    names = ['crest, "north"', json.dumps("ledge")]
    write_tables(tmp_path, names, terrain, thrown(terrain))
    assert {line["source"] for line in deposit_lines_of(tmp_path)} == set(names)


def test_blocks_follow_one_another_under_one_header(tmp_path):
    terrain = floor()
    one, other, whole = tmp_path / "one", tmp_path / "other", tmp_path / "whole"
    for folder, blocks in ((one, (6,)), (other, (9,)), (whole, (6, 9))):
        folder.mkdir()
        write_tables(folder, SOURCES, terrain, *(thrown(terrain, rocks) for rocks in blocks))
    assert deposit_lines_of(whole) == deposit_lines_of(one) + deposit_lines_of(other)
    rows = [parquet.read_table(folder / "impacts.parquet").to_pylist() for folder in (one, other, whole)]
    assert rows[2] == rows[0] + rows[1], "rows of the impacts count from the first rock of their block"


def test_without_impacts_there_is_no_table_of_them(tmp_path):
    write_tables(tmp_path, SOURCES, floor(), thrown(floor()), impacts=False)
    assert [path.name for path in tmp_path.iterdir()] == ["deposits.csv"]
