"""Tests that the kernels in C++ of benchmarks/blocks_in_cpp.py agree with the same kernels in Python."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from bodies.bodies_in_contact import MOST, Ground, random_contacts

pytest.importorskip("cpp_blocks", reason="the benchmarks are not part of an installed package")
if shutil.which("g++") is None:
    pytest.skip("there is no C++ compiler (g++)", allow_module_level=True)

import block_kernels
from block_calls import calls_of, recorded_calls
from cpp_blocks import CppKernels

from rpf3d_core.body.contacts import SOLVER_COLUMNS
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare

SCENE = Path(__file__).parents[2] / "config" / "scenes" / "bench_blocks.yaml"
LOOPS = ("solve_impacts", "find_distances", "find_clear_times", "find_rotations")


@pytest.fixture(scope="module")
def library():
    return CppKernels()


@pytest.fixture(scope="module")
def recorded():
    """Return the recorded kernel calls of one block that falls down a bench."""
    return recorded_calls(prepare(read_scene(SCENE).model_copy(update={"engine": "reference"})), 1)[0]


def assert_same_bits(library, name, calls):
    ours, theirs = (tuple(array.copy() for array in calls.changed) for _ in range(2))
    getattr(block_kernels, name).py_func(*calls.given, *ours)
    library.call(name, calls.count, *calls.given, *theirs)
    for a, b, before in zip(ours, theirs, calls.changed, strict=True):
        assert not np.array_equal(a, before), "nothing was computed"
        np.testing.assert_array_equal(a.view(np.int64), b.view(np.int64))


@pytest.mark.parametrize("name", LOOPS)
def test_cpp_and_python_give_the_same_bits_for_all_calls_of_a_block(library, recorded, name):
    assert recorded[name].count > 100
    assert_same_bits(library, name, recorded[name])


@pytest.mark.parametrize("rolling", [0.0, 0.1])
def test_cpp_and_python_solve_random_impacts_to_the_same_bits(library, rolling):
    bodies = random_contacts(np.random.default_rng(17), 100, MOST, Ground(0.8, 0.0, rolling))
    first = np.concatenate([[0], np.cumsum(bodies.counts)])
    points = np.concatenate([rows[:count] for rows, count in zip(bodies.points, bodies.counts, strict=True)])
    within, rows = np.full(len(bodies.counts), 1e-9), np.zeros((MOST, SOLVER_COLUMNS))
    assert_same_bits(
        library, "solve_impacts", calls_of([first, bodies.moments, within, rows], [points, bodies.motion])
    )  # fmt: skip
