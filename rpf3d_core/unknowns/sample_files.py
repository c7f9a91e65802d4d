"""Write and read Parquet files with named columns of numbers, in which parameter sets are stored."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from numpy.typing import NDArray

from rpf3d_core.errors import InputError


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]], note: Mapping[str, str] | None = None) -> None:
    """Write columns of numbers as a Parquet file.

    columns : (N,) by name, all of equal length; note : texts by key, stored as metadata of the file
    """
    pa.parquet.write_table(pa.table(dict(columns)).replace_schema_metadata(dict(note or {})), path)


def read_note(path: Path) -> dict[str, str]:
    """Return the metadata of a Parquet file, as texts by key.

    Raises
    ------
    InputError
        The file is missing or is not a Parquet file.
    """
    try:
        found = pa.parquet.read_schema(path).metadata or {}
    except (OSError, pa.ArrowInvalid) as fault:
        raise InputError(f"{path}: cannot be read as a Parquet file: {fault}") from fault
    return {key.decode(errors="replace"): text.decode(errors="replace") for key, text in found.items()}


def read_columns(path: Path) -> dict[str, NDArray[np.float64]]:
    """Return the columns of numbers of a Parquet file by name, without columns of text.

    Raises
    ------
    InputError
        The file is missing or is not a Parquet file, or a value of a column of numbers is missing.
    """
    try:
        table = pa.parquet.read_table(path)
    except (OSError, pa.ArrowInvalid) as fault:
        raise InputError(f"{path}: cannot be read as a Parquet file: {fault}") from fault
    numbers = [field.name for field in table.schema if _is_number(field.type)]
    for name in numbers:
        if table[name].null_count:
            raise InputError(f"{path}: the column {name!r} has {table[name].null_count} rows without a value")
    return {name: table[name].to_numpy().astype(float) for name in numbers}


def _is_number(kind: pa.DataType) -> bool:
    """Return True if the values of a column of this type are numbers."""
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind))
