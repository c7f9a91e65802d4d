"""rpf3d: rockfall trajectories over open-pit terrain.

>>> import rpf3d_core as rpf3d
>>> run = rpf3d.simulate("config/scenes/demo.yaml", rocks=50)  # doctest: +SKIP
>>> rpf3d.write_run(run, "out")  # doctest: +SKIP

This module offers these names, defined in other modules: `runs.run.simulate`, `runs.run.write_run`, `runs.run.replay`,
`results.findings.Run`, `scene.reading.read_scene`, `setup.terrain.read_terrain`, `errors.InputError`.
"""

from typing import Any

__all__ = ["InputError", "Run", "read_scene", "read_terrain", "replay", "simulate", "write_run"]

_HOMES = {
    "InputError": "rpf3d_core.errors",
    "Run": "rpf3d_core.results.findings",
    "read_scene": "rpf3d_core.scene.reading",
    "read_terrain": "rpf3d_core.setup.terrain",
    "replay": "rpf3d_core.runs.run",
    "simulate": "rpf3d_core.runs.run",
    "write_run": "rpf3d_core.runs.run",
}


def __getattr__(name: str) -> Any:
    """Import a public name on first use: `import rpf3d_core` alone loads neither VTK nor numba."""
    import importlib

    if name not in _HOMES:
        raise AttributeError(f"module 'rpf3d_core' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
