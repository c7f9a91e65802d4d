"""Fly the rocks of a site many times, with terrain and releases that are prepared once, and other materials or models.

All flights use the same random numbers, so differences between flights come only from the materials and models.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.prepared import Prepared, check_releases, prepare, releases_in_ranges, scene_flight
from rpf3d_core.values import Outcome

Keys = Mapping[str, Any]
"""Keys that replace those of a scene, such as `rebound`, `ground`, `materials`; keys of `rock` are added to it."""


@dataclass(frozen=True, eq=False)
class Ends:
    """End points of N rocks, in the coordinates of the input.

    source : (N,) number of each rock's source; end : (N, 3) m; stopped : (N,) True if the rock stopped

    Releases are not kept, because distances begin at a place of the field (`basis.py`).
    """

    source: IntArray
    end: FloatArray
    stopped: FloatArray


class Site:
    """A prepared scene whose rocks can fly many times, with other materials and other models."""

    def __init__(self, scene: Scene) -> None:
        self.prepared: Prepared = prepare(scene)
        self.releases = releases_in_ranges(self.prepared, [range(source.rocks) for source in self.prepared.sources])
        check_releases(self.prepared, self.releases)

    def fly(self, keys: Keys) -> Ends:
        """Return the end points of all rocks, with some keys of the scene replaced."""
        scene = with_keys(self.prepared.scene, keys)
        flight = scene_flight(scene, self.prepared.terrain)
        flown = fly_ensemble(self.prepared.engine, flight, self.releases, record=False, paths=0).deposits
        end = self.prepared.terrain.frame.points_to_input(flown.x)
        return Ends(flown.source, end, flown.outcome == Outcome.STOPPED)


def with_keys(scene: Scene, keys: Keys) -> Scene:
    """Return a scene with some of its keys replaced, after the same checks as for a scene file.

    Keys of `rock` are added to those of the scene. A contact model replaces the rebound model.
    """
    replaced = {*keys, *(("rebound",) if "contact" in keys else ())}
    written = {name: getattr(scene, name) for name in scene.model_fields_set if name not in replaced}
    if "rock" in keys:
        own = {name: getattr(scene.rock, name) for name in scene.rock.model_fields_set}
        written["rock"] = own | dict(keys["rock"])
    return Scene.model_validate({**keys, **written})
