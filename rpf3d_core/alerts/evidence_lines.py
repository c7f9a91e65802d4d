"""Convert evidence and origins to plain values for the lines of the decision log, and back, bit for bit."""

import math
from typing import Any

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence, Outdated
from rpf3d_core.alerts.origins import Origin, Origins

TEXTS = ("name", "outline")
"""Text fields of the evidence of an area; in other fields, text stands for a number that JSON cannot express (NaN)."""

OFTEN_DEFAULT = ("energy_high", "energy_sets", "first_arrival_low_s", "without_energy")
"""Fields of an area's evidence that the log leaves out at their default value."""

DEFAULTS = AreaEvidence._field_defaults

LEFT_OUT = ("notes", "complete_until_ns")
"""Fields of the evidence that are not logged if they are empty or 0."""

SAME_IF_LEFT_OUT = ("energy_high", "first_arrival_low")
"""Fields of the origins that are not logged if they are None: `energy` or `first_arrival` then applies instead."""


def evidence_content(evidence: Evidence) -> dict[str, Any]:
    """Return evidence as plain values for the log; some fields are left out if they have their default value."""
    content = {
        **evidence._asdict(),
        "areas": [_area_evidence_content(area) for area in evidence.areas],
        "outdated": [outdated._asdict() for outdated in evidence.outdated],
    }
    return {name: value for name, value in content.items() if value or name not in LEFT_OUT}


def _area_evidence_content(area: AreaEvidence) -> dict[str, Any]:
    stated = {key: value for key, value in area._asdict().items() if key not in OFTEN_DEFAULT or value != DEFAULTS[key]}
    content = {key: _written(value) for key, value in stated.items() if key != "origins"}
    return content if area.origins is None else {**content, "origins": _origins_content(area.origins)}


def _origins_content(origins: Origins) -> dict[str, Any]:
    """Return the origins of an area's figures as plain values for the log, by figure.

    The origin of `reached` is always there. The origins of `energy_high` and `first_arrival_low` are left out if they
    are None. Each other origin is left out if it equals the origin of `reached`.
    """
    others = {
        name: origin
        for name, origin in origins._asdict().items()
        if (origin is not None if name in SAME_IF_LEFT_OUT else origin != origins.reached)
    }
    return {name: origin_content(origin) for name, origin in {"reached": origins.reached, **others}.items()}


def origin_content(origin: Origin | None) -> dict[str, Any] | None:
    """Return an origin as plain values for the log; None for an unknown origin."""
    if origin is None:
        return None
    return {**origin._asdict(), "place": [_written(value) for value in origin.place]}


def evidence_of(content: dict[str, Any]) -> Evidence:
    """Return the evidence in a line of the log, from the values that `evidence_content` wrote."""
    areas = tuple(_area_evidence(area) for area in content["areas"])
    outdated = tuple(Outdated(**each) for each in content.get("outdated", ()))
    sentences = {"faults": tuple(content["faults"]), "notes": tuple(content.get("notes", ()))}
    return Evidence(**{**content, **sentences, "areas": areas, "outdated": outdated})


def _area_evidence(content: dict[str, Any]) -> AreaEvidence:
    values = {key: value if key in TEXTS else _read(value) for key, value in content.items() if key != "origins"}
    return AreaEvidence(**values, origins=_origins(content.get("origins")))


def _origins(content: dict[str, Any] | None) -> Origins | None:
    if content is None:
        return None
    missing = {name: None if name in SAME_IF_LEFT_OUT else content["reached"] for name in Origins._fields}
    return Origins(**{name: origin_of(content.get(name, other)) for name, other in missing.items()})


def origin_of(content: dict[str, Any] | None) -> Origin | None:
    """Return an origin from the plain values that `origin_content` returned; None for None."""
    if content is None:
        return None
    x, y, z = (_read(value) for value in content["place"])
    return Origin(**{**content, "place": (x, y, z)})


def _written(value: Any) -> Any:
    """Return a value in a form that JSON supports: NaN and infinities as text, any other value unchanged."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _read(value: Any) -> Any:
    return float(value) if isinstance(value, str) else value
