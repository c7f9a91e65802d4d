"""Divide the rocks of a run into rounds that fly one after another, or into parts for several workers."""

from collections.abc import Sequence
from itertools import count, pairwise, takewhile
from typing import NamedTuple

from rpf3d_core.ensemble.releases import share_out
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.cells import FIRST_ROUND


class Round(NamedTuple):
    """The rocks of one round or part: for each source, the number of its first rock and the number after its last."""

    first: Sequence[int]
    last: Sequence[int]

    @property
    def rocks(self) -> int:
        """The number of rocks that fly in the round, over all sources."""
        return sum(self.last) - sum(self.first)


def rounds_up_to(totals: Sequence[Sequence[int]]) -> list[Round]:
    """Return rounds from the totals after each round: after round i, each source has flown totals[i] rocks."""
    return [Round(first, last) for first, last in pairwise([[0] * len(totals[0]), *totals])]


def doubling_rounds(first: Sequence[int], most: int, least: int = 0) -> list[Round]:
    """Return rounds that each double the number of flown rocks, up to a total of `most` rocks.

    The first round has the counts of `first` even if their sum is above `most`, because a result needs at least one
    rock from each source. If their sum is below `least`, the second round raises the total to at least `least`, even
    above `most`: rounds between would give no usable result.
    """
    totals = [list(first)]
    if 0 < (flown := sum(first)) < least:
        totals.append([-(-n * least // flown) for n in first])
    while 2 * sum(totals[-1]) <= most:
        totals.append([2 * n for n in totals[-1]])
    return rounds_up_to(totals)


def growing_rounds(counts: Sequence[int], first: int) -> list[Round]:
    """Return rounds that each about double the number of flown rocks, from about `first` rocks to all.

    counts : number of rocks of each source; every round has rocks of each source in proportion
    """
    total = sum(counts)
    sizes = takewhile(lambda size: size < total, (first << k for k in count()))
    totals = [[-(-n * size // total) for n in counts] for size in sizes]
    return [each for each in rounds_up_to([*totals, list(counts)]) if each.rocks]


def rounds_of(scene: Scene, points: Sequence[int]) -> list[Round]:
    """Return the rounds of a run: one round of all rocks or, for `rocks: auto`, doubling rounds up to `most_rocks`.

    points : number of release points of each source, 1 for random places. The first round uses all points, so that its
        result does not depend on the first points only.
    """
    counts = [source.rocks for source in scene.sources]
    if scene.rocks != "auto":
        return rounds_up_to([counts])
    times = max(-(-FIRST_ROUND // sum(counts)), *(-(-p // n) for p, n in zip(points, counts, strict=True) if n))
    first, most = [n * times for n in counts], scene.target.most_rocks
    return doubling_rounds(first if sum(first) <= most else share_out(first, most), most)


def rounds_of_parts(counts: Sequence[int], parts: int) -> list[Round]:
    """Return the rocks of each part of a run: an equal share of every source's rocks.

    Parts without rocks are left out. counts : number of rocks of each source
    """
    totals = [[k * n // parts for n in counts] for k in range(1, parts + 1)]
    return [part for part in rounds_up_to(totals) if part.first != part.last]
