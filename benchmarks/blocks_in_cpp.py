"""Compare the speed of the kernels for rocks with a shape with that of the same kernels in C++, on Authume profile P1.

    python benchmarks/blocks_in_cpp.py [rocks]

The reference engine flies the rocks once, which takes some seconds for each rock, and all calls of the kernels are
recorded. Then compiled Python and C++ repeat these calls in turn, and the compiled engine flies the same rocks. The
figures are CPU times of this process without compile time, as medians of passes. In the table, `share` is the time of a
kernel's calls, divided by the time of the flights. `fused C++` uses multiplications fused with additions, so its
results differ by rounding. `different results` is the number of results of compiled Python that differ in any bit from
those of C++ without fused multiplications. Without the Authume data, the rocks fall down one bench of 15 m.
"""

import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

import block_kernels
import numpy as np
from block_calls import Calls, recorded_calls
from blocks import SCENES, Case, case_of
from cpp_blocks import CppKernels
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.errors import InputError
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare

PASSES = 9
ROCKS = 32
KERNELS = {
    "solve_impacts": "impacts and contacts",
    "find_distances": "distance of block and facet",
    "find_clear_times": "time without contact",
    "find_rotations": "free rotation",
}
"""Name of each kernel's loop -> description of its result in the table."""


@dataclass
class Compared:
    """A kernel's recorded calls, and the times and results of each program that repeats them.

    programs : name of a program ("numba", "C++", "fused") -> function of the arrays of the calls
    seconds : name -> CPU seconds of each pass; results : name -> arrays that the last pass has written
    """

    calls: Calls
    programs: dict[str, Callable[..., Any]]
    seconds: dict[str, list[float]] = field(default_factory=dict)
    results: dict[str, tuple[NDArray[Any], ...]] = field(default_factory=dict)

    def run(self) -> None:
        """Repeat all calls once with each program, and store times and results."""
        for name, program in self.programs.items():
            changed = tuple(array.copy() for array in self.calls.changed)
            began = time.process_time()
            program(*self.calls.given, *changed)
            self.seconds.setdefault(name, []).append(time.process_time() - began)
            self.results[name] = changed

    def median(self, name: str) -> float:
        """Return the median of a program's CPU seconds."""
        return float(np.median(self.seconds[name]))

    def ratio(self, name: str) -> float:
        """Return the CPU time of compiled Python, divided by the CPU time of another program."""
        return self.median("numba") / self.median(name)

    def different(self, name: str) -> int:
        """Return the number of results that differ in any bit between compiled Python and another program."""
        return sum(
            int((a.view(np.int64) != b.view(np.int64)).sum())
            for a, b in zip(self.results["numba"], self.results[name], strict=True)
        )


def compared(name: str, calls: Calls, exact: CppKernels, fused: CppKernels) -> Compared:
    """Return a kernel with its programs: compiled Python, and C++ without and with fused multiplications.

    All programs have run once, so that code is compiled and caches are filled.
    """

    def of(library: CppKernels) -> Callable[..., None]:
        return lambda *arrays: library.call(name, calls.count, *arrays)

    kernel = Compared(calls, {"numba": getattr(block_kernels, name), "C++": of(exact), "fused": of(fused)})
    kernel.run()
    kernel.seconds.clear()
    return kernel


def scene_name() -> str:
    """Return the name of the scene of Authume's profile P1; without Authume's data, that of the scene of one bench."""
    try:
        prepare(read_scene(SCENES / "authume_p1_blocks.yaml"))
    except InputError as fault:
        print(f"Authume P1 is left out, and short falls are measured instead: {fault}")
        return "bench_blocks"
    return "authume_p1_blocks"


def unequal(one: Deposits, other: Deposits) -> list[str]:
    """Return the names of the columns that differ in any bit between two deposits."""
    columns = ((f.name, getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return [name for name, a, b in columns if np.asarray(a).tobytes() != np.asarray(b).tobytes()]


def main(rocks: int) -> None:
    """Measure, and print the table of kernels; rocks : number of rocks."""
    scene = scene_name()
    reference = prepare(read_scene(SCENES / f"{scene}.yaml").model_copy(update={"engine": "reference"}))
    began = time.perf_counter()
    recorded, deposits = recorded_calls(reference, rocks)
    print(f"{scene}: {rocks} rocks recorded in {time.perf_counter() - began:.0f} s")
    case: Case = case_of(scene, rocks)
    print(f"deposits that differ between the engines: {unequal(deposits, case.fly(1)) or 'none'}")
    exact, fused = CppKernels(), CppKernels(fused=True)
    kernels = {name: compared(name, calls, exact, fused) for name, calls in recorded.items()}
    case.seconds[1].clear()
    for _ in range(PASSES):
        case.fly(1)
        for kernel in kernels.values():
            kernel.run()
    print_table(kernels, rocks / case.per_second(), rocks)


def print_table(kernels: dict[str, Compared], flying: float, rocks: int) -> None:
    """Print the table of kernels; flying : CPU seconds of the flights of all rocks; rocks : number of rocks."""
    print(f"{platform.node()}, {platform.machine()}, load {os.getloadavg()[0]:.1f}; {rocks / flying:,.0f} rocks/s")
    print(f"{'CPU time':28} {'calls/rock':>10} {'share':>6} {'numba, ns':>10} {'C++, ns':>8} {'numba/C++':>10} "
          f"{'numba/fused C++':>16} {'different results':>18}")  # fmt: skip
    for name, kernel in kernels.items():
        calls = len(kernel.calls.changed[-1])
        numba, cpp = (1e9 * kernel.median(program) / calls for program in ("numba", "C++"))
        print(f"{KERNELS[name]:28} {calls / rocks:10,.0f} {kernel.median('numba') / flying:6.0%} {numba:10,.0f} "
              f"{cpp:8,.0f} {kernel.ratio('C++'):10.2f} {kernel.ratio('fused'):16.2f} "
              f"{kernel.different('C++'):18,}")  # fmt: skip
    numba, cpp, fused = (sum(kernel.median(each) for kernel in kernels.values()) for each in ("numba", "C++", "fused"))
    print(f"{'all':39} {numba / flying:6.0%} {'':19} {numba / cpp:10.2f} {numba / fused:16.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROCKS)
