"""Fly any number of rocks in bounded memory, block by block: draw the releases, fly them and pass on the results."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.effects.hooks import breaks, links_of
from rpf3d_core.ensemble.batch import Batch, only
from rpf3d_core.ensemble.batches import Advance, BatchControl, Flight, Keep, Watch, fly_batches
from rpf3d_core.ensemble.broken import NONE_BROKEN, Broken, in_turn
from rpf3d_core.ensemble.flights import Deposits, Flights, Impacts, IntArray
from rpf3d_core.ensemble.fly import deposits_of, flights_of, impacts_of, spread_over
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.simulation.engines import Compiled, Engine

BLOCK = 16_384
"""Approximate largest number of rocks that are drawn and flown together (a block), which limits the memory.

With 200 impacts per rock, sorting a block needs some hundreds of megabytes.
"""

NO_RELEASES = Releases(*(np.empty(0, np.int64),) * 2, *(np.empty((0, 3)),) * 2, *(np.empty(0),) * 2)
"""Releases without rocks, as a start for joining releases."""

Sink = Callable[[Deposits, Impacts], None]
"""Callback that receives the deposits and impacts of each block of rocks, in order, such as to write them to a file.

`Impacts.row` counts from the block's first rock.
"""


@dataclass(frozen=True, eq=False)
class Shown:
    """Selects the rocks that are kept in memory for display.

    rocks : (N,) rows of the rocks, None for all; paths : (P,) rows of the rocks whose paths are also kept
    """

    rocks: IntArray | None
    paths: IntArray


def precompile_fragments(engine: Engine, flight: Flight) -> None:
    """Compile the functions that make fragments, if rocks may break, so that the first broken rock does not wait."""
    effects = links_of(flight.models.effects)
    if isinstance(engine, Compiled) and any(breaks.has_rule(type(effect)) for effect in effects):
        from rpf3d_core.ensemble.pieces import Breaking

        Breaking(flight).precompile()


def shown_of(rocks: int, shown: int | None, paths: int) -> Shown:
    """Return the rocks to keep for display, evenly spread over all rocks.

    rocks : number of all rocks; shown : number of rocks to keep, None for all
    paths : number of the kept rocks whose paths are also kept
    """
    if shown is None:
        return Shown(None, spread_over(rocks, paths))
    some = spread_over(rocks, shown)
    return Shown(some, some[spread_over(len(some), paths)])


def blocks_of(first: Sequence[int], last: Sequence[int], size: int | None = None) -> Iterator[list[range]]:
    """Yield the blocks of rocks to fly, one after another: a range of rock numbers for each source.

    first, last : first rock number of each source, and the number after its last rock
    size : approximate number of rocks in a block; None for BLOCK

    With n blocks, a block contains every n-th rock of every source, so that the blocks flown so far represent all
    places of the sources. A source with fewer than n rocks has one rock in some blocks, and none in the other blocks.
    """
    blocks = -(-(sum(last) - sum(first)) // (BLOCK if size is None else size))
    for b in range(blocks):
        yield [_share(low, high, b, blocks) for low, high in zip(first, last, strict=True)]


def _share(low: int, high: int, b: int, blocks: int) -> range:
    """Return the numbers of a source's rocks that belong to a block: every n-th rock, with n the number of blocks.

    If the source has fewer than n rocks, the range contains one rock or no rock.

    low, high : first number of the source's rocks, and the number after the last; b : number of the block, from 0
    blocks : number of blocks
    """
    if high - low >= blocks:
        return range(low + b, high, blocks)
    return range(low + b * (high - low) // blocks, low + (b + 1) * (high - low) // blocks)


@dataclass(eq=False)
class Stream:
    """Flies an ensemble one block of rocks after another, passes the results on and keeps the rocks to display.

    Fragments of rocks that break fly after their block. `rows` counts the rocks of all blocks so far, including rocks
    of the last block that did not fly because of a stop. `pieces` counts the fragments; `dust` is the mass of fragments
    too small to fly, in `broken.DUST_UNITS`.

    shown : selects the rocks to keep for display
    watch, stop, threads, advance : as in `fly_batches` and `BatchControl`; sink : receives deposits and impacts
    impacts : True if the sink receives the impacts of all rocks, False if only the impacts of the rocks to display
    """

    engine: Engine
    flight: Flight
    shown: Shown
    watch: Watch | None = None
    sink: Sink | None = None
    stop: Callable[[], bool] | None = None
    threads: int | None = None
    advance: Advance | None = None
    impacts: bool = True

    def __post_init__(self) -> None:
        """Set all counts to zero: no rock has flown."""
        self.rows = 0
        self.pieces = 0
        self.dust = 0
        self._placed = 0
        self._batches: list[Batch] = []
        self._releases: list[Releases] = []

    def stopped(self) -> bool:
        """Return True if no further block may fly; always False before the first rock, because a result needs rocks."""
        return self.rows > 0 and self.stop is not None and self.stop()

    def fly(self, blocks: Iterable[Releases]) -> bool:
        """Fly blocks of rocks, and their fragments; return False if the run was stopped before all rocks had flown."""
        for releases in blocks:
            if self.stopped():
                return False
            flown = self._fly_block(releases)
            self.rows += len(releases.x)
            if flown < len(releases.x):
                return False
        return True

    def _fly_block(self, releases: Releases) -> int:
        """Fly one block of rocks, then the fragments of these rocks; return how many rocks of the block flew."""
        rocks, struck = len(releases.x), None if self.impacts else self.shown.rocks
        keep = Keep(self._chosen(self.shown.paths, rocks), self._chosen(struck, rocks))
        control = BatchControl(threads=self.threads, stop=self.stop, advance=self.advance)
        batch = fly_batches(self.engine, self.flight, releases, keep, self.watch, control)
        if len(batch.rows):
            self._hand_on(batch, releases, self._chosen(self.shown.rocks, rocks))
            self._fly_pieces(batch, releases)
        return len(batch.rows)

    def _fly_pieces(self, batch: Batch, releases: Releases) -> None:
        """Fly the fragments of a batch's broken rocks, then the fragments of broken fragments, and so on.

        All fragments fly even if the run was stopped. Fragments and their paths are kept for display only if all rocks
        are kept.
        """
        if not len(batch.broken.rows):
            return
        from rpf3d_core.ensemble.pieces import Breaking  # imported only if rocks may break

        breaking, broken = Breaking(self.flight, isinstance(self.engine, Compiled)), batch.broken
        while breaking.goes_on and len(broken.rows):
            parts = [(NO_RELEASES, NONE_BROKEN)]
            for pieces, dust in breaking.pieces_of(releases, broken):
                self.dust += dust
                parts.append(self._fly_some(pieces, breaking.flight))
            releases = _joined([part for part, _ in parts])
            broken = in_turn([part for _, part in parts])

    def _fly_some(self, pieces: Releases, flight: Flight) -> tuple[Releases, Broken]:
        """Fly some fragments; return the releases of the broken fragments, and the state of each when it broke."""
        shown = np.full(len(pieces.x), self.shown.rocks is None)
        keep = Keep(shown, shown | self.impacts)
        batch = fly_batches(self.engine, flight, pieces, keep, self.watch, BatchControl(threads=self.threads))
        self._hand_on(batch, pieces, shown)
        self.pieces += len(pieces.x)
        return taken(pieces, batch.broken.rows), batch.broken

    def _hand_on(self, batch: Batch, releases: Releases, chosen: NDArray[np.bool_]) -> None:
        """Pass the deposits and impacts of a batch to the sink and keep the rocks chosen for display."""
        if self.sink:
            self.sink(deposits_of(batch.finals, batch.counts, taken(releases, batch.rows)), impacts_of(batch))
        shown = chosen[batch.rows]
        self._batches.append(only(replace(batch, rows=batch.rows + self._placed), shown))
        self._placed += len(releases.x)
        self._releases.append(taken(releases, batch.rows[shown]))

    def _chosen(self, rows: IntArray | None, count: int) -> NDArray[np.bool_]:
        """Return flags (count,) for the next `count` rocks to fly: True if the rock is among the given rows.

        rows : row numbers, counted over all rocks of the ensemble; None for all rocks
        """
        chosen = np.full(count, rows is None)
        if rows is None:
            return chosen
        chosen[rows[(rows >= self.rows) & (rows < self.rows + count)] - self.rows] = True
        return chosen

    def flights(self, compile_s: float, fly_s: float) -> Flights:
        """Return the results of the rocks kept for display.

        compile_s, fly_s : wall seconds of the run
        """
        releases = _joined(self._releases)
        return flights_of(self._batches, releases, self.engine.name, compile_s, fly_s)


def taken(releases: Releases, rows: IntArray) -> Releases:
    """Return the given rows (N,) of some releases, as new `Releases`."""
    return Releases(**{name: column[rows] for name, column in _columns(releases).items()})


def _joined(parts: Sequence[Releases]) -> Releases:
    """Return several releases joined in order into one; releases without rocks need not have all columns."""
    columns = [_columns(part) for part in parts if len(part.x)] or [_columns(part) for part in parts[:1]]
    return Releases(**{name: np.concatenate([part[name] for part in columns]) for name in columns[0]})


def _columns(releases: Releases) -> dict[str, np.ndarray]:
    """Return the columns of releases by name, without the columns that are None."""
    given = {column.name: getattr(releases, column.name) for column in fields(Releases)}
    return {name: column for name, column in given.items() if column is not None}
