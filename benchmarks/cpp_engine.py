"""Build and run a C++ program with the algorithm and arrays of the compiled engine (`benchmarks/cpp`, g++ -O3)."""

import os
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.materials.library import Surface
from rpf3d_core.simulation.engines import Compiled
from rpf3d_core.simulation.settings import Settings

SOURCE = Path(__file__).parent / "cpp" / "fly.cpp"
BUILD = ("g++", "-std=c++17", "-O3", "-ffp-contract=off")
"""Compiler settings. Fused multiplications are off, because they round once where Python and numba round twice."""
HUGE_PAGES = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}
"""Environment variables that put large arrays on huge pages, as NumPy does, for a fair comparison."""


class CppFlights(NamedTuple):
    """The result of flying R rocks with the C++ program: final states, and CPU seconds.

    finals : (R, 8); counts : (R, 4); columns as in `simulation.engines`
    """

    finals: NDArray[np.float64]
    counts: NDArray[np.int64]
    seconds: float


class CppEngine:
    """The C++ program, which is built and receives the arrays of R rocks over ground of one material.

    Raises `subprocess.CalledProcessError` if the build fails, or if a rock meets a case that the program does not
    cover.
    """

    def __init__(self, engine: Compiled, surface: Surface, settings: Settings, releases: Releases) -> None:
        self._keeps = tempfile.TemporaryDirectory()
        self.folder = Path(self._keeps.name)
        for column, values in _arrays(engine, surface, settings, releases).items():
            np.ascontiguousarray(values).tofile(self.folder / column)
        subprocess.run([*BUILD, "-o", self.folder / "fly", SOURCE], check=True)

    def fly(self) -> CppFlights:
        """Fly all rocks twice on one core, and return the second result, because the first pass fills the caches."""
        subprocess.run([self.folder / "fly", self.folder, "2"], check=True, env=os.environ | HUGE_PAGES)
        finals = np.fromfile(self.folder / "finals").reshape(-1, 8)
        counts = np.fromfile(self.folder / "counts", dtype=np.int64).reshape(-1, 4)
        return CppFlights(finals, counts, float(np.fromfile(self.folder / "seconds")[-1]))


def _arrays(
    engine: Compiled, surface: Surface, settings: Settings, releases: Releases
) -> dict[str, NDArray[np.generic]]:
    """Return the input arrays of the C++ program, by the names of their files."""
    facets, locator = engine.facets, engine.locator
    return {
        "geometry": facets.geometry,
        "zone": facets.zone,
        "box": np.array([*facets.low, *facets.high, facets.tolerance]),
        "grid": np.array([locator.x, locator.y, locator.cell, locator.nx, locator.ny], dtype=float),
        "starts": locator.starts,
        "ids": locator.ids,
        "boxes": locator.boxes,
        "planes": locator.slabs.planes,
        "first": locator.slabs.first,
        "surfaces": np.array([surface], dtype=float),
        "settings": np.array([settings.gravity, settings.smallest_bounce, settings.max_time, settings.max_impacts]),
        "x": releases.x,
        "v": releases.v,
    }
