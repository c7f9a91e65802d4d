"""What a run has found: all that the files of a result are written from."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.convergence import Step
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.scene.model import Scene
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.values import Outcome


class RunCounts(NamedTuple):
    """How many rocks a picture is of, and how many ended in each way; planned : more, if the run was interrupted.

    pieces : how many of the rocks are pieces of others
    """

    rocks: int
    planned: int
    outcomes: Mapping[Outcome, int]
    pieces: int = 0

    def describe(self) -> str:
        """For titles."""
        if self.rocks < self.planned:
            return f"{self.rocks:,} of {self.planned:,} rocks{' and pieces' if self.pieces else ''}, partial"
        whole = self.rocks - self.pieces
        broken = f" and {self.pieces:,} pieces of them" if self.pieces else ""
        return f"{whole:,} {'rock' if whole == 1 else 'rocks'}{broken}"

    def describe_some(self, number: int) -> str:
        """For titles of pictures of some of the rocks, which may be all."""
        if number >= self.rocks:
            return self.describe()
        return f"{number:,} of {self.rocks:,} rocks{', partial' if self.rocks < self.planned else ''}"

    def drawn(self, number: int) -> str:
        """What to add to the name of something that is drawn for so many of the rocks; nothing if it is for all."""
        return "" if number >= self.rocks else f" ({number:,} of {self.rocks:,} drawn)"


@dataclass(frozen=True, eq=False)
class Findings:
    """A scene, its terrain, and what came of its rocks.

    flights : of the rocks that are drawn, all or an even selection; totals, maps : of all that have flown
    planned : rocks that should have flown; more than have flown if the run was interrupted
    steps : what was known after each doubling, where the number of rocks was left open
    obstacles : of the scene's effects; timings : name -> wall seconds, such as `read_s` and `wall_s`
    """

    scene: Scene
    terrain: Terrain
    faults: FaultReport
    flights: Flights
    totals: Totals
    maps: HazardMaps
    planned: int
    steps: tuple[Step, ...]
    timings: Mapping[str, float]
    obstacles: Obstacles = NO_OBSTACLES

    @property
    def flown(self) -> RunCounts:
        """How many rocks all this is of."""
        return RunCounts(self.totals.rocks, self.planned, self.totals.outcomes, self.totals.pieces)
