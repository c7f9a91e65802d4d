"""Tests that parameter sets are checked, immutable, and unchanged after writing and reading a file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rpf3d_core.errors import InputError
from rpf3d_core.unknowns.parameter_sets import PLACE, parameter_sets, read_parameter_sets, write_parameter_sets
from rpf3d_core.unknowns.places import Surroundings
from rpf3d_core.unknowns.sample_files import write_columns

NAMES = ("materials.a.friction", "stop_speed")
VALUES = np.array([[0.5, 0.2], [0.7, 0.1], [1 / 3, 0.3]])


@pytest.mark.parametrize("weights", [None, [1.0, 2.0, 5.0]])
def test_a_file_gives_back_the_sets_bit_for_bit(tmp_path: Path, weights: list[float] | None) -> None:
    sets = parameter_sets(NAMES, VALUES, weights)
    write_parameter_sets(tmp_path / "sample.parquet", sets, {"log_likelihood": [-1.0, -2.0, -3.0]})
    back = read_parameter_sets(tmp_path / "sample.parquet")
    assert back.names == NAMES
    assert back.values.tobytes() == VALUES.tobytes()
    assert back.shares.tolist() == sets.shares.tolist()
    assert back.at(2) == {"materials.a.friction": 1 / 3, "stop_speed": 0.3}


def test_weights_are_made_to_sum_to_one_and_equal_weights_are_none() -> None:
    assert parameter_sets(NAMES, VALUES, [1, 2, 5]).shares.tolist() == [0.125, 0.25, 0.625]
    assert parameter_sets(NAMES, VALUES, [2, 2, 2]).weights is None
    assert len(parameter_sets(NAMES, VALUES)) == 3


def test_the_arrays_are_copies_that_cannot_be_changed() -> None:
    given = VALUES.copy()
    sets = parameter_sets(NAMES, given, [1, 2, 5])
    given[0, 0] = 99.0
    assert sets.values[0, 0] == 0.5
    assert sets.weights is not None
    for array in (sets.values, sets.weights):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize(
    ("names", "values", "weights", "message"),
    [
        (NAMES, VALUES[:, :1], None, "one column for each of 2 names"),
        (NAMES, VALUES[:0], None, "at least one row"),
        (("a.b", "a.b"), VALUES, None, "'a.b' appears twice"),
        (NAMES, np.where(VALUES == 0.1, np.nan, VALUES), None, "'stop_speed' of set 1 is nan"),
        (NAMES, VALUES, [1.0, 2.0], "3 numbers >= 0"),
        (NAMES, VALUES, [1.0, -2.0, 1.0], "3 numbers >= 0"),
        (NAMES, VALUES, [0.0, 0.0, 0.0], "not all 0"),
    ],
)
def test_wrong_sets_are_refused(
    names: tuple[str, ...], values: np.ndarray, weights: list[float] | None, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        parameter_sets(names, values, weights)


def test_a_wrong_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read as a Parquet file"):
        read_parameter_sets(tmp_path / "none.parquet")
    (tmp_path / "text.parquet").write_text("no table")
    with pytest.raises(InputError, match=r"text\.parquet: cannot be read"):
        read_parameter_sets(tmp_path / "text.parquet")
    write_columns(tmp_path / "other.parquet", {"depth": np.ones(2)})
    with pytest.raises(InputError, match="no column whose name is a key path"):
        read_parameter_sets(tmp_path / "other.parquet")


def test_the_place_of_a_calibration_is_kept_in_the_file(tmp_path: Path) -> None:
    sets = parameter_sets(["materials.a.friction"], [[0.3], [0.4]])
    write_parameter_sets(tmp_path / "nowhere.parquet", sets)
    assert read_parameter_sets(tmp_path / "nowhere.parquet").place is None
    place = Surroundings(west=501_234.5, south=7_000_000.25, east=501_300.0, north=7_000_090.0)
    write_parameter_sets(tmp_path / "there.parquet", replace(sets, place=place))
    assert read_parameter_sets(tmp_path / "there.parquet").place == place


def test_other_notes_of_a_file_are_no_place(tmp_path: Path) -> None:
    pq.write_table(
        pa.table({"materials.a.friction": [0.3]}).replace_schema_metadata({PLACE: "here and there"}),
        tmp_path / "odd.parquet",
    )
    assert read_parameter_sets(tmp_path / "odd.parquet").place is None
