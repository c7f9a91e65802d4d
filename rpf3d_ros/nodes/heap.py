"""Memory of a node that runs for weeks: what goes back to the system, and what the collector need not look at."""

import ctypes
import gc
import sys

MMAP_THRESHOLD = -3
"""M_MMAP_THRESHOLD of glibc's mallopt(3)."""

LARGE = 4_000_000
"""Bytes from which an array has pages of its own, which go back to the system when it is freed. Smaller ones are those
of rocks in flight, which come and go thousands of times: to touch their pages anew took a fifth of a flight.

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


def leave_what_stays_to_itself() -> None:
    """Take everything that is alive now, the libraries above all, out of Python's search for garbage.

    A search through their 120,000 objects stops every thread for 35 to 65 ms, the executor among them, and each patch
    of the terrain makes enough objects to begin one. What is made afterwards is searched as ever.
    """
    gc.collect()
    gc.freeze()


def free_what_is_gone() -> None:
    """Free what refers to itself in circles and nobody uses any more, whenever it was made."""
    gc.unfreeze()
    gc.collect()
