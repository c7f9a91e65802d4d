"""What a run has found: all that the files of a result are written from."""

from collections.abc import Mapping
from dataclasses import dataclass

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.convergence import Step
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.faults import FaultReport


@dataclass(frozen=True, eq=False)
class Findings:
    """A scene, its terrain, and what came of its rocks.

    flights : of the rocks that are drawn, all or an even selection; totals, maps : of all that have flown
    planned : rocks that should have flown; more than have flown if the run was interrupted
    steps : what was known after each doubling, where the number of rocks was left open
    timings : name -> wall seconds, such as `read_s` and `wall_s`
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
