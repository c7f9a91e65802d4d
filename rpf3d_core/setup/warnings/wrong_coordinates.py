"""Collect the warnings of coordinates that look wrong: those of the terrain, and those of inputs off the terrain."""

from collections.abc import Iterator, Sequence

from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.warnings.extents import TERRAIN, Extent, terrain_extent
from rpf3d_core.setup.warnings.misplaced_inputs import (
    are_axes_known,
    is_in_another_system,
    is_in_opposite_heights,
    off_the_terrain,
    unknown_systems,
)
from rpf3d_core.setup.warnings.plan_boxes import overlaps, plan_box
from rpf3d_core.setup.warnings.terrain_coordinates import (
    below_zero,
    is_on_its_side,
    is_too_large,
    mostly_vertical,
    terrain_hints,
    turned_over,
)
from rpf3d_core.terrain.mesh.faults import FaultReport


def placing_notes(scene: Scene, faults: FaultReport, others: Sequence[Extent], is_run: bool = False) -> tuple[str, ...]:
    """Return sentences on wrong-looking coordinates of the terrain, and on inputs that look misplaced.

    The result is empty if everything looks right. The function reads no file.
    faults : the report on the mesh of the terrain; others : from `extents.other_extents`
    is_run : True for the notes of a run: if the scene states `up`, there is no note on a terrain of vertical facets or
        below height 0
    """
    terrain = terrain_extent(scene, faults)
    up = scene.terrain.up
    notes = list(placing_hints([terrain, *others], scene.terrain.crs, up))
    lies_on_its_side = is_on_its_side(terrain, up)
    is_explained = lies_on_its_side or are_axes_known(terrain, others, up)
    is_trusted = is_run and "up" in scene.terrain.model_fields_set
    if not is_explained and not is_trusted and not is_too_large(terrain, up):
        notes.extend(mostly_vertical(terrain, faults, up))
    if not is_explained:
        notes.extend(turned_over(faults, up))
    is_opposite = any(up == "z" and is_in_opposite_heights(other, terrain) for other in others)
    if scene.terrain.files is not None and not lies_on_its_side and not is_trusted and not is_opposite:
        notes.extend(below_zero(terrain, up))
    return tuple(notes)


def placing_hints(extents: Sequence[Extent], crs: str | None, up: str) -> Iterator[str]:
    """Yield sentences on wrong-looking coordinates of the terrain, and on inputs that look misplaced.

    Yield nothing if the first extent is not that of the terrain.
    extents : the terrain first; crs : reference system of the terrain; up : the axis that points up in the input
    """
    if not extents or extents[0].name != TERRAIN:
        return
    terrain, others = extents[0], extents[1:]
    yield from terrain_hints(terrain, crs, up)
    yield from unknown_systems(terrain, others, crs)
    if is_on_its_side(terrain, up):
        return  # no input fits such a plan
    for other in others:
        if is_in_another_system(other, crs):
            continue  # `refuse_other_systems` offers the transformation
        if not overlaps(plan_box(other, up), plan_box(terrain, up)):
            yield from off_the_terrain(other, terrain, crs, up)
        elif up == "z" and is_in_opposite_heights(other, terrain):
            yield (
                f"{other.name}: its heights have the opposite sign of the terrain's heights: "
                "does z point down in one of them?"
            )
