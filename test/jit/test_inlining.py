"""Tests that kernels are copied into the loops that call them; without copies, e.g. for a new numba, bits are equal."""

from pathlib import Path

import pytest
from programs.command_line import python

pytest.importorskip("numba", reason="numba is not installed: there is nothing to compile")

COMPILED = """
import math
from numba.core.codegen import JITCodeLibrary
from rpf3d_core.jit.dispatch import kernel, loop

made = []
usual = JITCodeLibrary._finalize_final_module

def noted(library):
    made.append(library.name)
    usual(library)

JITCodeLibrary._finalize_final_module = noted

@kernel
def innermost_kernel(x):
    return math.sqrt(x) + 1.0

@kernel
def outer_kernel(x):
    return innermost_kernel(2.0 * x)

@loop
def loop_around(n):
    s = 0.0
    for i in range(n):
        s += outer_kernel(float(i))
    return s

loop_around(3)
code = loop_around.inspect_llvm(loop_around.signatures[0])
calls = [line for line in code.splitlines() if " call " in line and "_kernel" in line]
print([sum(word in name for name in made) for word in ("loop_around", "outer_kernel", "innermost_kernel")], len(calls))
"""
"""Program that prints the number of compiled functions of a name, and the number of kernel calls left in the loop."""
FLOWN = """
import hashlib
import numpy as np
from rpf3d_core.jit import dispatch
from rpf3d_core.simulation.engines import engine_of
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain

facets = facets_of(pit_terrain(Pit(triangles=6000)))
low, high = np.array(facets.low), np.array(facets.high)
below = engine_of("compiled", facets).ground_below(np.random.default_rng(1).uniform(low, high + 10.0, (2000, 3)))
print(dispatch.Inlined is not None, np.isfinite(below[:, 0]).sum(), hashlib.sha256(below.tobytes()).hexdigest())
"""
"""Program that prints whether kernels are copied, the number of points with ground, and a digest of the ground."""
MOVED = "import numba, numba.core.compiler_machinery as inner; del inner.PassManager"
RENAMED = "from numba.core.codegen import CodeLibrary; del CodeLibrary._finalized"


def said(program: str, home: Path) -> list[str]:
    done = python(program, XDG_CACHE_HOME=str(home))
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_machine_code_is_made_of_the_loop_alone_which_calls_no_kernel(tmp_path: Path) -> None:
    file = tmp_path / "compiled.py"  # numba caches only functions from files
    file.write_text(COMPILED)
    assert said(f"import runpy; runpy.run_path({str(file)!r})", tmp_path) == ["[1,", "0,", "0]", "0"]


@pytest.mark.long
def test_where_numba_has_moved_what_copying_rests_on_the_bits_are_the_same(tmp_path: Path) -> None:
    copied, there, bits = said(FLOWN, tmp_path / "copied")
    assert copied == "True" and int(there) > 1000
    assert said(f"{MOVED}\n{FLOWN}", tmp_path / "moved") == ["False", there, bits]


def test_a_part_of_numba_that_has_another_name_is_noticed_before_anything_is_compiled() -> None:
    done = python(f"{RENAMED}\nfrom rpf3d_core.jit import dispatch\nprint(dispatch.Inlined)")
    assert done.stdout.strip() == "None", done.stderr
