"""Read VTK files in a separate process, because VTK's readers crash or use all memory on some damaged files."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import FileMesh

REFUSED = 2
"""Exit code of the separate process if it refuses a file; the reason is on its standard output."""
HOME = Path(__file__).parents[2]
"""Folder that contains the package `rpf3d_core`, so that the separate process finds the package."""


def read_apart(path: Path) -> FileMesh:
    """Return the triangles of a .vtp or .vtk file that a separate process reads, so that a crash of VTK does no harm.

    Raises
    ------
    TerrainError
        If the file is refused, or the process crashes on the file.
    """
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "surface.npz"
        done = subprocess.run(
            [sys.executable, "-P", "-m", "rpf3d_core.formats.vtk_child", str(path), str(result)],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(HOME), *filter(None, sys.path)])},
            capture_output=True,
            check=False,
        )
        if done.returncode == REFUSED and done.stdout:
            raise TerrainError(done.stdout.decode("utf-8", "replace"))
        if done.returncode < 0:
            raise TerrainError(f"{path}: is damaged; VTK's reader breaks down on it")
        if done.returncode > 0:
            raise RuntimeError(f"{path}: the process that reads it failed: {done.stderr.decode('utf-8', 'replace')}")
        with np.load(result) as arrays:
            return FileMesh(arrays["points"], arrays.get("triangles"))
