"""Read a site file, which contains the mine's own thresholds, as `Thresholds`, and report every error in it."""

import hashlib
import json
from pathlib import Path

from pydantic import ValidationError

from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.errors import SceneError
from rpf3d_core.formats.yaml import read_yaml, report_of
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
    if not isinstance(document.values, dict):
        raise SceneError(f"{path}: must hold a mapping of keys ({', '.join(Thresholds.model_fields)}), but does not")
    try:
        thresholds = Thresholds.model_validate(document.values)
    except ValidationError as error:
        faults = [*document.faults, *faults_of(error.errors(), document, Thresholds)]
        raise SceneError(report_of(path, faults)) from None
    if document.faults:
        raise SceneError(report_of(path, document.faults))
    return thresholds


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
