"""Choose the rocks of a round of parameter sets, so that a few rocks represent all sources and release points.

A calibration flies few rocks for each parameter set, and other rocks in each round. Sources and release points have an
order, such as along a crest: the first rocks alone would represent one end of the crest.
"""

from collections.abc import Sequence

import numpy as np

from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.ensemble.releases import Source, share_out

SOURCE_STEP, POINT_STEP = 0.7548776662466927, 0.5698402909980532
"""Shifts (-) of the sampling of sources, and of release points, from one round to the next.

A shift is a share of the distance between two samples. Successive pairs of shifts fill the unit square evenly.
Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences": powers of the plastic number.
"""
BETWEEN_SOURCES = 0.6180339887498949
"""Shift (-) of the sampling of release points from one source to the next, so that similar sources use other points."""
EVEN_TURNS = 8
"""Smallest number of rocks per release point (-) at which a source uses its points in turn, without sampling.

The numbers of rocks of two points then differ by at most one rock, that is by at most 1/8.
"""


def rocks_of_round(sources: Sequence[Source], total: int, number: int) -> list[range | IntArray]:
    """Return, for each source, the numbers (N,) of the rocks that the source releases in a round.

    The rocks of the round are shared out in proportion to the sources' own numbers of rocks. The rocks of a source are
    spread evenly over its points. If there are too few rocks for all sources or points, each round uses other sources
    or points. No rock flies in two rounds.

    total : number of rocks of a round, over all sources; number : number of the round, from 0
    """
    counts, most = _counts(sources, total, number)
    each = enumerate(zip(sources, counts, most, strict=True))
    return [_of_source(source, count, largest, number, place) for place, (source, count, largest) in each]


def is_spread(sources: Sequence[Source], total: int) -> bool:
    """Return True if the rocks of a round are selected to be evenly spread over the sources and their points.

    False if the round flies the next rocks of each source, because there are enough rocks for all sources and points.

    total : number of rocks of a round
    """
    rocks = [source.rocks for source in sources]
    chosen = rocks_of_round(sources, total, 0)
    return _too_few(share_out(rocks, total), rocks) or any(isinstance(its, np.ndarray) for its in chosen)


def every_point(sources: Sequence[Source]) -> list[range]:
    """Return, for each source, the numbers of its first rocks: as many rocks as the source has release points.

    A source with random places (line or area) counts as one release point.
    """
    return [range(_points(source)) for source in sources]


def sources_left_out(sources: Sequence[Source], total: int, rounds: int) -> list[str]:
    """Return the names of the sources that release no rock in the first `rounds` rounds, although they have rocks.

    total : number of rocks of a round
    """
    flown = np.sum([_counts(sources, total, number)[0] for number in range(rounds)], axis=0)
    return [source.name for source, count in zip(sources, flown, strict=True) if source.rocks and not count]


def words_on_left_out(sources: Sequence[Source], total: int, rounds: int, key: str) -> list[str]:
    """Return a list with one sentence if some sources release no rock in the first `rounds` rounds, else an empty list.

    total : number of rocks of a round; rounds : number of rounds
    key : name of the key or option that sets `total`, for the sentence
    """
    names = sources_left_out(sources, total, rounds)
    if not names:
        return []
    which = f"{len(names):,} of {len(sources):,} sources flew no rock, such as {names[0]!r}"
    return [f"{which}: a parameter set has {total:,} rocks; give more {key}, or join sources"]


def _counts(sources: Sequence[Source], total: int, number: int) -> tuple[list[int], list[int]]:
    """Return two lists: each source's number of rocks in a round, and each source's largest number in any round.

    If there are too few rocks for all sources, the rocks are spaced evenly along the list of sources (systematic
    sampling), and each round begins at another place of the list.

    total : number of rocks of a round; number : number of the round, from 0
    """
    rocks = [source.rocks for source in sources]
    fixed = share_out(rocks, total)
    if not _too_few(fixed, rocks):
        return fixed, fixed
    whole = sum(rocks)
    begin = int(_place(number * SOURCE_STEP) * whole)
    edges = (np.cumsum([0, *rocks]) * total + begin) // whole  # whole numbers, so that no rounding loses a rock
    return [int(count) for count in np.diff(edges)], [-(-its * total // whole) for its in rocks]


def _too_few(counts: Sequence[int], rocks: Sequence[int]) -> bool:
    """Return True if a round has no rock of a source that has rocks.

    counts : rocks of each source in the round; rocks : rocks of each source in the scene
    """
    return any(its and not count for count, its in zip(counts, rocks, strict=True))


def _points(source: Source) -> int:
    """Return the number of release points of a source; 1 for a source with random places (line or area)."""
    return 1 if source.line or source.triangles is not None else len(source.points)


def _of_source(source: Source, count: int, most: int, number: int, place: int) -> range | IntArray:
    """Return the numbers of the rocks that a source releases in a round.

    count : number of these rocks; most : largest number of rocks of this source in any round
    number : number of the round, from 0; place : index of the source
    """
    points = _points(source)
    if most >= EVEN_TURNS * points or points == 1:
        return range(number * most, number * most + count)
    whole, rest = divmod(count, points)
    first = number * -(-most // points) * points  # rock k starts at point k % points: this rock at point 0
    at = _place(number * POINT_STEP + place * BETWEEN_SOURCES)
    spread = ((np.arange(rest) + at) * points / max(rest, 1)).astype(np.int64)
    return np.concatenate([np.arange(whole * points), whole * points + spread]) + first


def _place(steps: float) -> float:
    """Return the position of the first of several evenly spaced samples, as a share (-) of their spacing, 0 to 1.

    steps : shift (-) from the middle, 0.5; the result is 0.5 + steps, modulo 1
    """
    return (0.5 + steps) % 1.0
