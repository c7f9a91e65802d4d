"""Write the result of a sensitivity analysis: sensitivity.json and tornado.png."""

import json
from pathlib import Path

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.sensitivity.analysis import Sensitivity
from rpf3d_core.sensitivity.words import content_of


def write_sensitivity(out: Path, found: Sensitivity) -> None:
    """Write sensitivity.json and tornado.png into a folder, which is created if it does not exist.

    Raises
    ------
    InputError
        The folder cannot be written to.
    """
    # Imported here, because the import of matplotlib takes most of a second.
    from rpf3d_core.results.plots.sensitivity import write_tornado

    indices = found.indices
    sizes, ends = found.effects.size, np.stack([found.effects.low, found.effects.high])
    moved = np.flatnonzero(sizes.any(axis=0))
    axes = [f"change across the range ({unit})" for unit in found.units]
    if indices is not None:
        sizes, ends = 100.0 * indices.total, 100.0 * indices.total_ends
        axes = ["share of the variance, interactions included (%)"] * len(axes)
    try:
        out.mkdir(parents=True, exist_ok=True)
        text = json.dumps(content_of(found), indent=2, allow_nan=False) + "\n"
        (out / "sensitivity.json").write_text(text, encoding="utf-8")
        panels = [(found.results[y], axes[y]) for y in moved]
        write_tornado(out / "tornado.png", found.names, panels, sizes[:, moved], ends[:, :, moved])
    except OSError as fault:
        raise InputError(f"{out}: could not be written ({fault.strerror or fault})") from fault
