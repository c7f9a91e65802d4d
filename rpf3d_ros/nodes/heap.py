"""Manage the memory of a node that runs for weeks: return freed arrays to the system, shorten garbage collections."""

import ctypes
import gc
import sys

MMAP_THRESHOLD = -3
"""The option of glibc's mallopt(3) for the size of large arrays (M_MMAP_THRESHOLD)."""

LARGE = 4_000_000
"""Size (bytes) from which an array has separate pages, which go back to the system when the array is freed.

The arrays of rocks in flight are smaller. They are made and freed thousands of times; with separate pages, allocating
these arrays would take a fifth of the computing time of a flight.

By default, glibc raises the threshold to the largest freed block, at most 32 MB. Then the arrays of a survey go into
the heap and fragment the heap: a node that repeatedly receives a terrain of 2.33 million triangles grows by 3.8 MB each
time. With this setting the memory of the node stays constant (docs/explanation/live.md).
"""


def return_large_arrays() -> None:
    """Set glibc's allocator so that arrays of LARGE bytes and more go back to the system when they are freed.

    Do nothing if the C library is not glibc.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(MMAP_THRESHOLD, LARGE)


def exempt_from_collection() -> None:
    """Exclude all objects that exist now, mostly of libraries, from garbage collection, so that a collection is short.

    A collection over these 120,000 objects stops every thread for 35 to 65 ms, including the executor. Each patch of
    the terrain makes enough objects to start a collection. Objects made afterwards are collected as usual.
    """
    gc.collect()
    gc.freeze()


def free_unused_objects() -> None:
    """Free unused objects that refer to each other in cycles, including those excluded by `exempt_from_collection`."""
    gc.unfreeze()
    gc.collect()
