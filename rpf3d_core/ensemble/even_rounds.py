"""Choose the rocks of a round of parameter sets, so that a few rocks stand for all sources and release points.

A calibration flies few rocks for each parameter set, and other rocks in each round. Sources and release points have an
order, such as along a crest: the first rocks alone would stand for one end of the crest.
"""

from collections.abc import Sequence

import numpy as np

from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.ensemble.releases import Source, share_out

SOURCE_STEP, POINT_STEP = 0.7548776662466927, 0.5698402909980532
"""Steps (-) of the places of successive rounds between two rocks: the two-dimensional sequence with the evenest gaps.

Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences": powers of the plastic number.
"""
BETWEEN_SOURCES = 0.6180339887498949
"""Step (-) of the places of successive sources, so that sources with equal points do not fly the same points."""
EVEN_TURNS = 8
"""Turns through all points from which the rest is negligible: no point flies an eighth more often than another."""


def rocks_of_round(sources: Sequence[Source], total: int, number: int) -> list[range | IntArray]:
    """Return, for each source, the numbers (N,) of its rocks among the `total` rocks of a round, counted from 0.

    Each source has its share of the rocks, and they are evenly spread over its points. With too few rocks for all
    sources or points, each round takes others. No rock flies in two rounds.
    """
    counts, most = _counts(sources, total, number)
    each = enumerate(zip(sources, counts, most, strict=True))
    return [_of_source(source, count, largest, number, place) for place, (source, count, largest) in each]


def is_spread(sources: Sequence[Source], total: int) -> bool:
    """Return True if the rocks of a round are chosen evenly, and are not simply the next rocks of each source."""
    rocks = [source.rocks for source in sources]
    chosen = rocks_of_round(sources, total, 0)
    return _too_few(share_out(rocks, total), rocks) or any(isinstance(its, np.ndarray) for its in chosen)


def every_point(sources: Sequence[Source]) -> list[range]:
    """Return, for each source, the numbers of its first rocks, one from each point; 1 for random places."""
    return [range(_points(source)) for source in sources]


def sources_left_out(sources: Sequence[Source], total: int, rounds: int) -> list[str]:
    """Return the names of the sources with rocks of which none flies in the first rounds."""
    flown = np.sum([_counts(sources, total, number)[0] for number in range(rounds)], axis=0)
    return [source.name for source, count in zip(sources, flown, strict=True) if source.rocks and not count]


def words_on_left_out(sources: Sequence[Source], total: int, rounds: int, key: str) -> list[str]:
    """Return a sentence if sources never flew, else nothing; key : what gives the number of rocks of a set."""
    names = sources_left_out(sources, total, rounds)
    if not names:
        return []
    which = f"{len(names):,} of {len(sources):,} sources flew no rock, such as {names[0]!r}"
    return [f"{which}: a parameter set has {total:,} rocks; give more {key}, or join sources"]


def _counts(sources: Sequence[Source], total: int, number: int) -> tuple[list[int], list[int]]:
    """Return how many rocks of each source fly in a round, and the largest such number of any round.

    With too few rocks for all sources, they are spaced evenly along the list of sources (systematic sampling), and
    each round begins at another place.
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
    """Return True if a source with rocks gets none."""
    return any(its and not count for count, its in zip(counts, rocks, strict=True))


def _points(source: Source) -> int:
    """Return how many release points a source has; 1 for a source with random places (line or area)."""
    return 1 if source.line or source.triangles is not None else len(source.points)


def _of_source(source: Source, count: int, most: int, number: int, place: int) -> range | IntArray:
    """Return the numbers of `count` rocks of a source in a round; place : number of the source.

    most : largest number of rocks of the source in a round
    """
    points = _points(source)
    if most >= EVEN_TURNS * points or points == 1:
        return range(number * most, number * most + count)
    whole, rest = divmod(count, points)
    first = number * -(-most // points) * points  # rock k starts at point k % points, so this rock at the first point
    at = _place(number * POINT_STEP + place * BETWEEN_SOURCES)
    spread = ((np.arange(rest) + at) * points / max(rest, 1)).astype(np.int64)
    return np.concatenate([np.arange(whole * points), whole * points + spread]) + first


def _place(steps: float) -> float:
    """Return the place (-), from 0 to below 1, after some steps from the middle."""
    return (0.5 + steps) % 1.0
