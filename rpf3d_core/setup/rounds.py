"""Divide the rocks of a run into rounds that fly one after another, or into parts for several workers."""

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import count, pairwise, takewhile
from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.ensemble.releases import share_out
from rpf3d_core.ensemble.stream import BLOCK, blocks_of
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.cells import FIRST_ROUND


class Round(NamedTuple):
    """The rocks of one round or part of a run.

    first, last : for each source, the number of the first rock, and the number after the last rock
    """

    first: Sequence[int]
    last: Sequence[int]

    @property
    def rocks(self) -> int:
        """The number of rocks that fly in the round, over all sources."""
        return sum(self.last) - sum(self.first)

    def blocks(self) -> Iterator[list[range]]:
        """Yield the rocks in blocks that fit into memory: each is a list with a range of rocks for each source."""
        return blocks_of(self.first, self.last)

    def laps(self, first: int, most: int) -> "Iterator[Round]":
        """Yield the laps of the round: parts that fly one after another, each with its share of every source's rocks.

        first : approximate number of rocks of the first lap; most : largest number of rocks of a further lap
        """
        shares = _shares_of_laps(self.rocks, first, most)
        ends = [_ends_of_laps(low, high, shares) for low, high in zip(self.first, self.last, strict=True)]
        yield from (Round(first, last) for first, last in pairwise([list(its) for its in zip(*ends, strict=True)]))

    def dealt(self, sets: int) -> Iterator[list[IntArray]]:
        """Yield, for each parameter set, a list over the sources: the numbers (N,) of the rocks that fly with the set.

        sets : number of parameter sets
        """
        from rpf3d_core.unknowns.dealing import rocks_of_set  # imported only if the scene has unknowns

        for number in range(sets):
            yield [rocks_of_set(number, sets, first, last, source)
                   for source, (first, last) in enumerate(zip(self.first, self.last, strict=True))]  # fmt: skip


class EvenRound(NamedTuple):
    """The rocks of one round, in an order that uses all release points and parameter sets evenly (`growing_rounds`).

    numbers : for each source, the numbers (N,) of its rocks in this round, in the order of flight
    """

    numbers: Sequence[IntArray]

    @property
    def rocks(self) -> int:
        """The number of rocks that fly in the round, over all sources."""
        return sum(map(len, self.numbers))

    def blocks(self) -> Iterator[list[IntArray]]:
        """Yield the rocks in n blocks that fit into memory: each is a list with every n-th rock (N,) of each source."""
        blocks = -(-self.rocks // BLOCK)
        for block in range(blocks):
            yield [its[block::blocks] for its in self.numbers]

    def laps(self, first: int, most: int) -> "Iterator[EvenRound]":
        """Yield the laps of the round: parts that fly one after another, each with its share of every source's rocks.

        first : approximate number of rocks of the first lap; most : largest number of rocks of a further lap
        """
        shares = _shares_of_laps(self.rocks, first, most)
        parts = [np.split(its, _ends_of_laps(0, len(its), shares)[1:-1]) for its in self.numbers]
        yield from (EvenRound(list(lap)) for lap in zip(*parts, strict=True))

    def dealt(self, sets: int) -> Iterator[list[IntArray]]:
        """Yield, for each parameter set, a list over the sources: the numbers (N,) of the rocks that fly with the set.

        sets : number of parameter sets
        """
        parts = [_by_set(its, sets, source) for source, its in enumerate(self.numbers)]
        for number in range(sets):
            yield [part[number] for part in parts]


AnyRound = Round | EvenRound


def _shares_of_laps(rocks: int, first: int, most: int) -> list[Fraction]:
    """Return the shares (-) of the rocks of a round that have flown at the start and after each lap, from 0 to 1.

    A further lap has a quarter of the rocks that have flown before, at most `most`, or `first` rocks if `first` is
    larger. So if a run is stopped in lap 5 or later, a parameter set has flown at most 5/4 times as many rocks as
    another set; in laps 2, 3 and 4, at most 2, 3/2 and 4/3 times as many. In the first lap, a set may have flown none.

    first : approximate number of rocks of the first lap; most : largest number of rocks of a further lap
    """
    ends = [0, min(first, rocks)]
    while ends[-1] < rocks:
        size = max(first, min(ends[-1] // 4, most))
        ends.append(min(ends[-1] + size, rocks))
    return [Fraction(end, max(rocks, 1)) for end in ends[:-1]] + [Fraction(1)]


def _ends_of_laps(low: int, high: int, shares: Sequence[Fraction]) -> list[int]:
    """Return the rock numbers at which the laps of a source begin, and the number after its last lap.

    low, high : number of the source's first rock, and the number after its last rock; shares : from `_shares_of_laps`
    """
    return [low + math.floor(share * (high - low)) for share in shares]


def _by_set(rocks: IntArray, sets: int, source: int) -> list[IntArray]:
    """Return, for each parameter set, the rocks (N,) of a source that fly with the set, in the order of `rocks`.

    rocks : (M,) numbers of the source's rocks; sets : number of parameter sets; source : index of the source
    """
    owners = _owners(rocks, sets, source)
    order = np.argsort(owners, kind="stable")
    return np.split(rocks[order], np.searchsorted(owners[order], np.arange(1, sets)))


def _owners(rocks: IntArray, sets: int, source: int) -> IntArray:
    """Return the number of the parameter set (N,) with which each rock (N,) of a source flies.

    sets : number of parameter sets; source : index of the source
    """
    from rpf3d_core.unknowns.dealing import sets_of_rocks  # imported only if the scene has unknowns

    return sets_of_rocks(rocks, sets, source)


def rounds_up_to(totals: Sequence[Sequence[int]]) -> list[Round]:
    """Return rounds from the numbers of rocks that have flown after each round.

    totals : one entry for each round: for each source, the number of its rocks that have flown after this round
    """
    return [Round(first, last) for first, last in pairwise([[0] * len(totals[0]), *totals])]


def doubling_rounds(first: Sequence[int], most: int, least: int = 0) -> list[Round]:
    """Return rounds that each double the number of flown rocks, up to a total of `most` rocks.

    The first round flies `first` even if this is more than `most`, because a result needs at least one rock from each
    source. If the first round has fewer than `least` rocks, the second round raises the total to at least `least`, even
    above `most`, because results of fewer rocks could not be used.

    first : number of rocks of each source in the first round
    most, least : numbers of rocks over all sources; least : 0 for no such limit
    """
    totals = [list(first)]
    if 0 < (flown := sum(first)) < least:
        totals.append([-(-n * least // flown) for n in first])
    while 2 * sum(totals[-1]) <= most:
        totals.append([2 * n for n in totals[-1]])
    return rounds_up_to(totals)


def growing_rounds(counts: Sequence[int], points: Sequence[int], first: int, sets: int = 0) -> list[AnyRound]:
    """Return rounds that each about double the number of flown rocks, from about `first` rocks to all.

    After each round, every source has flown its share of the rocks, within one rock, and has used its release points
    evenly. So the results after a round represent all rocks. All rounds together fly all rocks of the run.

    counts : number of rocks of each source; points : number of release points of each source, 1 for random places
    first : approximate number of rocks of the first round, over all sources; raised if sources or sets need more
    sets : number of parameter sets, 0 without unknowns. In the first round, each set flies at least one rock of each
        source. If a source has fewer rocks than there are sets, all rocks fly in one round
    """
    total = sum(counts)
    least = _least_first(counts, first, sets)
    totals = [share_out(counts, size) for size in takewhile(lambda size: size < total, (least << k for k in count()))]
    if not totals:
        return list(rounds_up_to([counts]))
    orders = [even_order(n, p, source, sets) for source, (n, p) in enumerate(zip(counts, points, strict=True))]
    return [EvenRound([order[low:high] for order, low, high in zip(orders, each.first, each.last, strict=True)])
            for each in rounds_up_to([*totals, list(counts)])]  # fmt: skip


def _least_first(counts: Sequence[int], first: int, sets: int) -> int:
    """Return the number of rocks of the first round over all sources: `first`, or more if sources or sets need more.

    The first round has about one rock from each source. With parameter sets, it has at least one rock for each source
    and set; if a source has too few rocks for this, the result is the number of all rocks.

    counts : number of rocks of each source; sets : number of parameter sets, 0 without unknowns
    """
    flying, total = [n for n in counts if n], sum(counts)
    least = max(first, len(flying))
    if not sets:
        return least
    # `share_out` gives a source at least its exact share of the rocks, rounded down.
    return total if min(flying) < sets else max(least, -(-sets * total // min(flying)))


def even_order(rocks: int, points: int, source: int = 0, sets: int = 0) -> IntArray:
    """Return the numbers (N,) of a source's rocks in an order whose beginning visits all release points evenly.

    Rocks use the points in turn. With parameter sets, successive rocks form groups, and each group visits all points. A
    group flies in passes. Each pass has one rock of each set, so the beginning of the order uses all sets evenly, too.

    rocks : number of the source's rocks; points : number of its release points, 1 for random places
    source : number of the source; sets : number of parameter sets, 0 without unknowns
    """
    cycle = max(min(points, rocks), 1)
    span = -(-cycle // sets) * sets if sets else cycle
    numbers = np.arange(rocks)
    group, place = np.divmod(numbers, span)
    passes = _passes(group, place // sets, _owners(numbers, sets, source), sets) if sets else 0 * group
    return np.asarray(np.lexsort((_spread_ranks(span)[place], passes, group)), dtype=np.int64)


def _passes(group: IntArray, deck: IntArray, owner: IntArray, sets: int) -> IntArray:
    """Return the pass (N,) in which each rock of a source flies.

    For n parameter sets, a deck is n successive rocks, one rock of each set. In pass p, set s flies its rock of deck
    p + s, modulo the number of decks of the group. So the rocks of a pass are spread over the whole group.

    group : (N,) number of each rock's group; deck : (N,) number of the rock's deck within the group
    owner : (N,) number of the parameter set with which the rock flies; sets : number of parameter sets
    """
    place = group * sets + owner
    decks = np.bincount(place, minlength=1)[place]  # the last deck of the last group may lack some sets
    return np.asarray((deck - owner) % decks, dtype=np.int64)


def _spread_ranks(size: int) -> IntArray:
    """Return the rank (N,) of each of N = `size` places in an order in which early places are far apart.

    For each k, the 2^k places of lowest rank are evenly spread over all N places.

    Source: van der Corput (1935), Verteilungsfunktionen: the bits of the rank in reverse order.
    """
    bits = (size - 1).bit_length()
    turned = np.zeros(1, dtype=np.int64)
    for _ in range(bits):
        turned = np.concatenate([2 * turned, 2 * turned + 1])
    return np.asarray(np.unique(turned * size >> bits, return_index=True)[1], dtype=np.int64)


def rounds_of(scene: Scene, points: Sequence[int]) -> list[Round]:
    """Return the rounds of a run: one round of all rocks or, for `rocks: auto`, doubling rounds up to `most_rocks`.

    points : number of release points of each source, 1 for random places. The first round uses all points, if
        `most_rocks` allows it, so that its result does not depend on the first points only. Every source with rocks
        has at least one rock in the first round, even if the sources are more than `most_rocks`
    """
    counts = [source.rocks for source in scene.sources]
    if scene.rocks != "auto":
        return rounds_up_to([counts])
    times = max(-(-FIRST_ROUND // sum(counts)), *(-(-p // n) for p, n in zip(points, counts, strict=True) if n))
    first, most = [n * times for n in counts], scene.target.most_rocks
    if sum(first) > most:  # every source keeps a rock, or its danger would count as none
        first = [max(share, min(n, 1)) for share, n in zip(share_out(first, most), first, strict=True)]
    return doubling_rounds(first, most)


def rounds_of_parts(counts: Sequence[int], parts: int) -> list[Round]:
    """Return the rocks of each part of a run: an equal share of every source's rocks, to within one rock.

    Parts without rocks are left out. counts : number of rocks of each source; parts : number of parts
    """
    totals = [[k * n // parts for n in counts] for k in range(1, parts + 1)]
    return [part for part in rounds_up_to(totals) if part.first != part.last]
