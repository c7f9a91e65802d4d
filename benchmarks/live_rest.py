"""Compare the CPU time of the simulator while no message arrives with that of a node that does nothing."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from live_stack import Stack

IDLE = Path(__file__).parent / "live_idle.py"
REST = 20.0
"""Time (s) over which CPU time is measured; the system counts CPU time in steps of 10 ms."""
GOAL = 0.01
"""Goal: largest number of cores (-) that the simulator uses in addition to those of the idle node."""
STARTED = 5.0
"""Time (s) after which the idle node counts as started."""


class Resting(Protocol):
    """The part of `live.Bench` (a running simulator) that `at_rest` needs."""

    stack: Stack

    def rest(self) -> None:
        """Wait until no more results arrive."""


def at_rest(bench: Resting, module: str) -> bool:
    """Print how much CPU time a node and an idle node use while no message arrives; return True if the goal is missed.

    bench : the running node; module : name of the node's module, such as "simulator_node"
    """
    bench.stack.start_script(IDLE)
    time.sleep(STARTED)
    bench.rest()
    used, idle = _cores(bench.stack.cpu, module, IDLE.stem)
    bench.stack.kill(IDLE.stem)
    missed = not used - idle <= GOAL
    print(f"without messages: {100 * used:.2f} % of a core; an idle node: {100 * idle:.2f} % "
          f"(goal: at most {100 * GOAL:g} % more)   {'missed' if missed else 'met'}", flush=True)  # fmt: skip
    return missed


def _cores(cpu: Callable[[str], float], *names: str) -> list[float]:
    """Return the mean number of cores that each process uses during the next REST seconds.

    cpu : returns the CPU time (s) that the process with a name has used; names : names of the processes
    """
    before, began = [cpu(name) for name in names], time.monotonic()
    time.sleep(REST)
    took = time.monotonic() - began
    return [(cpu(name) - at) / took for name, at in zip(names, before, strict=True)]
