"""What `rpf3d check` says before a run: faults of the mesh, where the sources are, and what the run will cost."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.compiling import HAS_NUMBA
from rpf3d_core.ensemble.fly import Flight, choose_engine, fly_ensemble
from rpf3d_core.ensemble.releases import Releases, releases_of
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.io.scene_sources import scene_sources
from rpf3d_core.io.terrain import read_terrain
from rpf3d_core.run import scene_flight, scene_rock
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.terrain.faults import FaultReport
from rpf3d_core.values import Outcome

PILOT_ROCKS = 20
"""Rocks flown by the reference engine to see what a rock costs."""
COMPILED_GAIN = 300.0
"""How many times faster the compiled engine flies, rounded down from the demo scene in docs/performance.md."""
COMPILE_S = 12.0
"""Seconds to compile on the first run after an installation; later runs load the result in well under 1 s."""


@dataclass(frozen=True)
class SourceHeight:
    """Heights above the ground of a source's rocks (m): lowest and highest, and how many have no ground below."""

    name: str
    rocks: int
    lowest: float
    highest: float
    under_ground: int
    off_terrain: int

    def describe(self) -> str:
        """One line for people."""
        found = f"{self.rocks:,} {'rock' if self.rocks == 1 else 'rocks'}"
        if self.lowest <= self.highest:
            low, high = f"{self.lowest:.2f}", f"{self.highest:.2f}"
            found += f", {low if low == high else f'{low} to {high}'} m above the ground"
        if self.under_ground:
            found += f"; {self.under_ground:,} UNDER THE GROUND"
        if self.off_terrain:
            found += f"; {self.off_terrain:,} OFF THE TERRAIN"
        return found


@dataclass(frozen=True)
class Cost:
    """What a run will take: rocks, the engine that `engine` comes down to, and seconds to fly; from a pilot.

    impacts : mean impacts a rock; pilot : rocks flown to find out; unresolved : how many of them ended unresolved
    """

    rocks: int
    engine: str
    fly_s: float
    compile_s: float
    impacts: float
    pilot: int
    unresolved: int


@dataclass(frozen=True)
class Check:
    """The report on a scene; `fit` tells whether it can be run."""

    scene: Scene
    faults: FaultReport
    sources: list[SourceHeight]
    cost: Cost | None

    @property
    def fit(self) -> bool:
        """Whether every rock starts above ground."""
        return not any(source.under_ground or source.off_terrain for source in self.sources)


def check_scene(scene: Scene) -> Check:
    """Inspect a scene and its terrain, and fly a few rocks to see what the run will cost.

    Raises
    ------
    InputError
        The scene or one of its files is refused.
    """
    terrain, faults = read_terrain(scene)
    flight = scene_flight(scene, terrain)
    engine = engine_of("reference", facets_of(terrain))
    sources = scene_sources(scene, terrain)
    releases = releases_of(sources, scene_rock(scene), scene.seed, engine, terrain.frame)
    below = engine.ground_below(releases.x)
    heights = [_heights(source.name, below[releases.source == i]) for i, source in enumerate(sources)]
    heights = [_told_apart(height, i, releases, below, engine) for i, height in enumerate(heights)]
    report = Check(scene, faults, heights, None)
    return Check(scene, faults, heights, _cost(scene, flight, releases, engine)) if report.fit else report


def _heights(name: str, below: NDArray[np.float64]) -> SourceHeight:
    """Heights of one source's rocks from what lies below them (R, 3)."""
    good = (below[:, 1] >= 0) & (below[:, 2] > 0)
    heights = below[good, 0]
    lowest, highest = (heights.min(), heights.max()) if len(heights) else (np.inf, -np.inf)
    return SourceHeight(name, len(below), float(lowest), float(highest), int((~good).sum()), 0)


def _told_apart(
    found: SourceHeight, number: int, releases: Releases, below: NDArray[np.float64], engine: Engine
) -> SourceHeight:
    """Of the rocks without ground below them, those with ground above are under it, the others off the terrain."""
    bad = (releases.source == number) & ((below[:, 1] < 0) | (below[:, 2] <= 0))
    top = np.array(releases.x[bad])
    top[:, 2] = np.maximum(top[:, 2], engine.facets.high[2]) + 1.0
    off = int((engine.ground_below(top)[:, 1] < 0).sum()) if bad.any() else 0
    return SourceHeight(found.name, found.rocks, found.lowest, found.highest, found.under_ground - off, off)


def _cost(scene: Scene, flight: Flight, releases: Releases, engine: Engine) -> Cost:
    """Fly a pilot, evenly spread over all rocks, and scale its time up."""
    rocks = len(releases.x)
    chosen = np.unique(np.linspace(0, rocks - 1, PILOT_ROCKS).astype(int))
    fields = ("source", "rock", "x", "v", "mass", "radius")
    pilot = Releases(**{name: getattr(releases, name)[chosen] for name in fields})
    began = time.perf_counter()
    deposits = fly_ensemble(engine, flight, pilot).deposits
    fly_s = (time.perf_counter() - began) * rocks / len(chosen)
    name = choose_engine(scene.engine, rocks, HAS_NUMBA)
    unresolved = int((deposits.outcome == Outcome.UNRESOLVED_CONTACT).sum())
    gain, compile_s = (COMPILED_GAIN, COMPILE_S) if name == "compiled" else (1.0, 0.0)
    return Cost(rocks, name, fly_s / gain, compile_s, float(deposits.impacts.mean()), len(chosen), unresolved)
