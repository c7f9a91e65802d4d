"""Find the distances beyond the toe for each source, and the source whose rocks stop clearly farther than all rocks.

Many rocks of a harmless source hide the rocks of a dangerous source in the distances of all rocks together. The rule
that selects a source is that of the bench table (`hazard.by_source.worst`).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.hazard.by_source.worst import ALL, Counts, clearly_above
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.toe import (
    FEWEST_WITH_TOE,
    MOST_ROCKS,
    BeyondToe,
    beyond_toe,
    enough_with_toe,
    evenly_spread,
    rows_of_sources,
)


class SourceToes(NamedTuple):
    """The distances beyond the toe of all rocks together, and of the rocks of each of N sources.

    names : (N,) of the sources; together : of all rocks
    known : of all rocks whose toe was searched: those of `together`, and further rocks of each source
    of : (N,) number of rocks of each source whose toe was searched
    """

    names: tuple[str, ...]
    together: BeyondToe
    known: BeyondToe
    of: NDArray[np.int64]

    def of_source(self, number: int) -> BeyondToe:
        """Return the distances of the rocks of one source; of all rocks together for ALL; number : of the source."""
        if number == ALL:
            return self.together
        return self.known.select(self.known.source == number, int(self.of[number]))

    def name_of(self, number: int) -> str:
        """Return the name of a source; "" for ALL; number : of the source."""
        return "" if number == ALL else self.names[number]

    @property
    def enough(self) -> list[int]:
        """The numbers of the sources with enough rocks that have a toe to state distances; [] for a single source."""
        if len(self.names) < 2:
            return []
        count = np.bincount(self.known.source, minlength=len(self.names))
        return np.flatnonzero((count >= FEWEST_WITH_TOE) & enough_with_toe(count, self.of)).tolist()

    @property
    def distances(self) -> list[FloatArray]:
        """The distances beyond the toe of the rocks of each source in `enough`: a list of arrays (n,) m for n rocks."""
        found = {int(self.known.source[mine[0]]): mine for mine in rows_of_sources(self.known.source)}
        return [self.known.distance[found[number]] for number in self.enough]


def source_toes(run: RunFiles) -> SourceToes:
    """Return the distances beyond the toe of all rocks and of each source.

    At most MOST_ROCKS (100,000) rocks are selected evenly from all rocks. With several sources, at most as many more
    are selected: the same number from each source.
    """
    names = run.sources
    if len(names) < 2:
        beyond = beyond_toe(run)
        return SourceToes(names, beyond, beyond, np.array([beyond.of]))
    even = evenly_spread(len(run.ends.runout), MOST_ROCKS)
    most = max(MOST_ROCKS // len(names), 1)
    each = [mine[evenly_spread(len(mine), most)] for mine in rows_of_sources(run.ends.source)]
    rows = np.unique(np.concatenate([even, *each]))
    known = beyond_toe(run, rows)
    of = np.bincount(run.ends.source[rows], minlength=len(names))
    return SourceToes(names, known.select(np.isin(known.rows, even), len(even)), known, of)


def farthest(toes: SourceToes, wanted: int) -> int:
    """Return the number of the source whose rocks stop clearly farther from the toe than all rocks; ALL if none does.

    The rocks of a source stop clearly farther if clearly more of them pass the distance within which `wanted` % of all
    rocks stop. Of several such sources, the source whose own rocks have the largest distance is selected. If too few of
    all rocks have a toe, the source with the largest distance is selected among all sources in `enough`.

    wanted : a percentage of the rocks, such as 90
    """
    numbers, all_rocks = toes.enough, toes.together.distance
    if not numbers:
        return ALL
    each = toes.distances
    far = np.array([float(np.percentile(distance, wanted)) for distance in each])
    if toes.together.enough:
        limit = float(np.percentile(all_rocks, wanted))
        over, of = ([len(distance[distance > end]) for distance in each] for end in (limit, -np.inf))
        counts = Counts(
            each=np.array(over)[:, None], each_of=np.array(of)[:, None], all=np.array([(all_rocks > limit).sum()]),
            all_of=np.array([len(all_rocks)]),
        )  # fmt: skip
        far = np.where(clearly_above(counts)[:, 0], far, -np.inf)
    return numbers[int(far.argmax())] if far.max() > -np.inf else ALL
