"""Warnings about a sweep: each warning of its runs once, too few parameter sets, and places that do not move."""

import re
from collections.abc import Iterator, Sequence

from rpf3d_core.scene.key_paths import Steps, steps_to
from rpf3d_core.scene.model import Scene
from rpf3d_core.sweep.cells import Cell
from rpf3d_core.sweep.flying import CellRecord
from rpf3d_core.unknowns.predictive import ENOUGH

NUMBER = re.compile(r"(?<![\w.])\d[\d,]*(\.\d+)?(?!\w)")
"""A number in a sentence that is not part of a name such as `berm_1`."""
MOVING = ("height", "face_angle_deg", "berm", "number")
"""Keys of `terrain.benches` that move the faces and berms below the uppermost edge."""
NAMED = 5
"""Largest number of cells that a sentence names."""


def warnings_of_cells(cells: Sequence[Cell], records: Sequence[CellRecord]) -> list[str]:
    """Return the warnings of a sweep: each warning of its runs once, and warnings about the sweep as a whole.

    A warning of runs begins with the number of cells whose runs gave this warning.
    """
    of_runs = _each_once(cells, [record.warnings for record in records])
    return [*of_runs, *_few_sets(cells, records), *places_that_stay(cells)]


def surer_cells(cells: Sequence[Cell], records: Sequence[CellRecord]) -> list[str]:
    """Return the reasons why results of a sweep may look too certain, each with the number of cells concerned."""
    return _each_once(cells, [record.surer for record in records])


def _each_once(cells: Sequence[Cell], sentences: Sequence[Sequence[str]]) -> list[str]:
    """Return the distinct sentences of cells, each with the number of cells that have the sentence.

    Sentences that differ only in numbers count as one sentence.

    sentences : sentences of each cell
    """
    found = dict[str, list[tuple[Cell, str]]]()
    for cell, some in zip(cells, sentences, strict=True):
        for sentence in dict.fromkeys(some):
            found.setdefault(NUMBER.sub("#", sentence), []).append((cell, sentence))
    return [_with_number(alike, len(cells)) for alike in found.values()]


def _with_number(alike: Sequence[tuple[Cell, str]], of: int) -> str:
    """Return a sentence of several cells, with the number of these cells.

    If the sentences of the cells differ in numbers, the result names the cell whose numbers are shown.
    alike : cells with their sentences, which differ in numbers only; of : number of all cells
    """
    (first, sentence), number = alike[0], len({cell.digest for cell, _ in alike})
    where = "" if len({text for _, text in alike}) == 1 else f" (the numbers are those of {first.describe()})"
    return f"{number} of {of} cells{where}: {sentence}"


def _few_sets(cells: Sequence[Cell], records: Sequence[CellRecord]) -> list[str]:
    """Return a list with a sentence that names cells with too few parameter sets for predictive intervals, or []."""
    few = [
        f"{cell.describe()} ({record.sets})"
        for cell, record in zip(cells, records, strict=True)
        if record.sets is not None and record.sets < ENOUGH
    ]
    if not few:
        return []
    more = f"; and {len(few) - NAMED:,} more" if len(few) > NAMED else ""
    return [f"fewer than {ENOUGH} parameter sets have flown in the cells {'; '.join(few[:NAMED])}{more}: their "
            "intervals cover the number of rocks only, not the unknown ground; fly more rocks"]  # fmt: skip


def places_that_stay(cells: Sequence[Cell]) -> list[str]:
    """Return a list with a sentence on places that keep their coordinates while a varied key moves the slope.

    The list is empty if there are no such places.
    """
    scene = cells[0].scene
    moving = [key for key in cells[0].values if any(map(_moves_benches, steps_to(scene, key)))]
    if scene.terrain.benches is None or not moving or not (places := list(_places_of(scene))):
        return []
    more = f" and {len(places) - NAMED} more" if len(places) > NAMED else ""
    return [f"`{moving[0]}` moves the slope, but these keep their coordinates in all cells: {', '.join(places[:NAMED])}"
            f"{more}; compare cells only where they lie on the same part of the slope"]  # fmt: skip


def _moves_benches(steps: Steps) -> bool:
    """Return True if a key may move the faces and berms of a slope of benches (`terrain.benches`).

    Such keys are `height`, `face_angle_deg`, `berm` and `number` of `terrain.benches` (MOVING), and the whole sections
    `terrain` and `terrain.benches`.

    steps : the place of the key in the scene, from the outermost key to the innermost
    """
    return any(steps == ("terrain", "benches", key)[: len(steps)] for key in MOVING)


def _places_of(scene: Scene) -> Iterator[str]:
    """Yield the names of the parts of a scene that have coordinates on its terrain."""
    yield from (f"area {area.name}" for area in scene.areas_of_interest)
    barriers = scene.effects.barriers
    yield from () if barriers is None else (f"barrier {panel.name}" for panel in barriers.panels)
    yield from (f"windrow {berm.name}" for berm in scene.terrain.berms)
    yield from (f"zone {spec.zone}" for spec in scene.zones)
    yield from (f"source {source.name}" for source in scene.sources if source.crest is None and source.zone is None)
