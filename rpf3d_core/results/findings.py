"""The result of a run: the prepared scene and what its rocks did, from which all files are written."""

from dataclasses import dataclass
from functools import cached_property

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.convergence import Step
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.results.shown import RunCounts
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.setup.warnings.placement import placement_warnings, some_releases, source_heights
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome

MOST_LOOKED_AT = 500
"""Approximate largest number of rocks whose start height (m) is checked, to warn about sources in the air."""


@dataclass(frozen=True, eq=False)
class Run:
    """The result of a run: the prepared scene, and what its rocks did. The result folder is written from a `Run`.

    flights : ends, impacts and paths of all rocks. If the tables were written while the rocks flew, `flights` has only
        an evenly spread selection of the rocks, for the pictures
    totals, maps : figures and hazard maps of all rocks flown
    planned : number of rocks that were to fly; larger than the number of rocks flown if the run was interrupted
    critical : flight of the rock that stopped farthest from its release, with its path only; None if `flights` has this
        path, or if no such rock is known
    steps : convergence after each doubling if the scene has `rocks: auto`, else empty
    wall_s : wall seconds from the start of the preparation until all rocks have flown and the maps are computed
    """

    prepared: Prepared
    flights: Flights
    totals: Totals
    maps: HazardMaps
    planned: int
    wall_s: float
    steps: tuple[Step, ...] = ()
    critical: Flights | None = None

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
        """The report on the terrain's mesh: its size, and the faults that were found, some of which were repaired."""
        return self.prepared.faults

    @cached_property
    def placement(self) -> list[str]:
        """Warnings about sources in the air, sources with more points than rocks, and outlines partly off the terrain.

        The outlines are those of sources and areas of interest; `setup.warnings.placement` makes the warnings.
        """
        releases = some_releases(self.prepared, MOST_LOOKED_AT)
        return placement_warnings(self.prepared, releases, source_heights(self.prepared, releases))

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
        """The numbers of rocks flown, planned, with each outcome, and of fragments, for titles and legends."""
        return RunCounts(
            rocks=self.totals.rocks, planned=self.planned, outcomes=self.totals.outcomes, pieces=self.totals.pieces
        )


def sentence_of(outcome: Outcome, scene: Scene) -> str:
    """Return the sentence that explains an outcome in tables and files.

    A ground model may have its own sentence for STOPPED, for example if it ignores friction.
    """
    stopped = scene.ground_model.model_spec.STOPPED
    return stopped if outcome == Outcome.STOPPED and stopped is not None else OUTCOME_SENTENCES[outcome]
