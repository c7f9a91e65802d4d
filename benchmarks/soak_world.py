"""Make the pit of a soak test and its release places, and compute the alert level that each place demands.

The demanded levels do not come from the node. A run of the core over the same pit gives the share of rocks that reach
the ramp, and the thresholds of the site give the level of this share. The simulator must publish at least this level.
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
"""Speed (m/s) of rocks from every source, eastwards."""
ROCKS = 2000
"""Number of rocks of the run that determines a demanded level; shares are then known to 0.02."""
SOURCES = 12
SPREAD_X, SPREAD_V = 0.3, 0.2
"""Half-widths (m, m/s) of the spread of the node's rocks; the spread in plan is too small to affect the levels."""
PLACES = {
    "crest of the wall": (-606.0, -60.0, 60.0),
    "bench above the ramp": (-552.0, -60.0, 20.0),
    "bench edge": (-578.0, -30.0, 20.0),
    "catch bench": (-560.0, -40.0, 20.0),
    "far wall": (-606.0, -140.0, -110.0),
}
"""Release place -> easting (m), and northings (m) of both ends of the line of sources."""
PATCHED = ((-480.0, -300.0), (-250.0, 250.0))
"""Area in which patches change the ground (m): below the ramp, so that they change no demanded level."""


@dataclass(frozen=True, eq=False)
class World:
    """The pit that the test publishes, and the alert level that each release place demands.

    content : the messages of the pit; heights : finds heights of its ground; demands : name of a place -> level
    """

    content: ShiftContent
    heights: Heights
    demands: dict[str, Level]


def world_of(folder: Path) -> World:
    """Return the pit, and the alert level that each place demands, from runs without the node.

    folder : receives the results of these runs
    """
    terrain = pit_terrain(Pit(triangles=150_000, seed=1))  # as in the scene
    heights = Heights(terrain)
    demands = {place: demanded(places_of(place, heights), folder) for place in PLACES}
    return World(content=shift_content(SCENE, 12), heights=heights, demands=demands)


def places_of(place: str, heights: Heights) -> Any:
    """Return the positions (SOURCES, 3) m of the sources at a place, on the ground; heights : of this ground."""
    x, south, north = PLACES[place]
    plan = np.column_stack([np.full(SOURCES, x), np.linspace(south, north, SOURCES)])
    return np.column_stack([plan, heights.at(plan)])


def demanded(places: Any, folder: Path) -> Level:
    """Return the lowest level that the node must publish for rocks from places (S, 3) m, from a run without the node.

    This is the level of the share of rocks that reach the ramp. The node itself uses the upper end of the share's 95 %
    interval, so it may publish a higher level. Patches do not change the share (`PATCHED`).
    """
    scene, spread = read_scene(SCENE), (SPREAD_V, SPREAD_V, SPREAD_V)
    changed = {"line": None, "points": tuple(map(tuple, places.tolist())), "rocks": ROCKS,
               "velocity": (SPEED, 0.0, 0.0), "velocity_spread": spread}  # fmt: skip
    source = scene.sources[0].model_copy(update=changed)
    run = run_scene(scene.model_copy(update={"sources": (source,)}), folder / "demanded")
    areas = tuple(area._replace(high=area.reached / area.flown) for area in areas_of(run.maps))
    thresholds = read_site(SITE)
    evidence = Evidence(1, 0, 0, 0, 0, "", "", 1, scene.seed, "", areas)
    return decide(None, evidence, thresholds, 0).evident
