"""Build the barriers of a scene on its terrain: each line is cut into parts that stand on one facet each."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.effects.barriers import CORNER, Barriers, PanelSegments
from rpf3d_core.effects.obstacle_cells import cells_of
from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import local_plan
from rpf3d_core.formats.polylines import lines_along
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.barriers import BarriersSpec
from rpf3d_core.setup.coverage import extents
from rpf3d_core.terrain.facet_geometry import NEAR
from rpf3d_core.terrain.facets import Terrain, tolerance_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.terrain.sections import section_of

JOULE_PER_KJ = 1000.0


class _Straight(NamedTuple):
    """A straight section of a barrier, between two corners of its line.

    ends : (2, 2) m, in plan, local frame; barrier : number of the barrier
    key, given : for messages: the key in the scene, and the whole line (P, 2 or 3) in the coordinates of the scene
    """

    ends: FloatArray
    barrier: int
    key: str
    given: FloatArray


class _BarrierPart(NamedTuple):
    """One part of a barrier, on one facet.

    foot : (2, 3) m, the ends of the part's foot, local frame; facet : number of the facet below the part
    line : number of the straight section between two corners that contains this part, counted over all barriers
    barrier : number of the barrier
    """

    foot: FloatArray
    facet: int
    line: int
    barrier: int


def barriers_of(model_spec: BarriersSpec, scene: Scene, terrain: Terrain) -> Barriers:
    """Return the barriers of a scene in the form that the flight loops read.

    Raises
    ------
    InputError
        A line is damaged, has no length, leaves the terrain, or crosses a hole in it; the message names the key.
    """
    pieces = list(_pieces(model_spec, scene, terrain))
    foot = np.array([piece.foot for piece in pieces])
    facet, line, barrier = (np.array([piece[k] for piece in pieces], dtype=np.int64) for k in (1, 2, 3))
    way = foot[:, 1] - foot[:, 0]
    x, y, z, dx, dy, dz = (np.ascontiguousarray(column) for column in (*foot[:, 0].T, *way.T))
    panel = PanelSegments(
        x=x, y=y, z=z, dx=dx, dy=dy, dz=dz, facet=facet, line=line, barrier=barrier,
        height=np.array([spec.height * spec.residual_height for spec in model_spec.panels]),
        capacity=np.array([JOULE_PER_KJ * spec.capacity_kj for spec in model_spec.panels]),
        taken=np.array([spec.taken_by_break for spec in model_spec.panels]),
        top=np.array([1.0 if spec.measured_at == "top" else 0.0 for spec in model_spec.panels]),
    )  # fmt: skip
    plan = foot[..., :2]
    cells = cells_of(plan.min(axis=1) - CORNER, plan.max(axis=1) + CORNER)
    return Barriers(first=0, panel=panel, slack=NEAR * tolerance_of(terrain), cells=cells)


def barriers_as_obstacles(name: str, model_spec: BarriersSpec, barriers: Barriers) -> Obstacles:
    """Return the barriers of a scene for pictures and recordings: names, heights, and lines along their feet (P, 3) m.

    A height (m) is that of the part of the barrier that still stands: `height` times `residual_height`.
    """
    panel = barriers.panel
    names = tuple(f"{name}.{spec.name}" for spec in model_spec.panels)
    begin = np.stack([panel.x, panel.y, panel.z], axis=1)
    end = begin + np.stack([panel.dx, panel.dy, panel.dz], axis=1)
    parts = [its for number in range(int(panel.line.max()) + 1) if (its := panel.line == number).any()]
    owners = [int(panel.barrier[its][0]) for its in parts]
    lines = tuple((names[owner], np.concatenate([begin[its], end[its][-1:]]))
                  for owner, its in zip(owners, parts, strict=True))  # fmt: skip
    heights = tuple(spec.height * spec.residual_height for spec in (model_spec.panels[owner] for owner in owners))
    return Obstacles(names=names, owner=panel.barrier, lines=lines, stems=NO_OBSTACLES.stems, heights=heights)


def _pieces(model_spec: BarriersSpec, scene: Scene, terrain: Terrain) -> Iterator[_BarrierPart]:
    """Yield the parts of all barriers, in the order of the scene; each part stands on one facet.

    Raises
    ------
    InputError
        A line is damaged, has no length, leaves the terrain, or crosses a hole in it; the message names the key.
    """
    sections = list(_sections(model_spec, scene, terrain))
    for number, straight in enumerate(_in_one_place(sections, NEAR * tolerance_of(terrain))):
        begin, end = straight.ends
        section = section_of(terrain, begin, end)
        if section is None:
            raise InputError(f"{straight.key} of {model_spec.panels[straight.barrier].name!r} leaves the terrain, or "
                             f"crosses a hole in it: {extents(terrain, straight.given)}")  # fmt: skip
        at = begin + section.share[..., None] * (end - begin)
        feet = np.concatenate([at, section.z[..., None]], axis=-1)
        yield from (
            _BarrierPart(foot=foot, facet=int(f), line=number, barrier=straight.barrier)
            for foot, f in zip(feet, section.facet, strict=True)
        )


def _sections(model_spec: BarriersSpec, scene: Scene, terrain: Terrain) -> Iterator[_Straight]:
    """Yield the straight sections of all barriers, in the order of the scene.

    Raises
    ------
    InputError
        A line is damaged or has no length; the message names the key.
    """
    for barrier, spec in enumerate(model_spec.panels):
        key = f"{scene.path}: `effects.barriers.panels[{barrier}].along`"
        try:
            lines = lines_along(spec.along)
        except InputError as fault:
            raise InputError(f"{key} {fault}") from fault
        for line in lines:
            plan = local_plan(terrain.frame, line)
            yield from (_Straight(ends=np.array(ends), barrier=barrier, key=key, given=line) for ends in pairwise(plan))


def _in_one_place(sections: Sequence[_Straight], slack: float) -> Iterator[_Straight]:
    """Yield the sections of barriers; move a section that nearly lies on a line of an earlier section onto this line.

    Only sections of other barriers count, the first one first. A rock meets the vertical plane of a section. The flight
    loop treats planes within the slack of each other as planes at the same place, so that a rock meets each of them
    once (`effects/barriers.py`). Of three planes, the first may be within the slack of the second, and the second
    within the slack of the third, but not the first of the third: then a rock would meet one of them twice.

    After the move, two planes are either in one place or farther apart than the slack. Exception: planes that cross
    each other at an angle of less than the slack over their length.

    slack : m, largest distance of both ends of a section from the line onto which the section is moved
    """
    ends = np.array([section.ends for section in sections])
    owners = np.array([section.barrier for section in sections])
    for k, section in enumerate(sections):
        near = _nearly_on(ends[:k], ends[k], slack) & (owners[:k] != section.barrier)
        if near.any():
            ends[k] = _onto(ends[near.argmax()], ends[k])
        yield section._replace(ends=ends[k])


def _nearly_on(lines: FloatArray, section: FloatArray, slack: float) -> NDArray[np.bool_]:
    """Return flags (N,), True for each line on which a section nearly lies.

    Both ends of the section are then at most `slack` from the line, extended beyond its ends. Along the line, the
    section overlaps the line, or lies at most `slack` beyond one end of the line.

    lines : (N, 2, 2) m, ends of the lines in plan; section : (2, 2) m, ends of the section
    slack : m, largest distance of both ends of the section from the line
    """
    way = lines[:, 1] - lines[:, 0]
    length = np.maximum(np.hypot(way[:, 0], way[:, 1]), np.finfo(float).tiny)
    east, north = np.moveaxis(section[None] - lines[:, None, 0], -1, 0)
    off = np.abs(east * way[:, None, 1] - north * way[:, None, 0]) / length[:, None]
    along = (east * way[:, None, 0] + north * way[:, None, 1]) / length[:, None]
    overlaps = (along.max(axis=1) >= -slack) & (along.min(axis=1) <= length + slack)
    return np.asarray((off <= slack).all(axis=1) & overlaps)


def _onto(line: FloatArray, section: FloatArray) -> FloatArray:
    """Return the ends (2, 2) m of a section after its projection at right angles onto a line, both (2, 2) m in plan."""
    way = line[1] - line[0]
    return np.asarray(line[0] + np.outer((section - line[0]) @ way / (way @ way), way))
