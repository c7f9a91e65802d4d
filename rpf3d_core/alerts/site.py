"""Read a site file, which contains the mine's own thresholds, as `Thresholds`, and report every error in it."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rpf3d_core.alerts.site_model import LEVELS, Thresholds
from rpf3d_core.errors import SceneError
from rpf3d_core.formats.yaml import Document, Fault, KeyPath, key_name, read_yaml, report_of
from rpf3d_core.scene.faults import faults_of

KIND = "site"


def read_site(path: str | Path) -> Thresholds:
    """Read and check a site file (`config/site_example.yaml` shows every key).

    Raises
    ------
    SceneError
        One line for each fault: file, line, key, value and what would be right.
    """
    path = Path(path)
    document = read_yaml(path, KIND)
    document.faults.extend(_without_value(document, document.values, ()))
    if not isinstance(document.values, dict):
        raise SceneError(f"{path}: must hold a mapping of keys ({', '.join(Thresholds.model_fields)}), but does not")
    try:
        thresholds = Thresholds.model_validate(document.values)
    except ValidationError as error:
        faults = [*document.faults, *faults_of(error.errors(), document, Thresholds)]
        raise SceneError(report_of(path, faults)) from None
    faults = [*document.faults, *_without_effect(thresholds, document)]
    if faults:
        raise SceneError(report_of(path, faults))
    return thresholds


def _without_value(document: Document, value: Any, path: KeyPath) -> Iterator[Fault]:
    """Yield a fault for each key without a value: it would count as absent, for example a level without limits.

    value : the part of the document at `path`
    """
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _without_value(document, inner, (*path, key))
    elif value is None and path:
        yield Fault(document.lines.get(path, 1), f"`{key_name(path)}` has no value: give one, or remove the key")


def _without_effect(thresholds: Thresholds, document: Document) -> Iterator[Fault]:
    """Yield a fault for values that are valid, but probably not meant.

    Such values are: an `alarm_from` that no limits can raise, and a limit of 1 for a reach probability.
    """
    levels = [word for word in LEVELS for area in thresholds.areas.values() if getattr(area, word) is not None]
    if not any(LEVELS.index(word) >= LEVELS.index(thresholds.alarm_from) for word in levels):
        yield Fault(
            document.lines.get(("alarm_from",), 1),
            f"`alarm_from` is {thresholds.alarm_from}, but no area has limits of this level or above, so no rock would "
            "raise the alarm: give such limits, or choose a lower level",
        )
    for name, area in thresholds.areas.items():
        for word in LEVELS:
            limits = getattr(area, word)
            if limits is not None and limits.reach_probability == 1.0:
                key = ("areas", name, word, "reach_probability")
                yield Fault(
                    document.lines.get(key, 1),
                    f"`{key_name(key)}` is 1, which is all rocks; a share of 1 % is 0.01. The limit must be below 1",
                )


def site_text(thresholds: Thresholds) -> str:
    """Return the thresholds as one line of JSON for the decision log, which `site_of` reads.

    Areas keep their order, because the first pattern that matches counts.
    """
    return json.dumps(thresholds.model_dump(mode="json"), separators=(",", ":"), allow_nan=False)


def site_of(text: str) -> Thresholds:
    """Return the thresholds of a log line, from the text that `site_text` wrote.

    Raises
    ------
    SceneError
        This version does not understand the text.
    """
    try:
        return Thresholds.model_validate(json.loads(text))
    except (ValidationError, ValueError, RecursionError) as error:
        raise SceneError(f"the thresholds in the log are not understood: {str(error).splitlines()[0]}") from None


def site_digest(thresholds: Thresholds) -> str:
    """Return a digest (SHA-256, 64 hex digits) that identifies the thresholds of a decision."""
    return hashlib.sha256(site_text(thresholds).encode()).hexdigest()
