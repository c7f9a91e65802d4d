"""Measure how slow the processor currently is, because other programs share its caches and clock rate with a test."""

import time

STEPS, IDLE = 200_000, 0.008
"""Number of steps of a loop, and CPU time (s) of the loop on a machine without other programs."""


def slowness() -> float:
    """Return the CPU time of a Python loop, divided by the CPU time that it takes on an idle machine; at least 1.

    Call this alternately with the measured code, so that both run under the same load.
    """
    began, total = time.process_time(), 0
    for step in range(STEPS):
        total += step * step
    return max(1.0, (time.process_time() - began) / IDLE)
