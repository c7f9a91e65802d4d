"""Reading VTK files in a process of its own: VTK's readers crash, or ask for all memory, on some damaged ones.

    python -m rpf3d_core.formats.vtk_process terrain.vtp points_and_triangles.npz

A sentence on standard output and exit code 2 where the file is refused.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import FileMesh

MEMORY = 4 * 2**30
"""Bytes of addresses that the process may have, libraries included, beside those for the file itself."""
MEMORY_PER_BYTE = 200
"""Further bytes for each byte of the file: a byte holds a few records at most, each of a few hundred bytes."""

REFUSED = 2
HOME = Path(__file__).parents[2]
"""Where the program lies, whatever folder the caller stands in."""


def read_apart(path: Path) -> FileMesh:
    """The surface of a .vtp or .vtk file, read by another process.

    Raises
    ------
    TerrainError
        If the file is refused, or the process breaks down on it.
    """
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "surface.npz"
        done = subprocess.run(
            [sys.executable, "-P", "-m", "rpf3d_core.formats.vtk_process", str(path), str(result)],
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


def main(path: Path, result: Path) -> int:
    """Read a file and save its surface; the exit code."""
    from rpf3d_core.formats.vtk_files import read_here

    _limit_memory(MEMORY + MEMORY_PER_BYTE * path.stat().st_size)
    try:
        surface = read_here(path)
    except TerrainError as fault:
        sys.stdout.buffer.write(str(fault).encode("utf-8", "replace"))
        return REFUSED
    arrays = {"points": surface.points, "triangles": surface.triangles}
    np.savez(result, **{name: array for name, array in arrays.items() if array is not None})  # type: ignore[arg-type]
    return 0


def _limit_memory(size: int) -> None:
    """Let the system refuse more memory than this (bytes) to this process, where it can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    most = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (size if most == resource.RLIM_INFINITY else min(size, most), most))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
