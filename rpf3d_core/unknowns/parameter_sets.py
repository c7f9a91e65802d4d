"""Parameter sets: the values that several parameters of a scene have together, one row for each set."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.unknowns.places import Surroundings

FloatArray = NDArray[np.float64]

WEIGHT = "weight"
"""Column with the weights in a file of parameter sets."""
PLACE = "rpf3d_calibrated_in"
"""Key, in the metadata of a file of parameter sets, of the place of calibration: west, south, east, north (m)."""


@dataclass(frozen=True, eq=False)
class ParameterSets:
    """S parameter sets of U parameters; `parameter_sets` makes them, with arrays that cannot be changed.

    names : key paths of the parameters in a scene (`scene.key_paths`)
    values : (S, U) in the units of the scene file; weights : (S,) >= 0, summing to 1; None if all weights are equal
    place : where the sets were calibrated; None if this is unknown
    """

    names: tuple[str, ...]
    values: FloatArray
    weights: FloatArray | None = None
    place: Surroundings | None = None

    def __len__(self) -> int:
        """Return the number of sets."""
        return len(self.values)

    @property
    def shares(self) -> FloatArray:
        """The weights (S,) of the sets, which sum to 1, also if all weights are equal."""
        return np.full(len(self), 1.0 / len(self)) if self.weights is None else self.weights

    def at(self, number: int) -> dict[str, float]:
        """Return the values of one set by key path, as `scene.key_paths.with_values` needs them; number : from 0."""
        return dict(zip(self.names, self.values[number].tolist(), strict=True))


def parameter_sets(names: Sequence[str], values: ArrayLike, weights: ArrayLike | None = None) -> ParameterSets:
    """Check names, values and weights, and return them as parameter sets.

    The arrays of the result are copies that cannot be changed. The weights are scaled so that their sum is 1; equal
    weights become None.

    names : U key paths, all different; values : (S, U); weights : (S,) >= 0, or None if all sets have the same weight

    Raises
    ------
    InputError
        There is no set or no parameter, a name appears twice, shapes do not fit, a value is not finite, a weight is
        negative or not finite, or all weights are 0.
    """
    array = np.array(values, dtype=float)
    if array.ndim != 2 or array.shape[1] != len(names) or not array.size:
        raise InputError(f"parameter sets need one column for each of {len(names)} names and at least one row, "
                         f"but have the shape {array.shape}")  # fmt: skip
    if twice := sorted({name for name in names if list(names).count(name) > 1}):
        raise InputError(f"the parameter {twice[0]!r} appears twice; each parameter has one column")
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise InputError(f"the parameter {names[column]!r} of set {row} is {array[row, column]}, not a finite number")
    array.flags.writeable = False
    return ParameterSets(names=tuple(names), values=array, weights=_checked(weights, len(array)))


def _checked(weights: ArrayLike | None, sets: int) -> FloatArray | None:
    """Return weights (S,) scaled so that their sum is 1; None if all weights are equal or none are given.

    Raise InputError if there is not one finite weight >= 0 for each set, or all weights are 0.

    sets : number of sets, S
    """
    if weights is None:
        return None
    array = np.array(weights, dtype=float)
    if array.shape != (sets,) or not np.isfinite(array).all() or (array < 0.0).any() or not array.any():
        raise InputError(f"the weights must be {sets} numbers >= 0, one for each parameter set, and not all 0")
    if (array == array[0]).all():
        return None
    array /= array.sum()
    array.flags.writeable = False
    return array


def write_parameter_sets(path: str | Path, sets: ParameterSets, more: Mapping[str, ArrayLike] | None = None) -> None:
    """Write parameter sets as a Parquet file: a column for each key path, and a column `weight` if the weights differ.

    The file also stores the place at which the sets were calibrated, if it is known.

    more : further columns (S,) by name, such as a likelihood; `read_parameter_sets` ignores columns whose name has no
        dot and is neither `stop_speed` nor `weight`
    """
    from rpf3d_core.unknowns.sample_files import write_columns

    columns = {name: sets.values[:, i] for i, name in enumerate(sets.names)}
    weights = {} if sets.weights is None else {WEIGHT: sets.weights}
    further = {name: np.asarray(values) for name, values in (more or {}).items()}
    note = {} if sets.place is None else {PLACE: " ".join(f"{end:.3f}" for end in sets.place)}
    write_columns(Path(path), columns | weights | further, note)


def read_parameter_sets(path: str | Path) -> ParameterSets:
    """Return the parameter sets in a Parquet file.

    A column is a parameter if its name is a key path: `stop_speed`, or a name with a dot. The column `weight` is
    optional. All other columns are ignored.

    Raises
    ------
    InputError
        The file cannot be read, no column is a parameter, a column of numbers lacks a value, or the content is refused
        as in `parameter_sets`; the message names the file.
    """
    from rpf3d_core.unknowns.sample_files import read_columns

    columns = read_columns(Path(path))
    names = [name for name in columns if name != WEIGHT and (name == "stop_speed" or "." in name)]
    if not names:
        raise InputError(f"{path}: has no column whose name is a key path, such as materials.gray.friction; "
                         f"the columns are {', '.join(columns)}")  # fmt: skip
    try:
        sets = parameter_sets(names, np.stack([columns[name] for name in names], axis=1), columns.get(WEIGHT))
    except InputError as fault:
        raise InputError(f"{path}: {fault}") from None
    return replace(sets, place=read_place(path))


def read_place(path: str | Path) -> Surroundings | None:
    """Return the place where the parameter sets in a Parquet file were calibrated; None if the file does not state it.

    Raises
    ------
    InputError
        The file cannot be read; the message names the file.
    """
    from rpf3d_core.unknowns.sample_files import read_note

    return _place_of(read_note(Path(path)).get(PLACE))


def _place_of(note: str | None) -> Surroundings | None:
    """Return the rectangle in plan in which a sample was calibrated, read from the note in the sample's file.

    note : west, south, east and north (m), separated by blanks; the result is None if the file has no such note, or if
        the note does not consist of four numbers
    """
    try:
        west, south, east, north = map(float, (note or "").split())
    except ValueError:
        return None
    return Surroundings(west=west, south=south, east=east, north=north)
