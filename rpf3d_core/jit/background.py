"""Compile functions in a background process during start-up, into the disk cache that both processes share.

numba compiles only one function at a time in a process, with any number of threads. A second process saves time: the
main process loads the compiled functions from the cache. The main process waits for a function before the first call,
so the two processes never write the same file. If the background process cannot start, fails or takes too long, the
main process compiles the missing functions, and only time is lost.

The main process starts the background process with a command of this form; its arguments are modules to import:

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
from typing import Any

from rpf3d_core.jit.cache import compile_apart, compiled_apart, is_cached, keeps_compiled
from rpf3d_core.jit.child_python import command_of, environment_of_child
from rpf3d_core.jit.cores import has_spare_core
from rpf3d_core.jit.garbage import collect_less_often

PATIENCE = 60.0
"""Longest time (s) that the main process waits for the background process; an idle machine needs 15 s for all loops."""

Call = tuple[Any, tuple[Any, ...]]
"""A loop (a function to compile) with example arguments, which have exactly the types of the later arguments."""
Work = tuple[str, str, tuple[Any, ...] | None]
"""A request to the background process: module and name of a loop, and the argument types for which to compile it.

None instead of types is a request to call a function.
"""


class BackgroundCompiler:
    """A background process that compiles loops while the main process does other work.

    Without a process, all methods return immediately, and `has_done` returns True.
    """

    def __init__(self, process: "subprocess.Popen[bytes] | None") -> None:
        self._process = process
        self._awaited: list[str] = []
        self._answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        if process is not None:
            threading.Thread(target=_listen, args=(process, self._answers), daemon=True).start()

    def compile(self, *calls: Call) -> None:
        """Request that the background process compiles loops.

        The caller must call `wait` before it first calls these loops; otherwise two processes could write the same
        cache file.

        calls : each loop with example arguments
        """
        if self._process is not None:
            self._order([(*_address(loop), tuple(map(loop.typeof_pyval, given))) for loop, given in calls])

    def call(self, *functions: Callable[[], Any]) -> None:
        """Request calls of functions in the background process, to compile all loops inside these functions.

        The caller must call `wait` before it calls these loops.
        """
        self._order([(*_address(function), None) for function in functions])

    def wait(self, *parts: Any) -> None:
        """Wait until the given loops and functions are done; without arguments, wait for all and end the process.

        If the process fails, or does not finish within PATIENCE (60) seconds, the process is ended and `wait` returns.
        """
        until = time.monotonic() + PATIENCE
        wanted = {".".join(_address(part)) for part in parts} or set(self._awaited)
        while self._process is not None and not wanted.isdisjoint(self._awaited):
            try:
                self._note(self._answers.get(timeout=max(until - time.monotonic(), 0.0)))
            except queue.Empty:
                self.end()
        if not parts:
            self.end()

    def has_done(self, part: Any) -> bool:
        """Return True if a loop or function needs no wait: it is done or was not requested, or there is no process."""
        with suppress(queue.Empty):
            while True:
                self._note(self._answers.get_nowait())
        return self._process is None or ".".join(_address(part)) not in self._awaited

    def end(self) -> None:
        """End the background process."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        if process.stdin:
            with suppress(OSError):  # orders that the process has not read are lost
                process.stdin.close()
        process.wait()

    def _order(self, work: list[Work]) -> None:
        """Send requests to the background process; work : one `Work` for each loop or function."""
        if self._process is None or self._process.stdin is None:
            return
        self._awaited += [f"{module}.{name}" for module, name, _ in work]
        with suppress(OSError):  # the process has failed
            self._process.stdin.write(pickle.dumps(pickle.dumps((compiled_apart(), work))))
            self._process.stdin.flush()

    def _note(self, answer: str) -> None:
        """Record that the background process has finished a loop or function, or has ended.

        answer : line that the background process printed, with the name of the loop or function; or ENDED
        """
        if answer == ENDED:
            self.end()
        elif answer.strip() in self._awaited:
            self._awaited.remove(answer.strip())


ENDED = ""
"""Message that marks the end of the background process."""
NO_BACKGROUND = BackgroundCompiler(None)
"""A compiler without a background process, for callers that compile everything themselves."""


@contextmanager
def background_compiler(*loops: Any) -> Iterator[BackgroundCompiler]:
    """Yield a background compiler for some loops; its process ends with the `with` block.

    The process starts at once, because its imports take a second. No process starts if no core is free, if a loop is
    already in the disk cache, or if the cache cannot store the loops.
    """
    compiler = BackgroundCompiler(_started(loops) if loops and has_spare_core() and _are_missing(loops) else None)
    try:
        yield compiler
    finally:
        compiler.end()


def _are_missing(loops: Sequence[Any]) -> bool:
    """Return True if a background process helps: no loop is in the disk cache, and the cache can store all loops."""
    return all(hasattr(loop, "typeof_pyval") and not is_cached(loop) and keeps_compiled(loop) for loop in loops)


def _address(part: Any) -> tuple[str, str]:
    """Return the module and name with which another process can import a loop or function."""
    return part.__module__, part.__name__


def _listen(process: "subprocess.Popen[bytes]", answers: "queue.SimpleQueue[str]") -> None:
    """Pass the messages of the background process to a queue, line by line, and ENDED after the last line."""
    if process.stdout is not None:
        with process.stdout as lines:
            for line in lines:
                answers.put(line.decode(errors="replace"))
    answers.put(ENDED)


def _started(loops: Sequence[Any]) -> "subprocess.Popen[bytes] | None":
    """Start the background process, which imports the modules of the loops, and return it; None if it cannot start."""
    modules = {loop.__module__ for loop in loops}
    with suppress(OSError):
        return subprocess.Popen(
            command_of(__name__, *sorted(modules)), env=environment_of_child(), stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    return None


def main(modules: Sequence[str]) -> None:
    """Compile what the main process requests on standard input, and print the name of each finished loop or function.

    The process ends as soon as standard input closes, because the main process has then ended.

    modules : names of the modules to import before the first request
    """
    collect_less_often()  # the compiler makes millions of objects
    orders: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_take, args=(orders,), daemon=True).start()
    answers, sys.stdout = sys.stdout, sys.stderr  # other prints must not count as answers
    for module in modules:
        import_module(module)
    while True:
        for done in _work(*pickle.loads(orders.get())):
            print(done, file=answers, flush=True)


def _take(orders: "queue.SimpleQueue[bytes]") -> None:
    """Put each request from standard input into a queue, still pickled, for the main loop of the background process.

    End the process when standard input closes.
    """
    try:
        # not `sys.stdin`: at exit the interpreter would wait for its lock forever
        with open(sys.stdin.fileno(), "rb", closefd=False) as given:
            while True:
                orders.put(pickle.load(given))
    finally:
        os._exit(1)


def _work(digests: Sequence[str], work: Sequence[Work]) -> Iterator[str]:
    """Compile loops and call functions as requested; yield the name of each loop or function when it is finished.

    digests : all digests of the user's code that the main process gave to `compile_apart`
    work : one request for each loop or function
    """
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
