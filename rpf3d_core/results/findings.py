"""The result of a run: the prepared scene and what its rocks did, from which all files are written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rpf3d_core.ensemble.flights import Flights, FloatArray
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.convergence import Step
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome


class RunCounts(NamedTuple):
    """How many rocks a picture is based on, for its title and legend.

    rocks : rocks flown, fragments included; planned : rocks that should fly, more than `rocks` if interrupted
    outcomes : number of rocks by outcome; pieces : how many of the rocks are fragments of others
    """

    rocks: int
    planned: int
    outcomes: Mapping[Outcome, int]
    pieces: int = 0

    def describe(self) -> str:
        """Return the number of rocks in words for a title, such as "100 of 1,000 rocks, partial"."""
        if self.rocks < self.planned:
            return f"{self.rocks:,} of {self.planned:,} rocks{' and pieces' if self.pieces else ''}, partial"
        whole = self.rocks - self.pieces
        broken = f" and {self.pieces:,} pieces of them" if self.pieces else ""
        return f"{whole:,} {'rock' if whole == 1 else 'rocks'}{broken}"

    def describe_some(self, number: int) -> str:
        """Return the number of rocks that a picture shows in words, for its title.

        And of all rocks if these are more.
        """
        if number >= self.rocks:
            return self.describe()
        return f"{number:,} of {self.rocks:,} rocks{', partial' if self.rocks < self.planned else ''}"

    def drawn(self, number: int) -> str:
        """Return the end of a legend entry that says how many of the rocks are drawn; empty if all are drawn."""
        return "" if number >= self.rocks else f" ({number:,} of {self.rocks:,} drawn)"


class MapContent(NamedTuple):
    """The content that all maps of a run share: terrain, areas of interest, scene name and number of rocks.

    name : of the scene; flown : the number of rocks behind the maps
    areas : name -> rings (N, 2) m, outlines of areas of interest, local frame, as `areas.local_outlines`
    """

    name: str
    terrain: Terrain
    areas: Mapping[str, Sequence[FloatArray]]
    flown: RunCounts


@dataclass(frozen=True, eq=False)
class Run:
    """The result of a run: the prepared scene, and what its rocks did; from it, the result folder is written.

    flights : of all rocks or, if the run was written to disk, of the rocks that are drawn, an even selection
    totals, maps : of all rocks flown
    planned : rocks that should fly; more than the rocks flown if the run was interrupted
    steps : convergence after each doubling if the scene has `rocks: auto`, else empty
    wall_s : wall seconds from the start of the preparation until the last rock has flown
    """

    prepared: Prepared
    flights: Flights
    totals: Totals
    maps: HazardMaps
    planned: int
    wall_s: float
    steps: tuple[Step, ...] = ()

    @property
    def scene(self) -> Scene:
        """The scene that was run."""
        return self.prepared.scene

    @property
    def terrain(self) -> Terrain:
        """The terrain that the rocks flew over."""
        return self.prepared.terrain

    @property
    def faults(self) -> FaultReport:
        """Faults of the terrain's mesh that were found and repaired."""
        return self.prepared.faults

    @property
    def obstacles(self) -> Obstacles:
        """Barriers and trees of the scene."""
        return self.prepared.obstacles

    @property
    def timings(self) -> dict[str, float]:
        """Wall-clock seconds by name: `read_s`, `index_s` (see `Prepared`) and `wall_s`."""
        return {"read_s": self.prepared.read_s, "index_s": self.prepared.index_s, "wall_s": self.wall_s}

    @property
    def flown(self) -> RunCounts:
        """The numbers of rocks that the results are based on."""
        return RunCounts(
            rocks=self.totals.rocks, planned=self.planned, outcomes=self.totals.outcomes, pieces=self.totals.pieces
        )


def sentence_of(outcome: Outcome, scene: Scene) -> str:
    """Return the sentence that explains an outcome in tables and files.

    A ground model may have its own sentence for STOPPED, for example if it ignores friction.
    """
    stopped = scene.ground_model.model_spec.STOPPED
    return stopped if outcome == Outcome.STOPPED and stopped is not None else OUTCOME_SENTENCES[outcome]
