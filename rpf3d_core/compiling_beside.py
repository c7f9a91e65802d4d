"""A second process that compiles while this one does something else, into the disk cache that both share.

numba compiles one function at a time in a process, whatever its threads. What the other has compiled this one finds in
the cache as if it had done so itself: the same sources, the same types. A process that cannot be had, breaks down or
takes too long costs time and nothing else, for what is not found is compiled here.

    python -m rpf3d_core.compiling_beside rpf3d_core.hazard.visiting
"""

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from rpf3d_core.compiling import compile_apart, compiled_apart, is_cached, keeps_compiled

PATIENCE = 60.0
"""Seconds to wait for the other process once nothing is left to do here: it is compiled in 10 s on an idle machine."""
FEWEST_CORES = 2
HOME = Path(__file__).parents[1]
"""Where the program lies, whatever folder the caller stands in."""

Call = tuple[Any, tuple[Any, ...]]
"""A loop and arguments of the very types that it will be called with."""


class Beside:
    """The other process, waiting to be told what to compile; without one, nothing happens."""

    def __init__(self, process: "subprocess.Popen[bytes] | None") -> None:
        self._process = process
        self._told = False

    def compile(self, *calls: Call) -> None:
        """Have some loops compiled that this process does not call before `wait`: two must not write the same file."""
        if self._process is None or self._process.stdin is None:
            return
        wanted = [(loop.__module__, loop.__name__, tuple(map(loop.typeof_pyval, given))) for loop, given in calls]
        with suppress(OSError):  # it has broken down
            self._process.stdin.write(pickle.dumps((compiled_apart(), wanted)))
            self._process.stdin.flush()
        self._told = True

    def wait(self) -> None:
        """Wait until all is compiled, or the other process has broken down."""
        if self._process is not None and self._told:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(PATIENCE)
        self.end()

    def end(self) -> None:
        """No other process from here on."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        with suppress(OSError):  # what it has not read is lost
            process.communicate()


ALONE = Beside(None)
"""No other process."""


@contextmanager
def compiling_beside(*loops: Any) -> Iterator[Beside]:
    """A second process that is to compile some loops, begun at once, for its imports take a second.

    There is none where no core is to spare, or where the loops have been compiled or could not be kept.
    """
    beside = Beside(_started(loops) if loops and has_spare_core() and _are_missing(loops) else None)
    try:
        yield beside
    finally:
        beside.end()


def has_spare_core() -> bool:
    """Whether another process would find a core to run on: both together take a sixth more computing than one."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores >= FEWEST_CORES and (not hasattr(os, "getloadavg") or os.getloadavg()[0] < cores)


def _are_missing(loops: Sequence[Any]) -> bool:
    """Whether some loops are not in the cache, and would be kept there."""
    return all(hasattr(loop, "typeof_pyval") and not is_cached(loop.__name__) for loop in loops) and keeps_compiled()


def _started(loops: Sequence[Any]) -> "subprocess.Popen[bytes] | None":
    """The other process, with the modules of the loops; None where the system has no room for it."""
    modules = {loop.__module__ for loop in loops}
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HOME), *filter(None, sys.path)])}
    with suppress(OSError):
        return subprocess.Popen(
            [sys.executable, "-P", "-m", __name__, *sorted(modules)],
            env=environment, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    return None


def main(modules: Sequence[str]) -> None:
    """Compile what standard input says; end at once when it ends, for then the process that asked is no more."""
    for module in modules:
        import_module(module)
    digests, wanted = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_input, daemon=True).start()
    for digest in digests:
        compile_apart(digest)
    for module, name, types in wanted:
        getattr(import_module(module), name).compile(types)


def _end_with_input() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
