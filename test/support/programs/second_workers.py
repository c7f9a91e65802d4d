"""A class whose methods a second process calls in tests."""

import os
import threading
import time
from pathlib import Path

from rpf3d_core.errors import InputError


class Clerk:
    """An object with methods that write to a file, print, fail or hang."""

    def note(self, path: Path, words: str) -> None:
        """Append a line with this process's ID and some words to a file."""
        with path.open("a", encoding="utf-8") as file:
            file.write(f"{os.getpid()} {words}\n")

    def say(self, words: str) -> None:
        """Write some words to standard output, by `print` and directly to the file descriptor, as a library may."""
        print(words, flush=True)
        os.write(1, words.encode())

    def refuse(self, words: str) -> None:
        """Raise an InputError with some words: an error that a user can correct."""
        raise InputError(words)

    def tell_of_numba(self) -> None:
        """Raise an InputError whose text states whether this process can import numba."""
        from rpf3d_core.jit.dispatch import HAS_NUMBA

        raise InputError(f"numba: {HAS_NUMBA}")

    def fail_unpicklably(self, words: str) -> None:
        """Raise an exception that cannot be pickled and sent to another process."""
        fault = ValueError(words)
        fault.lock = threading.Lock()  # type: ignore[attr-defined]
        raise fault

    def hang(self, path: Path) -> None:
        """Append this process's ID to a file, then sleep for 600 s, which is longer than any test waits."""
        self.note(path, "hangs")
        time.sleep(600.0)
