"""A second process that compiles while this one does something else, into the disk cache that both share.

numba compiles one function at a time in a process, whatever its threads. What the other has compiled this one finds in
the cache as if it had done so itself: the same sources, the same types. This one waits for each part before it needs
it, so that both never write the same file. A process that cannot be had, breaks down or
takes too long costs time and nothing else, for what is not found is compiled here.

    python -m rpf3d_core.jit.background rpf3d_core.hazard.walks.visiting
"""

import os
import pickle
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from rpf3d_core.jit.cache import compile_apart, compiled_apart, is_cached, keeps_compiled

PATIENCE = 60.0
"""Seconds to wait for the other process once nothing is left to do here: all is compiled in 15 s on an idle machine."""
FEWEST_CORES = 2
HOME = Path(__file__).parents[2]
"""Where the program lies, whatever folder the caller stands in."""

Call = tuple[Any, tuple[Any, ...]]
"""A loop and arguments of the very types that it will be called with."""
Work = tuple[str, str, tuple[Any, ...] | None]
"""Module and name of a loop, and the types to compile it for; None for a function that is to be called."""


class BackgroundCompiler:
    """The other process, which compiles what it is told, one after the other; without one, nothing happens."""

    def __init__(self, process: "subprocess.Popen[bytes] | None") -> None:
        self._process = process
        self._awaited: list[str] = []
        self._heard: queue.SimpleQueue[str] = queue.SimpleQueue()
        if process is not None:
            threading.Thread(target=_listen, args=(process, self._heard), daemon=True).start()

    def compile(self, *calls: Call) -> None:
        """Have some loops compiled that this process does not call before `wait`: two must not write the same file."""
        if self._process is not None:
            self._tell([(*_address(loop), tuple(map(loop.typeof_pyval, given))) for loop, given in calls])

    def call(self, *functions: Callable[[], Any]) -> None:
        """Have functions called that call some loops; this process calls none of those before `wait` either."""
        self._tell([(*_address(function), None) for function in functions])

    def wait(self, *parts: Any) -> None:
        """Wait until some loops and functions are done; or all, and end the other process.

        No longer than until it has broken down, or PATIENCE is over: then it is ended as well.
        """
        until = time.monotonic() + PATIENCE
        wanted = {".".join(_address(part)) for part in parts} or set(self._awaited)
        while self._process is not None and not wanted.isdisjoint(self._awaited):
            try:
                self._hear(self._heard.get(timeout=max(until - time.monotonic(), 0.0)))
            except queue.Empty:
                self.end()
        if not parts:
            self.end()

    def has_done(self, part: Any) -> bool:
        """Whether there is nothing to wait for, for a loop or a function."""
        with suppress(queue.Empty):
            while True:
                self._hear(self._heard.get_nowait())
        return self._process is None or ".".join(_address(part)) not in self._awaited

    def end(self) -> None:
        """No other process from here on."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        if process.stdin:
            with suppress(OSError):  # what it has not read is lost
                process.stdin.close()
        process.wait()

    def _tell(self, work: list[Work]) -> None:
        if self._process is None or self._process.stdin is None:
            return
        self._awaited += [f"{module}.{name}" for module, name, _ in work]
        with suppress(OSError):  # it has broken down
            self._process.stdin.write(pickle.dumps(pickle.dumps((compiled_apart(), work))))
            self._process.stdin.flush()

    def _hear(self, said: str) -> None:
        if said == ENDED:
            self.end()
        elif said.strip() in self._awaited:
            self._awaited.remove(said.strip())


ENDED = ""
"""What is heard of a process that is no more."""
ALONE = BackgroundCompiler(None)
"""No other process."""


@contextmanager
def compiling_beside(*loops: Any) -> Iterator[BackgroundCompiler]:
    """A second process that is to compile some loops, begun at once, for its imports take a second.

    There is none where no core is to spare, or where the loops have been compiled or could not be kept.
    """
    beside = BackgroundCompiler(_started(loops) if loops and has_spare_core() and _are_missing(loops) else None)
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


def _address(part: Any) -> tuple[str, str]:
    """Where another process finds a loop or a function: its module and name."""
    return part.__module__, part.__name__


def _listen(process: "subprocess.Popen[bytes]", heard: "queue.SimpleQueue[str]") -> None:
    """Put what a process says into a queue, line by line, and at last that it has ended."""
    if process.stdout is not None:
        with process.stdout as lines:
            for line in lines:
                heard.put(line.decode(errors="replace"))
    heard.put(ENDED)


def _started(loops: Sequence[Any]) -> "subprocess.Popen[bytes] | None":
    """The other process, with the modules of the loops; None where the system has no room for it."""
    modules = {loop.__module__ for loop in loops}
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HOME), *filter(None, sys.path)])}
    with suppress(OSError):
        return subprocess.Popen(
            [sys.executable, "-P", "-m", __name__, *sorted(modules)],
            env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    return None


def main(modules: Sequence[str]) -> None:
    """Do what standard input says, and say what is done; end at once with it, for then who asked is no more."""
    orders: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_take, args=(orders,), daemon=True).start()
    answers, sys.stdout = sys.stdout, sys.stderr  # whatever else is printed is no answer
    for module in modules:
        import_module(module)
    while True:
        for done in _work(*pickle.loads(orders.get())):
            print(done, file=answers, flush=True)


def _take(orders: "queue.SimpleQueue[bytes]") -> None:
    """Put orders into a queue as they come, unread: to read one imports modules, which is for one thread only."""
    try:
        # not `sys.stdin`, whose lock an interpreter that ends would wait for in vain
        with open(sys.stdin.fileno(), "rb", closefd=False) as given:
            while True:
                orders.put(pickle.load(given))
    finally:
        os._exit(1)


def _work(digests: Sequence[str], work: Sequence[Work]) -> Iterator[str]:
    """Compile loops and call functions; yields what is done."""
    for digest in digests:
        compile_apart(digest)
    for module, name, types in work:
        part = getattr(import_module(module), name)
        if types is None:
            part()
        else:
            part.compile(types)
        yield f"{module}.{name}"


if __name__ == "__main__":
    main(sys.argv[1:])
