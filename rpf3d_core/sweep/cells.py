"""The cells of a sweep: one scene for each combination of the values of its keys."""

from collections.abc import Mapping, Sequence
from itertools import product
from math import prod
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import filled_in, scene_digest
from rpf3d_core.setup.choices import Rocks, with_choices
from rpf3d_core.sweep.overridden import ROCKS, check_libraries, check_priors, check_rocks, check_samples
from rpf3d_core.sweep.varied import Varied, check_varied

MOST_CELLS = 10_000
"""Largest number of cells of a sweep."""
NAME = 16
"""Number of digits of a digest that name a cell's folder."""
LEFT_OUT: Mapping[str, bool] = {"pictures": False, "recording": False, "impacts": False}
"""Outputs that cells do not write, because they take longer than the flight."""


class Cell(NamedTuple):
    """One cell of a sweep: the values of the varied keys, by key path, its scene, and the digest of scene and files."""

    values: Mapping[str, Any]
    scene: Scene
    digest: str

    @property
    def name(self) -> str:
        """The name of the cell's folder."""
        return self.digest[:NAME]

    def describe(self) -> str:
        """Return the values of the keys as text, for messages."""
        return ", ".join(f"{key} {value_text(value)}" for key, value in self.values.items())


def value_text(value: Any) -> str:
    """Return a value of a key as text in the notation of a scene file, such as `{mean: 1, sd: 0.1}`."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {value_text(item)}" for key, item in value.items()) + "}"
    return f"[{', '.join(map(value_text, value))}]" if isinstance(value, list | tuple) else str(value)


def cells_of(scene: Scene, varied: Sequence[Varied], rocks: Rocks = None) -> list[Cell]:
    """Return the cells of a sweep: the full grid of all values; the value of the last key changes fastest.

    The scene of a cell is the scene that results if the user writes the values of the cell into the scene file.

    scene : the scene as its file states it; varied : keys with their values
    rocks : number of rocks of each cell, or "auto"; None for the setting of the scene

    Raises
    ------
    InputError
        The keys and values are refused by `check_varied`, a key path leads nowhere, a value or the number of rocks is
        refused, a varied key has no effect (`sweep.overridden`), there are too many cells, or two cells are the same
        run.
    """
    check_varied(varied)
    number = prod(len(one.values) for one in varied)
    if number > MOST_CELLS:
        raise InputError(f"the sweep has {number:,} cells, and {MOST_CELLS:,} is the most; give fewer values")
    plain = scene.model_copy(update={"outputs": scene.outputs.model_copy(update=LEFT_OUT)})
    keys = [one.key for one in varied]
    if rocks is not None and ROCKS in keys:
        raise InputError(f"`{ROCKS}` is varied, and the number of rocks of each cell is given too; give one of them")
    cells = [
        _cell(plain, dict(zip(keys, values, strict=True)), rocks) for values in product(*(one.values for one in varied))
    ]  # fmt: skip
    check_rocks(scene, keys, [cell.scene.rocks for cell in cells])
    check_libraries((cell.scene for cell in cells), keys)
    check_priors(plain, keys)
    check_samples((cell.scene for cell in cells), keys)
    _refuse_same_runs(cells)
    return cells


def _cell(scene: Scene, values: Mapping[str, Any], rocks: Rocks) -> Cell:
    made = with_choices(filled_in(with_values(scene, values)), rocks, None, None)
    return Cell(values=values, scene=made, digest=scene_digest(made))


def _refuse_same_runs(cells: Sequence[Cell]) -> None:
    """Refuse two cells of equal scenes: a value is given twice, or a key has no effect on a run."""
    first: dict[str, Cell] = {}
    for cell in cells:
        other = first.setdefault(cell.digest, cell)
        if other is not cell:
            raise InputError(f"two cells are the same run: {other.describe()}; and {cell.describe()}")


def are_alike(cells: Sequence[Cell]) -> bool:
    """Return True if all cells have the same seed, so that their rocks are drawn from the same random numbers."""
    return len({cell.scene.seed for cell in cells}) == 1
