"""Make the part of a report on distances beyond the toe: of all rocks, of the worst source, and of each source."""

from collections.abc import Iterator

import numpy as np

from rpf3d_core.report.barriers_part import BOTH
from rpf3d_core.report.elements import Element, Heading, Table, Text
from rpf3d_core.report.fences_part import from_source, too_few_toes, with_barriers
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.source_toes import SourceToes, farthest
from rpf3d_core.report.toe import DESIGN, BeyondToe, held_beyond
from rpf3d_core.report.words import figure_cells, metres
from rpf3d_core.terrain.faces import LOWEST, STEEP

HELD = (50, 75, 90, 95)
"""Percentages of the rocks; for each, a report states the distance beyond the toe within which this share stops."""
MOST_SOURCES = 12
"""Largest number of sources in the table of distances; more sources do not fit a page."""
OF_WORST = (
    "A row with a source counts the rocks from this source only, because clearly more of them stop farther than this "
    "distance of all rocks together."
)
"""Note under the table of a scene with several sources."""


def further_faces(beyond: BeyondToe) -> list[Element]:
    """Return a sentence on the rocks that went down a further face below the first one; [] without such rocks."""
    further = int(beyond.further.sum())
    if not further:
        return []
    return [Text(f"{further:,} of {len(beyond.rows):,} rocks went down a further face below the first one. Their "
                 "distance from the toe of the first face includes berms and those faces: it is a distance from the "
                 "upper bench, and not one from the toe of the wall.")]  # fmt: skip


def distances_part(run: RunFiles, toes: SourceToes) -> Iterator[Element]:
    """Yield the table of the distances beyond the toe within which 50, 75, 90 and 95 % of the rocks stop.

    With several sources, each distance is that of the source whose rocks stop clearly farther than all rocks, if there
    is one; a second table has the distances of the sources. If too few of all rocks have a toe, a sentence states this.
    The tables then follow only if enough rocks of a source have a toe.
    """
    beyond, far = toes.together, {p: farthest(toes, p) for p in HELD}
    yield Heading("Distance from the toe")
    if not beyond.enough:
        yield Text(too_few_toes(beyond))
    if beyond.enough or toes.enough:
        yield Table(
            ("holds", "value", *BOTH),
            [[f"{p} % of the rocks{from_source(toes.name_of(number))}",
              *figure_cells(held_beyond(toes.of_source(number), run.sets, p), metres)] for p, number in far.items()],
        )  # fmt: skip
        yield from _of_sources(run, toes)
    if not beyond.enough:
        return
    yield from with_barriers(run)
    yield from further_faces(beyond)
    yield Text("Horizontal distance from the foot of the first face below the release to the end of the rock, along "
               f"the rock's way in plan. A face is steeper than {STEEP:g} degrees and at least {LOWEST:g} m high. "
               f"Of {len(beyond.rows):,} rocks.",
               quiet=True)  # fmt: skip


def _of_sources(run: RunFiles, toes: SourceToes) -> Iterator[Element]:
    """Yield the table of the distances within which 90 % of the rocks of each source stop, the largest first.

    The table has at most MOST_SOURCES (12) sources. Nothing is yielded for a single source, or if no source has enough
    rocks with a toe.
    """
    if not toes.enough:
        return
    distances = zip(toes.enough, toes.distances, strict=True)
    far = sorted((-float(np.percentile(distance, DESIGN)), number) for number, distance in distances)
    each = {number: toes.of_source(number) for _, number in far[:MOST_SOURCES]}
    yield Table((f"source: holds {DESIGN} %", "rocks", "value", *BOTH), [
        [toes.names[number], f"{len(own.rows):,}", *figure_cells(held_beyond(own, run.sets, DESIGN), metres)]
        for number, own in each.items()
    ])  # fmt: skip
    left, few = len(far) - MOST_SOURCES, len(toes.names) - len(far)
    more = f" {left:,} more sources have smaller distances." if left > 0 else ""
    none = f" Of {few:,} source{'s' if few > 1 else ''}, too few rocks have a face below their release." if few else ""
    yield Text(f"{OF_WORST}{more}{none}", quiet=True)
