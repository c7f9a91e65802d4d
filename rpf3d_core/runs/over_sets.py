"""Fly the rocks of a scene with unknowns: one parameter set after another, with the same terrain and compiled loops."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Deposits, Impacts, IntArray
from rpf3d_core.ensemble.joined import one_after_another
from rpf3d_core.ensemble.stream import BLOCK, Sink, Stream
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.by_set.displaced import DisplacedTally
from rpf3d_core.hazard.by_set.sets import SetFigures, SetTally
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.materials.library import Materials
from rpf3d_core.setup.parameter_sets import Ready, flight_of_set
from rpf3d_core.setup.prepared import Prepared, releases_in_ranges
from rpf3d_core.setup.rounds import AnyRound
from rpf3d_core.setup.unknowns import displacements_of_scene, sets_of_scene
from rpf3d_core.unknowns.parameter_sets import ParameterSets


def flights_over_sets(prepared: Ready) -> tuple[ParameterSets, list[Flight]]:
    """Return the parameter sets of a scene, and the flight settings of each; all sets use the same compiled loop.

    Raises
    ------
    InputError
        The sample is refused, or a set has a value that the scene refuses; the message names the key path.
    """
    sets = sets_of_scene(prepared.scene)
    flights = [flight_of_set(prepared, sets.at(number), drawn=False) for number in range(len(sets))]
    if all(isinstance(flight.materials, Materials) for flight in flights):
        return sets, flights
    return sets, [flight_of_set(prepared, sets.at(number), drawn=True) for number in range(len(sets))]


def set_tally(prepared: Prepared, sets: ParameterSets, tallies: Tallies) -> SetTally:
    """Return the empty counts of the parameter sets of a scene; tallies : the empty counts of the run's hazard maps."""
    moves = displacements_of_scene(prepared.scene, sets)
    displaced = None if moves is None else DisplacedTally(moves, tallies, prepared.engine)
    return SetTally(sets, tallies, displaced)


LAP = 1024
"""Approximate number of rocks that a parameter set flies in the first lap, before the next set flies.

A lap is a part of a round, with rocks of every parameter set.
"""
MOST_IN_LAP = 2**22
"""Largest number of rocks of all sets in a lap, unless the first lap has more.

The numbers of the rocks of a lap, sorted by set, then need some 100 MB.
"""


@dataclass(eq=False)
class Gathered:
    """Collects the results of small groups of rocks, and passes them on in blocks, which tables can write faster.

    sink : receives the deposits and impacts of each block
    """

    sink: Sink
    parts: list[tuple[Deposits, Impacts]] = field(default_factory=list)

    def __call__(self, deposits: Deposits, impacts: Impacts) -> None:
        """Add the results of a group of rocks to the collected results.

        If the collected results contain at least BLOCK (16,384) rocks, send these results to `sink` and start again.
        """
        if not len(deposits.rock):
            return
        self.parts.append((deposits, impacts))
        if sum(len(some.rock) for some, _ in self.parts) >= BLOCK:
            self.pass_on()

    def pass_on(self) -> None:
        """Send the collected results to `sink`, and start again."""
        if self.parts:
            self.sink(*one_after_another(self.parts))
            self.parts.clear()


@dataclass(eq=False)
class SetFlyer:
    """Flies rounds of rocks with the parameter sets, and counts the results of each set.

    flights : flight settings of each set; tally : counts of the sets
    sink : function that receives all deposits and impacts
    further : function of (totals, sink) that returns a new sink; the new sink adds to the totals and then calls the
        given sink, as with `fly_scene.counted_and`
    """

    prepared: Prepared
    stream: Stream
    flights: Sequence[Flight]
    tally: SetTally
    sink: Sink
    further: Callable[[Totals, Sink], Sink]

    def fly(self, rocks: AnyRound) -> bool:
        """Fly the rocks of a round, set after set; return False if the run was stopped before all rocks had flown.

        A round of many rocks flies in laps, each with rocks of every set. So a run that is stopped after its first lap
        has flown rocks of all sets. In a run that is stopped earlier, the sets that have flown still represent all
        sets, because for every n the first n sets are spread evenly over the values of the unknowns.

        Laps grow, because each lap copies the counts of all map cells for each set. A lap stays small compared with the
        rocks that have flown, because a set that is ahead by a lap has more weight in the figures of all sets.
        """
        gathered = Gathered(self.sink)
        whole = all(self._fly_sets(lap, gathered) for lap in rocks.laps(LAP * len(self.flights), MOST_IN_LAP))
        gathered.pass_on()
        return whole

    def _fly_sets(self, rocks: AnyRound, gathered: Gathered) -> bool:
        """Fly the rocks of a lap (a part of a round), set after set; return False if the run was stopped.

        A stop is checked before each set, because a set is often one batch, which always flies to its end.
        """
        for number, (flight, dealt) in enumerate(zip(self.flights, rocks.dealt(len(self.flights)), strict=True)):
            if not any(map(len, dealt)):
                continue
            if self.stream.stopped():
                return False
            self.stream.flight = flight
            self.stream.watch = self.tally.watch_of(number)
            self.stream.sink = self.further(self.tally.totals_of(number), self.tally.sink_of(number, gathered))
            whole = self.stream.fly(releases_in_ranges(self.prepared, some) for some in _blocks(dealt))
            self.tally.end(number)
            if not whole:
                return False
        return True

    def figures(self) -> SetFigures:
        """Return the counts and percentiles of all parameter sets."""
        return self.tally.figures()


def _blocks(dealt: Sequence[IntArray]) -> list[list[IntArray]]:
    """Return the rocks of a set in n blocks that fit into memory; a block has every n-th rock of each source.

    dealt : numbers of the set's rocks, for each source
    """
    blocks = -(-sum(map(len, dealt)) // BLOCK)
    return [[rocks[block::blocks] for rocks in dealt] for block in range(blocks)]
