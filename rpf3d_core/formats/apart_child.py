"""The program of the separate process that reads one file with limited memory and time, and saves its arrays.

    python -m rpf3d_core.formats.apart_child rpf3d_core.formats.vtk_files:read_here terrain.vtp arrays.npz

If the file is refused, the process prints the reason on standard output and ends with exit code 2.
"""

import sys
from pathlib import Path

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.apart import REFUSED, reader_named

MEMORY = 4 * 2**30
"""Address space (bytes) that the process may use for an empty file, libraries included; see MEMORY_PER_BYTE."""
MEMORY_PER_BYTE = 200
"""Additional address space (bytes) that the process may use for each byte of the file."""
SECONDS, SECONDS_PER_MEGABYTE = 60, 2
"""CPU time (s) that the process may use for an empty file, and additional time (s) for each 10^6 bytes of the file."""


def main(reader: str, path: Path, result: Path, *options: str) -> int:
    """Read a file, save its arrays for the calling process, and return the exit code: 0, or 2 if the file is refused.

    reader : module and function, as in `apart.read_apart`; result : path of the .npz file with the arrays
    options : further arguments of the reader
    """
    size = path.stat().st_size
    _limit(MEMORY + MEMORY_PER_BYTE * size, SECONDS + SECONDS_PER_MEGABYTE * size // 10**6)
    try:
        arrays = reader_named(reader)(path, *options)
    except InputError as fault:
        return _refuse(str(fault))
    except MemoryError:
        return _refuse(f"{path}: is damaged; it asks for more memory than it can need")
    np.savez(result, **arrays)
    return 0


def _refuse(sentence: str) -> int:
    sys.stdout.buffer.write(sentence.encode("utf-8", "replace"))
    return REFUSED


def _limit(size: int, seconds: int) -> None:
    """Limit the address space (bytes) and the CPU time (s) of this process, if the system can.

    A damaged file must not use up all memory, or hang.
    """
    try:
        import resource
    except ImportError:  # Windows
        return
    for what, wanted in ((resource.RLIMIT_AS, size), (resource.RLIMIT_CPU, seconds)):
        most = resource.getrlimit(what)[1]
        resource.setrlimit(what, (wanted if most == resource.RLIM_INFINITY else min(wanted, most), most))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]), *sys.argv[4:]))
