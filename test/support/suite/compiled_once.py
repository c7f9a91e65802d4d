"""Let one worker compile a loop that several workers need; the others wait, and load it from their common disk cache.

numba's cache does not show that another process is compiling a loop. Without the wait, all workers would compile the
same loops at the same time, which takes each of them 10 to 30 s of CPU time for a loop.
"""

import fcntl
import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rpf3d_core.jit.cache import LOOPS


def compile_once(folder: Path) -> None:
    """Make numba compile each loop of this process under a lock that all workers share; no effect without numba.

    folder : folder of the lock files, the same for all workers
    """
    try:
        from numba.core.compiler_lock import global_compiler_lock
        from numba.core.dispatcher import Dispatcher
    except ImportError:
        return
    compile_alone = Dispatcher.compile

    def compile_or_load(loop: Any, signature: Any) -> Any:
        if loop not in LOOPS:
            return compile_alone(loop, signature)
        # Always take numba's own lock first: two threads that take the locks in opposite order would wait forever.
        with global_compiler_lock, locked(folder / lock_name(loop, signature)):
            return compile_alone(loop, signature)

    Dispatcher.compile = compile_or_load  # type: ignore[method-assign]


def lock_name(loop: Any, signature: Any) -> str:
    """Return the name of the lock file for a loop and the types for which it is compiled."""
    return hashlib.sha256(f"{loop.__module__}.{loop.__name__}{signature}".encode()).hexdigest()[:16] + ".compiling"


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the exclusive lock of a file in the `with` block; the system releases the lock if the process ends."""
    with open(path, "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
