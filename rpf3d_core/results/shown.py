"""The content of a run's pictures, as values that can be sent to another process.

This module imports no engine and no scene, because the process that draws needs neither.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from rpf3d_core.ensemble.flights import Flights, FloatArray
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.hazard.convergence import Step
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.values import Outcome

if TYPE_CHECKING:
    from rpf3d_core.scene.model import TargetSpec


class RunCounts(NamedTuple):
    """The numbers of rocks behind a picture, for its title and legend.

    rocks : rocks flown, including fragments; planned : rocks that were to fly, more than `rocks` after an interruption
    outcomes : number of rocks by outcome; pieces : number of `rocks` that are fragments
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
        """Return the number of rocks that a picture shows, as text for its title, such as '100 of 1,000 rocks'.

        number : number of rocks in the picture; if all rocks flown are in the picture, the text is that of `describe`
        """
        if number >= self.rocks:
            return self.describe()
        return f"{number:,} of {self.rocks:,} rocks{', partial' if self.rocks < self.planned else ''}"

    def drawn(self, number: int) -> str:
        """Return text for the end of a legend entry: how many of the rocks are drawn; "" if all are drawn.

        number : number of drawn rocks
        """
        return "" if number >= self.rocks else f" ({number:,} of {self.rocks:,} drawn)"


class MapContent(NamedTuple):
    """The content that all maps of a run share: terrain, areas of interest, scene name and number of rocks.

    name : of the scene; flown : numbers of the rocks whose paths the maps show
    areas : name -> rings (N, 2) m, outlines of areas of interest, local frame
    """

    name: str
    terrain: Terrain
    areas: Mapping[str, Sequence[FloatArray]]
    flown: RunCounts


class RunPictures(NamedTuple):
    """The content of a run's pictures except the terrain; only values that can be sent to another process.

    name, flown : as in `MapContent`; areas : name -> rings (N, 2) m, local frame
    sources : names of the sources; gravity : m/s^2
    maps : hazard maps of the run; flights : of the rocks to draw; samples : points of the paths to draw
    obstacles : barriers and trees
    steps, target : convergence after each doubling, and the scene's target; empty and None without `rocks: auto`
    """

    name: str
    areas: Mapping[str, Sequence[FloatArray]]
    flown: RunCounts
    maps: HazardMaps
    flights: Flights
    samples: PathSamples
    sources: Sequence[str]
    gravity: float
    obstacles: Obstacles
    steps: Sequence[Step]
    target: "TargetSpec | None"
