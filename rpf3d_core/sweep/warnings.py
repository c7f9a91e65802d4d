"""Warnings about a sweep: those of its runs, each once, and cells that flew too few parameter sets."""

import re
from collections.abc import Sequence

from rpf3d_core.sweep.cells import Cell
from rpf3d_core.sweep.figures import PREDICTIVE
from rpf3d_core.sweep.flying import Record
from rpf3d_core.unknowns.predictive import ENOUGH

NUMBER = re.compile(r"(?<![\w.])\d[\d,]*(\.\d+)?(?!\w)")
"""A number in a sentence that is not part of a name such as `berm_1`."""
NAMED = 5
"""Largest number of cells that a sentence names."""


def warnings_of_cells(cells: Sequence[Cell], records: Sequence[Record]) -> list[str]:
    """Return the warnings of all runs, each with the number of its cells, and cells with too few parameter sets."""
    return [*_each_once(cells, [record.warnings for record in records]), *_few_sets(cells, records)]


def surer_cells(cells: Sequence[Cell], records: Sequence[Record]) -> list[str]:
    """Return where the answers of runs are surer than they may be, each sentence with the number of its cells."""
    return _each_once(cells, [record.surer for record in records])


def _each_once(cells: Sequence[Cell], sentences: Sequence[Sequence[str]]) -> list[str]:
    """Return the distinct sentences of cells; sentences that differ in numbers only count as one.

    sentences : those of each cell
    """
    found = dict[str, list[tuple[Cell, str]]]()
    for cell, some in zip(cells, sentences, strict=True):
        for sentence in dict.fromkeys(some):
            found.setdefault(NUMBER.sub("#", sentence), []).append((cell, sentence))
    return [_with_number(alike, len(cells)) for alike in found.values()]


def _with_number(alike: Sequence[tuple[Cell, str]], of: int) -> str:
    """Return a sentence of some cells with the number of these cells, and the cell whose numbers it has."""
    (first, sentence), number = alike[0], len({cell.digest for cell, _ in alike})
    where = "" if len({text for _, text in alike}) == 1 else f", numbers of {first.describe()}"
    return f"{number} of {of} cells{where}: {sentence}"


def _few_sets(cells: Sequence[Cell], records: Sequence[Record]) -> list[str]:
    """Return a sentence that names cells with a predictive interval but too few parameter sets for 95 %, if any."""
    few = [
        f"{cell.describe()} ({record.sets})"
        for cell, record in zip(cells, records, strict=True)
        if record.sets is not None and record.sets < ENOUGH
        and any(figure.interval == PREDICTIVE for figure in record.figures)
    ]  # fmt: skip
    if not few:
        return []
    more = f"; and {len(few) - NAMED:,} more" if len(few) > NAMED else ""
    return [f"fewer than {ENOUGH} parameter sets have flown in the cells {'; '.join(few[:NAMED])}{more}: their "
            "predictive intervals hold less than 95 %; fly more rocks"]  # fmt: skip
