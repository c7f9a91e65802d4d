"""Tests that code is called from the cache only, where the compiler must not start."""

import threading

import numpy as np
import pytest

numba = pytest.importorskip("numba", reason="numba is not installed")

from rpf3d_core.jit.from_cache import NotCached, only_from_cache  # noqa: E402  (the skip is above)


def test_what_would_be_compiled_is_refused_in_this_thread_only_and_works_afterwards() -> None:
    @numba.njit
    def doubled(x):  # type: ignore[no-untyped-def]
        return 2 * x

    found: list[float] = []
    with only_from_cache():
        with pytest.raises(NotCached):
            doubled(1.5)
        other = threading.Thread(target=lambda: found.append(doubled(np.float32(2.0))))
        other.start()
        other.join()
        assert found == [4.0], "another thread may compile"
        assert doubled(np.float32(3.0)) == 6.0, "what is loaded may be called"
    assert doubled(1.5) == 3.0


def test_what_is_in_the_disk_cache_is_loaded(tmp_path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    def halved(x):  # type: ignore[no-untyped-def]
        return 0.5 * x

    assert numba.njit(cache=True)(halved)(3.0) == 1.5
    with only_from_cache():
        assert numba.njit(cache=True)(halved)(5.0) == 2.5
