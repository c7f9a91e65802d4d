"""How the C library gives large arrays back."""

import ctypes
import sys

MMAP_THRESHOLD = -3
"""M_MMAP_THRESHOLD of glibc's mallopt(3)."""

LARGE = 1_000_000
"""Bytes from which an array has pages of its own, which go back to the system when it is freed.

Left alone, glibc raises its threshold to the largest that was freed, at most 32 MB, and the arrays of a survey go into
the heap, which they leave in pieces: a node that took a terrain of 2.33 million triangles again and again grew by
3.8 MB each time; with this it stays where it is (docs/live.md).
"""


def give_large_arrays_back() -> None:
    """Let large arrays go back to the system when they are freed; nothing where the C library is another one."""
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(MMAP_THRESHOLD, LARGE)
