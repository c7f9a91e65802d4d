"""Diagnostics of the inputs: which messages wait, whether the terrain is stored, and which terrain is in use."""

from rpf3d_core.live.ground import LiveTerrain
from rpf3d_core.live.store import Store
from rpf3d_ros.engine.survey_in_use import Arrival
from rpf3d_ros.engine.waiting_sources import WaitingSources
from rpf3d_ros.engine.waiting_terrain import WaitingTerrain
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.messages.health import OK, WARN
from rpf3d_ros.messages.stamps import SECOND

PATCH_HOLES = (
    "{:,} points are missing (NaN) inside patches since the last whole survey, so the terrain there has its former "
    "heights: publish patches without holes, or the whole terrain"
)
"""Warning about holes inside patches."""


def report_queues(health: HealthReport, sources: WaitingSources, terrain: WaitingTerrain[Arrival]) -> None:
    """Report how many messages wait, and how many were dropped; patches that the terrain lacks are a warning."""
    lost = terrain.lost_patches
    values = {
        "sources_waiting": len(sources), "sources_dropped": sources.dropped, "terrain_waiting": len(terrain),
        "terrain_overtaken": terrain.overtaken, "patches_lost": lost, "surveys_refused": terrain.refused_surveys,
    }  # fmt: skip
    lacking = "patches are missing from the terrain: publish the whole terrain"
    level, sentence = (WARN, lacking) if lost else (OK, "no patch is missing")
    health.set("queues", level, sentence, {name: str(value) for name, value in values.items()})


def report_store(health: HealthReport, store: Store, has_terrain: bool) -> None:
    """Report whether the terrain in use is stored; has_terrain : False if no terrain is in use yet."""
    if not has_terrain:
        sentence = "there is no terrain to store yet"
    else:
        sentence = "the terrain in use is stored" if store.flush(0.0) else "the terrain in use is being written"
    health.set("store", WARN if store.fault else OK, store.fault or sentence)


def report_ground(health: HealthReport, ground: LiveTerrain, what: str, holes: int, now_ns: int) -> None:
    """Report which terrain is in use, its age and its digest; points that are missing inside patches are a warning.

    ground, what, holes : as in `TerrainListener.stands`; now_ns : current time (ns)
    """
    values = {
        "triangles": str(len(ground.terrain.triangles)), "digest": ground.digest,
        "stamp": f"{ground.stamp_ns / SECOND:.3f}", "age_s": f"{(now_ns - ground.whole_ns) / SECOND:.0f}",
        **({"closed_seams": str(ground.closed_seams)} if ground.closed_seams else {}),
        **({"patch_holes": str(holes)} if holes else {}),
    }  # fmt: skip
    if holes:
        what = f"{what}; {PATCH_HOLES.format(holes)}"
    health.set("terrain", WARN if holes else OK, what, values)
