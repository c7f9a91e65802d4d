"""Prepare a simulator: read scene and thresholds, open the log, restore the last good terrain, compile all code."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.log_files import NotLogged
from rpf3d_core.alerts.site import read_site
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.alerts.witness import Witness
from rpf3d_core.errors import InputError, SceneError
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.live.answers import warm_answers
from rpf3d_core.live.areas import too_small
from rpf3d_core.live.ground import ZONE, Workshop
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import OF_THE_MAP, PreparedTerrain, stand_after, stand_on
from rpf3d_core.live.store import Store, StoredSurveys, read_last
from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.live.triggers import trigger_of
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.zone_materials import check_materials
from rpf3d_core.setup.areas import plan_rings, read_areas
from rpf3d_core.simulation.engines import Reference
from rpf3d_ros.alerts.source_topics import BY_HAND
from rpf3d_ros.alerts.version import version
from rpf3d_ros.engine.terrain_faults import TerrainBefore
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.messages.area_messages import EQUIPMENT, LIVE_AREA
from rpf3d_ros.messages.map_frame import FARTHEST
from rpf3d_ros.messages.stamps import SECOND

WARM_SIDE, WARM_STEP = 60, 2.0
"""Points along a side of the artificial slope that is used to compile all code, and their distance (m).

The slope has enough cells that compiled code is used in place of NumPy.
"""

WARM_ROCKS = 300
"""Number of rocks that fly over the artificial slope: enough that all code is used and therefore compiled."""

LIVE_AREAS = (LIVE_AREA, EQUIPMENT)
"""Names of the areas whose outlines are received as messages."""

DECISIONS = "decisions"
"""Default folder of the decision log, next to the site file."""


@dataclass(frozen=True, eq=False)
class StationConfiguration:
    """Everything that a configured simulator needs: scene, thresholds, log, store and last terrain.

    workshop : builds the terrains; store : keeps the terrain on disk, None if no store is named
    standing : the prepared terrain from the store; None if there is no terrain that can be used
    standing_report : age of this terrain and its unreadable patches, or why the terrain cannot be read; "" if the store
        has no terrain
    thresholds : thresholds of the site, None if there are no alerts
    log : the decision log, None if there are no alerts or if the log cannot be opened
    log_fault : why the log cannot be opened, or problems found in the log; "" without problems
    compile_s : wall time of compiling (s)
    before : which patches the terrain from the store contains or lacks
    parameters, scene : parameters of the node, and the live scene
    """

    parameters: SimulatorParameters
    scene: Scene
    workshop: Workshop
    store: Store | None
    standing: PreparedTerrain | None
    standing_report: str
    thresholds: Thresholds | None
    log: DecisionLog | None
    log_fault: str
    compile_s: float
    before: TerrainBefore = field(default_factory=TerrainBefore)

    @property
    def most_ahead(self) -> float:
        """Time (s) that stamps may be ahead of the clock: the smaller of two settings.

        The settings are the node's parameter `most_ahead` and, if there is a site file, its `clock_tolerance_s`.

        A message with a stamp further ahead is refused when it is received, because the combined evidence of several
        regions contains the oldest stamp only.
        """
        if self.thresholds is None:
            return self.parameters.most_ahead
        return min(self.parameters.most_ahead, self.thresholds.evidence.clock_tolerance_s)

    @property
    def most_behind(self) -> dict[str, float]:
        """Time (s) that stamps may be behind the clock, by topic.

        A clicked source ends without a fault when it is too old, so a click that is almost too old when it is received
        would hardly count. Other topics have no limit, because old evidence of a sensor is a fault.
        """
        return {} if self.thresholds is None else {BY_HAND: self.thresholds.evidence.sources_max_age_s / 2.0}


def configuration_of(parameters: SimulatorParameters, given: Mapping[str, Any], now_ns: int) -> StationConfiguration:
    """Read and prepare everything for a configured simulator; call this on a thread, because it takes seconds.

    given : values of the scene parameters that a user gave, by name; now_ns : time of the node's clock (ns)

    Raises InputError if the scene, the site file or the store is refused. After any error the store is closed, so that
    the next attempt can open it.
    """
    scene = live_scene(given)
    _check_names(scene)
    _check_places(scene)
    _check_zones(scene)
    thresholds = read_site(parameters.site_file) if parameters.site_file else None
    if thresholds is not None:
        _check_rocks(scene, thresholds)
        _check_no_fragments(scene)
        _check_areas(scene, thresholds)
    store = _store_of(parameters)
    try:
        compile_s = warm(scene, parameters)
        workshop = _workshop_of(scene, parameters)
        standing, standing_report, before = _restored(store, scene, workshop, parameters, now_ns)
        log, log_fault = _log_of(parameters) if thresholds is not None else (None, "")
    except BaseException:
        if store is not None:
            store.close()  # otherwise its folder would be in use at the next attempt to configure
        raise
    return StationConfiguration(
        parameters=parameters, scene=scene, workshop=workshop, store=store, standing=standing,
        standing_report=standing_report, thresholds=thresholds, log=log, log_fault=log_fault, compile_s=compile_s,
        before=before,
    )  # fmt: skip


def _check_rocks(scene: Scene, thresholds: Thresholds) -> None:
    """Raise InputError if `target.most_rocks` of the scene is below `evidence.fewest_rocks` of the site file."""
    fewest, most = thresholds.evidence.fewest_rocks, scene.target.most_rocks
    if most < fewest:
        raise InputError(
            f"target.most_rocks is {most}, below the {fewest} rocks that the site file demands for a decision"
            " (evidence.fewest_rocks), so the level would always be fault: raise target.most_rocks"
        )


def _check_no_fragments(scene: Scene) -> None:
    """Raise InputError if rocks of a scene may break: each fragment would count as a rock in the shares of an area."""
    if scene.effects.fragmentation is not None:
        raise InputError(
            "effects.fragmentation of the scene does not go with a site file: each fragment counts as a rock, so many "
            "fragments that stop early would hide the rocks that reach an area. Leave fragmentation out of the live "
            "scene"
        )


def _check_names(scene: Scene) -> None:
    """Raise InputError if an area of the scene has the name of a live area, which would replace the scene's area."""
    for area in scene.areas_of_interest:
        if area.name in LIVE_AREAS:
            raise InputError(
                f"areas_of_interest of the scene has {area.name}, a name that is reserved for areas from topics: "
                f"choose a name other than {' and '.join(LIVE_AREAS)}"
            )


def _check_zones(scene: Scene) -> None:
    """Raise InputError if a material of a scene belongs to a zone: live terrain has only one zone."""
    try:
        check_materials(scene, (ZONE,))
    except SceneError as error:
        raise InputError(
            f"{error}. Live terrain has only one zone, {ZONE!r}, because surveys have no zones: state the material as "
            "materials.default"
        ) from None


def _check_places(scene: Scene) -> None:
    """Raise InputError if an area of the scene lies too far from the origin of the map, or is too small.

    Too small means smaller than any real area of interest (`areas.too_small`).

    The coordinates of an area that is too far away may be survey coordinates, and the coordinates of an area that is
    too small may be degrees or kilometres.
    """
    for name, polygons in read_areas(scene).items():
        farthest = max(float(np.abs(ring).max()) for ring in plan_rings(polygons))
        if farthest > FARTHEST:
            raise InputError(
                f"{scene.path}: the area of interest {name!r} has coordinates up to {farthest:.0f} m, but must be in "
                f"{OF_THE_MAP}, and at most {FARTHEST:.0f} m from its origin: subtract map_origin from its corners"
            )
        if fault := too_small(plan_rings(polygons)):
            raise InputError(f"{scene.path}: the area of interest {name!r} {fault}")


def _check_areas(scene: Scene, thresholds: Thresholds) -> None:
    """Raise InputError if the site names an area (not a pattern) that neither the scene nor a topic defines.

    Raise InputError as well if a pattern of the site matches no area, but would match an area if upper and lower case
    were equal. Areas whose full names have limits are not considered for such a match.
    """
    outlined = [area.name for area in scene.areas_of_interest]
    for name in thresholds.named_in_full:
        if name not in (*outlined, *LIVE_AREAS):
            raise InputError(
                f"the site file watches {name}, which has no outline, so the level would always be fault: the scene"
                f" defines {', '.join(outlined) or 'no areas_of_interest'}, topics define {' and '.join(LIVE_AREAS)}"
            )
    names = (*outlined, *LIVE_AREAS)
    for pattern in thresholds.areas:
        if any(fnmatchcase(name, pattern) for name in names):
            continue
        meant = [name for name in names if fnmatchcase(name.lower(), pattern.lower()) and name not in thresholds.areas]
        if meant:
            raise InputError(
                f"the site file has limits for {pattern}, which matches no area; it would match {meant[0]} if upper "
                f"and lower case were equal: write it as the name, or give {meant[0]} limits of its own"
            )


def spread_of(parameters: SimulatorParameters) -> ReleaseSpread:
    """Return how rocks are spread around each source, from the parameters of the node."""
    above = parameters.above_ground if parameters.above_ground >= 0.0 else None
    return ReleaseSpread(
        position=parameters.position_spread, velocity=parameters.velocity_spread, above_ground=above,
        highest=parameters.highest_source, map_origin=parameters.frame.origin,
    )  # fmt: skip


def warm(scene: Scene, parameters: SimulatorParameters) -> float:
    """Compile the code of answers before the first sources arrive, and return the wall time (s) that this took.

    The function builds a terrain from an artificial slope and a patch, flies the first stage of one answer over this
    terrain, and discards the result. The scene's areas and barriers lie elsewhere. Therefore the areas are not used,
    and the barriers are moved onto the slope. With the reference engine, which needs no compiling, only one rock flies.
    """
    began = time.perf_counter()
    y, x = np.mgrid[0:WARM_SIDE, 0:WARM_SIDE] * WARM_STEP
    slope = GridSurvey(np.stack([x, y, 0.8 * x + np.sin(y)], axis=-1))
    anywhere = _on_the_slope(scene)
    workshop = _workshop_of(scene, parameters)
    whole = workshop.whole(slope)
    before = stand_on(whole, anywhere)
    _ = before.cells
    patch = GridSurvey(slope.points[20:30, 20:30] + (0.5, 0.5, 0.1))
    standing = stand_after(before, workshop.patched(whole, patch))
    _ = standing.cells
    middle = 0.5 * WARM_SIDE * WARM_STEP
    source = trigger_of(np.array([[1.5 * middle, middle, 1.3 * middle]]), np.array([[-3.0, 0.0, 0.0]]), None, 0)
    spread = ReleaseSpread(position=0.4 * middle, velocity=1.0, above_ground=2.0)
    warm_answers(standing, source, spread, WARM_ROCKS if standing.compiled else 1)
    return time.perf_counter() - began


def _on_the_slope(scene: Scene) -> Scene:
    """Return a scene without areas of interest, and with all barriers along one line of the artificial slope."""
    effects, barriers = scene.effects, scene.effects.barriers
    if barriers is not None:
        side = WARM_SIDE * WARM_STEP
        line = ((0.25 * side, 0.3 * side), (0.25 * side, 0.6 * side))
        panels = tuple(panel.model_copy(update={"along": line}) for panel in barriers.panels)
        effects = effects.model_copy(update={"barriers": barriers.model_copy(update={"panels": panels})})
    return scene.model_copy(update={"areas_of_interest": (), "effects": effects})


def _workshop_of(scene: Scene, parameters: SimulatorParameters) -> Workshop:
    reference = scene.engine == Reference.name or not HAS_NUMBA
    longest = parameters.longest_edge or None  # 0 m, the default: the limit follows from the cloud
    return Workshop(
        scene.terrain.weld, parameters.most_points, longest, reference=reference, must_face_up=True,
        tallest_face=parameters.tallest_face,
    )  # fmt: skip


def _store_of(parameters: SimulatorParameters) -> Store | None:
    """Return the store that keeps the terrain on disk; None if no store is named. Raises InputError on failure."""
    if not parameters.store:
        return None
    try:
        origin, longest = parameters.frame.origin, parameters.longest_edge
        return Store(Path(parameters.store), map_origin=origin, longest_edge=longest)
    except (OSError, InputError) as fault:
        raise InputError(f"store: {fault}") from fault


def _restored(
    store: Store | None, scene: Scene, workshop: Workshop, parameters: SimulatorParameters, now_ns: int
) -> tuple[PreparedTerrain | None, str, TerrainBefore]:
    """Return the prepared terrain from a store, a sentence on its age, and which patches it contains or lacks.

    Without a store, or if the store is empty, the terrain is None and the sentence "". If the terrain cannot be read,
    or was stored with other parameters, the terrain is None and the sentence gives the reason. The simulator then
    starts without a terrain.

    now_ns : current time (ns)
    """
    before = TerrainBefore(read_ns=time.time_ns())
    if store is None:
        return None, "", before
    try:
        last = read_last(store.folder)
        if last is not None:
            _check_origin(last, parameters.frame.origin)
            _check_longest_edge(last, parameters.longest_edge)
        standing = stand_on(last.ground(workshop), scene) if last is not None else None
    except (OSError, InputError) as fault:
        why = f"the last terrain could not be restored: {fault}"
        return None, why, before._replace(unreadable=why)
    if last is None or standing is None:
        return None, "", before
    _ = standing.cells
    store.follow(last)
    times = last.patches_ns(before.read_ns)
    before = before._replace(patches_ns=times, stamps_ns=last.patch_stamps_ns, unread=last.unread)
    whole_ns = standing.ground.whole_ns
    age = f"{age_of(whole_ns, now_ns)} old" if whole_ns else "of unknown age"
    return standing, "; ".join((f"restored, {age}", *last.faults)), before


def _check_origin(last: StoredSurveys, map_origin: tuple[float, float, float]) -> None:
    """Raise InputError if the `map_origin` (m) of the stored surveys is unknown, or differs from that of the node."""
    stored = last.pieces[-1].map_origin
    if stored is None:
        raise InputError("it was stored by an older version, without map_origin: publish the whole terrain")
    if stored != tuple(map_origin):
        raise InputError(
            f"it was stored with map_origin {list(stored)}, but map_origin is now {list(map_origin)}: publish the "
            "whole terrain"
        )


def _check_longest_edge(last: StoredSurveys, longest_edge: float) -> None:
    """Raise InputError if the stored terrain may have longer sides of triangles than the node allows.

    Only a terrain that was stored whole after patches is checked: it is stored as a mesh, so its triangles are not made
    again with the current limit.

    longest_edge : (m) the node's parameter; with 0, the limit follows from the points
    """
    first = last.pieces[0]
    stored = first.longest_edge
    is_unknown = stored is None and not longest_edge  # stored by an older version, most likely with the default
    is_stricter = stored is not None and (stored == longest_edge or 0.0 < stored <= longest_edge)
    if first.patches > 0 and not (is_unknown or is_stricter):
        before = "an unknown longest_edge" if first.longest_edge is None else f"longest_edge {first.longest_edge:g}"
        raise InputError(
            f"it was stored with {before}, but longest_edge is now {longest_edge:g}: publish the whole terrain"
        )


def _log_of(parameters: SimulatorParameters) -> tuple[DecisionLog | None, str]:
    """Open the decision log; return the log, and the problems that were found in it, "" without problems.

    If the log cannot be opened, return None and the reason. Alerts also work without a log, but the level that was held
    before is then unknown. A note on disk lets the next start know that the log lacks decisions.
    """
    folder = parameters.decision_log or str(Path(parameters.site_file).parent / DECISIONS)
    try:
        log = DecisionLog(folder, version())
    except NotLogged as fault:
        Witness(Path(folder)).unlog()
        return None, str(fault)
    return log, "; ".join(log.problems)


def age_of(stamp_ns: int, now_ns: int) -> str:
    """Return the time between a stamp and now as text, such as "3.0 hours"."""
    seconds = (now_ns - stamp_ns) / SECOND
    for size, unit in ((86_400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} seconds"
