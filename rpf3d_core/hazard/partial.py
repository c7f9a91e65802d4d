"""Pack the map counts of a part of an ensemble, so that they can be sent to another process or machine.

Only cells that rocks reached are kept, and only the bins that contain rocks. A cell has several hundred bins. A rock is
counted in one bin of energy and one bin of height, and in one bin of speed if masses differ or rocks spin. The joined
parts have the same bits as one run of all rocks (`hazard.tally`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.hazard.bins import Scales
from rpf3d_core.hazard.carries import FULL, Carries
from rpf3d_core.hazard.slots import empty_slots
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.cache_lines import Found, add_found


@dataclass(frozen=True, eq=False)
class PackedTally:
    """The counts of a tally of C cells in small form, for sending: only reached cells (S), only bins with rocks.

    cells : C; scales : the bins of energy, speed and height
    limit : bytes above which bins are merged in pairs; merges : how often they were merged
    width : number of bins per cell (B)
    found : the counts of the S cells without their bins, in order of cell
    filled : (N,) flat indices, in the array of bins (S, B), of the bins that contain rocks
    rocks : (N,) number of rocks in each of these bins
    """

    cells: int
    scales: Scales
    limit: float
    merges: int
    width: int
    found: Found
    filled: IntArray
    rocks: np.ndarray[tuple[int], np.dtype[np.uint32]]


def packed(tally: CellTally) -> PackedTally:
    """Return the counts of a tally in small form (`PackedTally`), to be sent to another process."""
    width, first = tally.slots.bins.shape[1], 0
    filled, rocks = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.uint32)]
    for bins in tally.bins_found():
        some = np.flatnonzero(bins)
        filled.append(some + first * width)
        rocks.append(bins.ravel()[some])
        first += len(bins)
    return PackedTally(
        len(tally.slot), tally.scales, tally.limit, tally.merges, width, tally.found(), np.concatenate(filled),
        np.concatenate(rocks),
    )  # fmt: skip


def unpacked(packed: PackedTally) -> CellTally:
    """Return a tally from its small form; more rocks can be counted in it."""
    ways = packed.found.ways
    tally = CellTally(packed.cells, packed.scales, packed.limit, ways=ways is not None)
    used = len(packed.found.cell)
    tally.slots = empty_slots(used, packed.width, tally.ways)
    tally.slots.cell[:] = packed.found.cell
    if ways is not None:
        tally.slots.ways[:] = ways
    tally.slots.bins.ravel()[packed.filled] = packed.rocks % FULL
    add_found(tally.slots.lines, np.arange(used), packed.found)
    full = packed.rocks >= FULL
    tally.carries = Carries(packed.width, packed.filled[full], (packed.rocks[full] // FULL).astype(np.int64))
    tally.used, tally.merges = used, packed.merges
    tally.slot[packed.found.cell] = np.arange(used)
    return tally


def packed_tallies(tallies: Tallies) -> tuple[PackedTally, ...]:
    """Return all map counts of a part of an ensemble in small form, to be sent to another process."""
    return tuple(packed(tally) for tally in _four(tallies))


def add_packed(tallies: Tallies, part: Sequence[PackedTally]) -> None:
    """Add the map counts of a part, in small form, to the counts of the same ensemble.

    Raises
    ------
    ValueError
        The part belongs to another ensemble: it has other cells, scales or limits of memory, or only one of the two
        counts path lengths.
    """
    for tally, other in zip(_four(tallies), part, strict=True):
        _add(tally, other)


def _add(tally: CellTally, other: PackedTally) -> None:
    """Add packed counts to a tally; raise ValueError if they belong to another ensemble, as in `add_packed`."""
    theirs = (other.cells, other.scales, other.limit, other.found.ways is not None)
    if theirs != (len(tally.slot), tally.scales, tally.limit, tally.ways):
        raise ValueError("a part of another ensemble cannot be counted in: its cells, scales or memory differ")
    tally.add(unpacked(other))


class PackedSources(NamedTuple):
    """The counts for each source in small form, for sending; the fields are those of `SourceTallies`.

    zones, inside : counts of zones and of areas of interest
    cells : counts of map cells; None if they were given up because they needed too much memory
    flown, lost : (S,) rocks flown from each source, and lost to holes
    """

    zones: PackedTally
    inside: PackedTally
    cells: PackedTally | None
    flown: IntArray
    lost: IntArray


def packed_sources(tallies: Tallies) -> PackedSources | None:
    """Return the counts for each source of a part of an ensemble in small form; None if they were not counted."""
    if (found := tallies.sources) is None:
        return None
    cells = None if found.cells.tally is None else packed(found.cells.tally)
    return PackedSources(packed(found.zones), packed(found.inside), cells, found.flown, found.lost)


def add_packed_sources(tallies: Tallies, part: PackedSources | None) -> None:
    """Add the counts for each source of a part, in small form, to the counts of the same ensemble.

    If the part has given up its counts of map cells, the sum gives them up, too.

    Raises
    ------
    ValueError
        As in `add_packed`, or only one of the two counts each source separately.
    """
    found = tallies.sources
    if (found is None) != (part is None):
        raise ValueError("a part of another ensemble cannot be counted in: only one of both counts each source")
    if found is None or part is None:
        return
    _add(found.zones, part.zones)
    _add(found.inside, part.inside)
    found.cells.add(None if part.cells is None else unpacked(part.cells))
    found.note_counts(part.flown, part.lost)


def _four(tallies: Tallies) -> tuple[CellTally, CellTally, CellTally, CellTally]:
    return tallies.squares, tallies.facets, tallies.zones, tallies.inside
