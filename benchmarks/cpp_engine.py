"""The compiled engine's algorithm in C++ (`benchmarks/cpp`), built with g++ -O3 and fed with the same arrays."""

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
"""No fused multiplications: they round once where Python and numba round twice."""
HUGE_PAGES = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}
"""Large arrays on large pages, as NumPy's are."""


class CppFlights(NamedTuple):
    """Final states of R rocks, columns as in `simulation.engines`: (R, 8), (R, 4); CPU seconds that they took."""

    finals: NDArray[np.float64]
    counts: NDArray[np.int64]
    seconds: float


class CppEngine:
    """The program, built, with the arrays of R rocks over ground that is alike everywhere; on one core.

    Raises `subprocess.CalledProcessError` where the program cannot be built or does not know what a rock does.
    """

    def __init__(self, engine: Compiled, surface: Surface, settings: Settings, releases: Releases) -> None:
        self._keeps = tempfile.TemporaryDirectory()
        self.folder = Path(self._keeps.name)
        for column, values in _arrays(engine, surface, settings, releases).items():
            np.ascontiguousarray(values).tofile(self.folder / column)
        subprocess.run([*BUILD, "-o", self.folder / "fly", SOURCE], check=True)

    def fly(self) -> CppFlights:
        """Fly all rocks twice; the second pass counts, for the first one fetches the arrays into the caches."""
        subprocess.run([self.folder / "fly", self.folder, "2"], check=True, env=os.environ | HUGE_PAGES)
        finals = np.fromfile(self.folder / "finals").reshape(-1, 8)
        counts = np.fromfile(self.folder / "counts", dtype=np.int64).reshape(-1, 4)
        return CppFlights(finals, counts, float(np.fromfile(self.folder / "seconds")[-1]))


def _arrays(
    engine: Compiled, surface: Surface, settings: Settings, releases: Releases
) -> dict[str, NDArray[np.generic]]:
    """What `fly.cpp` reads, by the name of its file."""
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
