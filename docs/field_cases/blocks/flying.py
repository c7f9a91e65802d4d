"""Fly rocks with a shape many times: terrain and shapes are prepared once, only the ground's three numbers change.

All sets of parameters fly the same rocks, with the same orientations. So a difference between two flights comes from
the parameters, and from the chaos that a small change starts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from field_cases.flying import Ends
from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.prepared import Prepared, check_releases, prepare, releases_in_ranges, scene_materials
from rpf3d_core.setup.shapes import polyhedra_of
from rpf3d_core.shapes.polyhedron import Polyhedron
from rpf3d_core.shapes.table import shape_table
from rpf3d_core.values import Outcome

Ground = Mapping[str, float]
"""restitution, friction and rolling_resistance (-) of all zones."""


class Flown(NamedTuple):
    """End points of N rocks, and the number of the shape of each rock (N,)."""

    ends: Ends
    shape: IntArray


class BlockSite:
    """A prepared scene of rocks with a shape, which fly many times over ground with other numbers.

    shapes : the shapes of the rocks, each of its own size; those of the scene if not given
    """

    def __init__(self, scene: Scene, shapes: Sequence[Polyhedron] = ()) -> None:
        prepared = prepare(scene)
        self.shapes = list(shapes) or polyhedra_of(scene)[0]
        table = shape_table(self.shapes, [1.0] * len(self.shapes))
        volumes = np.array([shape.volume for shape in self.shapes])
        models = prepared.flight.models
        self.prepared: Prepared = replace(
            prepared,
            rock=replace(prepared.rock, size=None, volumes=volumes, shares=table.shares),
            flight=replace(prepared.flight, models=models._replace(rebound=models.rebound._replace(shapes=table))),
        )

    def fly(self, ground: Ground, rocks: range | None = None) -> Flown:
        """Fly the rocks of each source whose numbers are in a range; all rocks of the scene if no range is given."""
        prepared = self.prepared
        scene = prepared.scene.model_copy(update={"materials": {"default": Material.model_validate(dict(ground))}})
        ranges = [range(source.rocks) if rocks is None else rocks for source in prepared.sources]
        releases = releases_in_ranges(prepared, ranges)
        check_releases(prepared, releases)
        flight = replace(prepared.flight, materials=scene_materials(scene, prepared.terrain.zones))
        flown = fly_ensemble(prepared.engine, flight, releases, record=False, paths=0).deposits
        end = prepared.terrain.frame.points_to_input(flown.x)
        assert releases.shape is not None, "the scene's rocks have a shape"
        return Flown(Ends(flown.source, end, flown.outcome == Outcome.STOPPED), releases.shape)


def joined(parts: Sequence[Flown]) -> Flown:
    """Return the rocks of several flights as one."""
    names = ("source", "end", "stopped")
    ends = Ends(*(np.concatenate([getattr(part.ends, name) for part in parts]) for name in names))
    return Flown(ends, np.concatenate([part.shape for part in parts]))
