"""The mine of a soak: its pit, where rocks may come from and which level each place demands, and random new ground.

What a place demands is not taken from the node: a run of the core over the same pit says how many rocks reach the ramp,
and the level that even the lower end of that interval reaches is what must be told.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from live_messages import Heights

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence, areas_of
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.site import read_site
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain
from rpf3d_ros.demo.shift_content import ShiftContent, shift_content

ROOT = Path(__file__).resolve().parent.parent
SCENE, SITE = ROOT / "config/scenes/shift.yaml", ROOT / "config/site_shift.yaml"
SPEED = 4.0
"""m/s, eastwards, of every source."""
ROCKS = 2000
"""Rocks that say what a place demands: shares to 0.02."""
SOURCES = 12
SPREAD_X, SPREAD_V = 0.3, 0.2
"""Half-widths (m, m/s) that the node spreads rocks by; in plan it is too little to matter for what is demanded."""
CERTAIN = 0.7
"""Part of the share that a level is demanded at: patches and the spread in plan change a little of it."""
PLACES = {
    "crest of the wall": (-606.0, -60.0, 60.0),
    "bench above the ramp": (-552.0, -60.0, 20.0),
    "bench edge": (-578.0, -30.0, 20.0),
    "catch bench": (-560.0, -40.0, 20.0),
    "far wall": (-606.0, -140.0, -110.0),
}
"""Easting (m) and the northings (m) between which rocks leave."""
PATCHED = ((-480.0, -300.0), (-250.0, 250.0))
"""Where patches are laid (m): below the ramp, so that they change no demand."""


@dataclass(frozen=True, eq=False)
class World:
    """content : the pit as it is published; heights : its ground; demands : place -> level"""

    content: ShiftContent
    heights: Heights
    demands: dict[str, Level]


def world_of(folder: Path) -> World:
    """The pit, and what each place demands by a run of the core. Writes its scenes into a folder."""
    terrain = pit_terrain(Pit(triangles=150_000, seed=1))  # as the scene says
    return World(shift_content(SCENE, 12), Heights(terrain), {place: demanded(place, folder) for place in PLACES})


def places_of(place: str) -> Any:
    """Positions (SOURCES, 3) m of sources along a place; the node puts them on the ground."""
    x, south, north = PLACES[place]
    y = np.linspace(south, north, SOURCES)
    return np.column_stack([np.full(SOURCES, x), y, np.full(SOURCES, 1700.0)])


def demanded(place: str, folder: Path) -> Level:
    """The level that the core's own run from a place reaches even at the lower end of the share's interval."""
    scene, spread = read_scene(SCENE), (SPREAD_V, SPREAD_V, SPREAD_V)
    changed = {"line": None, "points": tuple(map(tuple, places_of(place).tolist())), "rocks": ROCKS,
               "velocity": (SPEED, 0.0, 0.0), "velocity_spread": spread}  # fmt: skip
    source = scene.sources[0].model_copy(update=changed)
    run = run_scene(scene.model_copy(update={"sources": (source,)}), folder / "demanded")
    areas = tuple(area._replace(high=CERTAIN * area.low) for area in areas_of(run.maps))
    thresholds = read_site(SITE)
    evidence = Evidence(1, 0, 0, 0, 0, "", "", 1, scene.seed, "", areas)
    return decide(None, evidence, thresholds, 0).evident
