"""Tests that benches.csv contains the bench table unchanged."""

import csv

import pytest
from flights.flights_on_a_floor import floor
from hazards.hazard_layers import lines_of_rocks, maps_of

from rpf3d_core.hazard.benches import bench_table
from rpf3d_core.results.hazard_files.benches_csv import write_benches


def test_every_row_comes_back_with_its_shares_intervals_and_energy(tmp_path):
    points = lines_of_rocks(floor())
    areas = [("ramp, upper", points.plan[:, 0] > 5.0), ("nowhere", points.plan[:, 0] > 1e6)]
    table = bench_table(floor(), maps_of(floor(), points, 2.0, areas))
    write_benches(tmp_path / "benches.csv", table)
    with (tmp_path / "benches.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [(line["kind"], line["name"]) for line in lines] == [(row.kind, row.name) for row in table]
    for line, row in zip(lines, table, strict=True):
        for name in ("reached", "stopped", "retained"):
            share = getattr(row, name)
            assert int(line[f"{name}_rocks"]) == share["rocks"]
            if share["share"] is None:
                assert line[f"{name}_share"] == line[f"{name}_low"] == line[f"{name}_high"] == ""
            else:
                told = [float(line[f"{name}_{part}"]) for part in ("share", "low", "high")]
                assert told == [share["share"], *share["interval_95"]]
        assert line["energy_p95_j"] == ("" if row.energy_p95 is None else str(row.energy_p95))
    assert lines[0]["energy_p95_j"] and lines[-1]["name"] == "nowhere" and not lines[-1]["energy_p95_j"]


def test_a_table_that_cannot_be_written_is_an_error(tmp_path):
    with pytest.raises(OSError):
        write_benches(tmp_path / "nowhere" / "benches.csv", [])
