"""Memory of a node that runs for weeks: return freed arrays to the system and spare the garbage collector work."""

import ctypes
import gc
import sys

MMAP_THRESHOLD = -3
"""M_MMAP_THRESHOLD of glibc's mallopt(3)."""

LARGE = 4_000_000
"""Size (bytes) from which an array has pages of its own, which go back to the system when the array is freed.

Smaller arrays are those of rocks in flight, which are made and freed thousands of times: touching their pages again
took a fifth of a flight.

By default, glibc raises its threshold to the largest block freed, at most 32 MB. Then the arrays of a survey go into
the heap and leave it fragmented: a node that received a terrain of 2.33 million triangles again and again grew by
3.8 MB each time. With this setting its memory stays constant (docs/explanation/live.md).
"""


def return_large_arrays() -> None:
    """Return large arrays to the system when they are freed; do nothing if the C library is not glibc."""
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(MMAP_THRESHOLD, LARGE)


def exempt_from_collection() -> None:
    """Exclude all objects that exist at this time, mostly those of libraries, from Python's garbage collection.

    A collection over their 120,000 objects stops every thread for 35 to 65 ms, including the executor, and each patch
    of the terrain makes enough objects to start one. Objects made afterwards are collected as usual.
    """
    gc.collect()
    gc.freeze()


def free_unused_objects() -> None:
    """Free unused objects that refer to each other in cycles, including the excluded ones."""
    gc.unfreeze()
    gc.collect()
