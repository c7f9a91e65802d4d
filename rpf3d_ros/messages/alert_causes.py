"""The values in a message of `alerts` that explain a level.

The values are the cause of the level, the terrain on which the decision is based, and two times: since when the level
has been shown, and since when the level has not been normal.
"""

from collections.abc import Mapping, Sequence

from rpf3d_core.alerts.levels import Alert, AreaAlert, Level, Since
from rpf3d_core.alerts.origins import Origin

NOTHING, SOURCES, FAULT, NOT_KNOWN = "nothing", "sources", "fault", "unknown"
"""Causes of a level: nothing (the level is normal), a known cluster of sources, a fault, or an unknown cluster."""


def causes_of_site(alert: Alert) -> dict[str, str]:
    """Return the values that explain the level of the site: cause, cluster of sources, terrain and start time.

    If the limits of an area caused the level, the values describe the first area with the held level of the site.
    """
    raised = next((area for area in alert.areas if area.held == alert.held), None)
    return _values(alert, raised, alert)


def causes_of_area(area: AreaAlert, alert: Alert) -> dict[str, str]:
    """Return the values that explain the level of an area: cause, cluster of sources, terrain and start time."""
    return _values(area, area, alert)


def _values(one: Alert | AreaAlert, raised: AreaAlert | None, alert: Alert) -> dict[str, str]:
    """Return the values that explain the level of the site or of an area (`one`), from an alert.

    raised : the area whose limits caused the held level, None if there is none
    """
    cause = _cause_of(one.level, raised)
    origin = raised.origin if raised is not None and cause == SOURCES else None
    return {
        "cause": cause,
        "cause_area": raised.name if raised is not None and cause in (SOURCES, NOT_KNOWN) else "",
        "cause_fault": _fault_of(one, alert.faults) if cause == FAULT else "",
        **_origin_values(origin),
        **_terrain_values(alert, cause, origin),
        **_since_values(one.since),
    }


def _cause_of(level: Level, raised: AreaAlert | None) -> str:
    if level in (Level.FAULT, Level.NORMAL):
        return FAULT if level == Level.FAULT else NOTHING
    return NOT_KNOWN if raised is None or raised.origin is None else SOURCES


def _fault_of(one: Alert | AreaAlert, faults: Sequence[str]) -> str:
    """Return the first fault that names the area; for the site, or if no fault names the area, the first fault.

    Return "" if there is no fault.

    one : the alert of the site, or of an area
    """
    named = (fault for fault in faults if isinstance(one, AreaAlert) and fault.startswith(f"{one.name}: "))
    return next(named, next(iter(faults), ""))


def _origin_values(origin: Origin | None) -> Mapping[str, str]:
    if origin is None:
        return {"cause_topic": "", "cause_place": "", "cause_sources": "", "cause_sources_digest": ""}
    return {
        "cause_topic": origin.topic,
        "cause_place": " ".join(f"{value:.3f}" for value in origin.place),
        "cause_sources": str(origin.sources),
        "cause_sources_digest": origin.sources_digest,
    }


def _terrain_values(alert: Alert, cause: str, origin: Origin | None) -> Mapping[str, str]:
    """Return digest and stamp (ns) of the terrain on which the level is based, as texts; "" if they are not known.

    If a cluster of sources caused the level, both are of the terrain that its rocks flew over. If the cause is a fault
    or nothing, the digest is that of the newest answer, and the stamp is the oldest of all answers. If the cluster is
    unknown, both are "".
    """
    digest, stamp_ns = alert.terrain_digest, alert.terrain_stamp_ns
    if origin is not None:
        digest, stamp_ns = origin.terrain_digest, origin.terrain_stamp_ns
    elif cause == NOT_KNOWN:
        digest = ""
    return {"terrain_digest": digest, "terrain_stamp_ns": str(stamp_ns) if digest else ""}


def _since_values(since: Since | None) -> Mapping[str, str]:
    if since is None:
        return {"level_since_ns": "", "not_normal_since_ns": ""}
    not_normal_ns = since.not_normal_ns
    return {
        "level_since_ns": str(since.level_ns),
        "not_normal_since_ns": "" if not_normal_ns is None else str(not_normal_ns),
    }
