"""Let one worker compile a loop that several workers need: the others wait, and load it from the disk cache they share.

numba's cache does not know of a compilation that another process is at. Without the wait, workers compile the same
loops side by side, 10 to 30 s of a core each.
"""

import fcntl
import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rpf3d_core.jit.cache import LOOPS


def compile_once(folder: Path) -> None:
    """From now on, compile each loop of this process under a lock that all workers take.

    folder : holds the locks; the same folder for all workers
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
        # numba's own lock first, for all: two threads that took both locks in opposite order would wait for ever
        with global_compiler_lock, locked(folder / lock_name(loop, signature)):
            return compile_alone(loop, signature)

    Dispatcher.compile = compile_or_load  # type: ignore[method-assign]


def lock_name(loop: Any, signature: Any) -> str:
    """Return the name of the lock of a loop compiled for some types."""
    return hashlib.sha256(f"{loop.__module__}.{loop.__name__}{signature}".encode()).hexdigest()[:16] + ".compiling"


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of a file; if the process ends, the system opens the lock."""
    with open(path, "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
