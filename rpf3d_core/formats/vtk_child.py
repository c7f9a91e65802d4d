"""The program of the separate process that reads one VTK file with limited memory, and saves its triangles.

    python -m rpf3d_core.formats.vtk_child terrain.vtp points_and_triangles.npz

If the file is refused, the process prints the reason on standard output, and the exit code is 2.
"""

import sys
from pathlib import Path

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.vtk_files import read_here
from rpf3d_core.formats.vtk_process import REFUSED

MEMORY = 4 * 2**30
"""Address space (bytes) that the process may use for an empty file, libraries included; see MEMORY_PER_BYTE."""
MEMORY_PER_BYTE = 200
"""Additional address space (bytes) that the process may use for each byte of the file."""


def main(path: Path, result: Path) -> int:
    """Read a VTK file, save its points and triangles for the calling process, and return the exit code."""
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
    """Limit the address space of this process (bytes), if the system can: a damaged file must not use up all memory."""
    try:
        import resource
    except ImportError:  # Windows
        return
    most = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (size if most == resource.RLIM_INFINITY else min(size, most), most))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
