"""Build and call the kernels of rocks with a shape in C++ (`benchmarks/cpp/blocks.cpp`, g++ -O3 -march=native)."""

import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

SOURCE = Path(__file__).parent / "cpp" / "blocks.cpp"
BUILD = ("g++", "-std=c++17", "-O3", "-march=native", "-shared", "-fPIC")
SAME_ROUNDING = "-ffp-contract=off"
"""Compiler setting without fused multiplications, which round once where Python and numba round twice."""


class CppKernels:
    """The library of kernels, built and loaded.

    fused : True to let the compiler use fused multiplications; results then differ by rounding

    Raises `subprocess.CalledProcessError` if the build fails.
    """

    def __init__(self, fused: bool = False) -> None:
        self._keeps = tempfile.TemporaryDirectory()
        path = Path(self._keeps.name) / "blocks.so"
        subprocess.run([*BUILD, *([] if fused else [SAME_ROUNDING]), "-o", path, SOURCE], check=True)
        self._library = ctypes.CDLL(str(path))

    def call(self, name: str, count: int, *arrays: NDArray[Any]) -> None:
        """Call a kernel over `count` rows of C-contiguous arrays; the last of the arrays are written."""
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in arrays]
        getattr(self._library, name)(ctypes.c_int64(count), *pointers)
