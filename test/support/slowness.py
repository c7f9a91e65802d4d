"""How slow the processor is at the moment: other programs on the same core take caches and clock rate from a test."""

import time

STEPS, IDLE = 200_000, 0.008
"""Steps of a loop, and its seconds of computing on a machine that does nothing else."""


def slowness() -> float:
    """Return how many times as long a loop of Python takes as on an idle machine, in seconds of computing; at least 1.

    Ask in turn with what is measured.
    """
    began, total = time.process_time(), 0
    for step in range(STEPS):
        total += step * step
    return max(1.0, (time.process_time() - began) / IDLE)
