"""Build and call the C++ kernels for rocks with a shape (`benchmarks/cpp/blocks.cpp`, g++ -O3 -march=native)."""

import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

SOURCE = Path(__file__).parent / "cpp" / "blocks.cpp"
BUILD = ("g++", "-std=c++17", "-O3", "-march=native", "-shared", "-fPIC")
SAME_ROUNDING = "-ffp-contract=off"
"""Compiler option against fused multiplications, which round once where Python and numba round twice."""


class CppKernels:
    """The library of C++ kernels; it is built in a temporary folder and loaded.

    fused : True to let the compiler use fused multiplications; results then differ by rounding

    Raises `subprocess.CalledProcessError` if the build fails.
    """

    def __init__(self, fused: bool = False) -> None:
        self._keeps = tempfile.TemporaryDirectory()
        path = Path(self._keeps.name) / "blocks.so"
        subprocess.run([*BUILD, *([] if fused else [SAME_ROUNDING]), "-o", path, SOURCE], check=True)
        self._library = ctypes.CDLL(str(path))

    def call(self, name: str, count: int, *arrays: NDArray[Any]) -> None:
        """Call the kernel `name` over `count` rows of C-contiguous arrays; it writes into the last arrays."""
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in arrays]
        getattr(self._library, name)(ctypes.c_int64(count), *pointers)
