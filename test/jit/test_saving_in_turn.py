"""Tests that two processes can store compiled code of one loop at the same time without overwriting each other."""

import errno
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from rpf3d_core.jit.cache import save_in_turn
from rpf3d_core.jit.dispatch import LOOPS, loop

numba = pytest.importorskip("numba", reason="numba is not installed: there is nothing to store")


def test_code_for_two_types_that_is_stored_at_the_same_time_is_found_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The index is written slowly, so that without a lock both writers choose the same file."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    compiled: Any = numba.njit(cache=True)(_same)
    files = compiled._cache._cache_file
    write = files._save_index

    def write_slowly(overloads: Any) -> None:
        time.sleep(0.2)
        write(overloads)

    files._save_index = write_slowly
    save_in_turn(compiled)
    writers = [threading.Thread(target=files.save, args=(f"type {n}", f"code {n}")) for n in range(3)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert [files.load(f"type {n}") for n in range(3)] == [f"code {n}" for n in range(3)]


def test_code_is_stored_also_where_there_are_no_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_lock(file: object, kind: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("fcntl.flock", no_lock)
    compiled: Any = numba.njit(cache=True)(_same)
    save_in_turn(compiled)
    files = compiled._cache._cache_file
    files.save("type", "code")
    assert files.load("type") == "code"


def test_every_loop_stores_its_code_in_turn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    marked: Any = loop(_same)
    LOOPS.remove(marked)
    assert marked._cache._cache_file.save.__name__ == "save_alone"


def _same(value: float) -> float:
    return value
