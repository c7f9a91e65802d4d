"""Tests of random bodies over random meshes, with an overlap check that shares no code with the contact search."""

import numpy as np
import pytest
from campaigns.bodies_on_meshes import Case, case_of, faults_of, fly_case
from meshes.random_ground import FAMILIES

QUICK = ("rough", "benches", "walls", "overhangs")


def faults(name: str, seed: int, count: int) -> list[str]:
    """Return a sentence for each fault of the `count` bodies of a case, with the words that name the case."""
    case = case_of(name, seed, count)
    end = fly_case(case)
    return [f"{case.words}, body {i}: {fault}" for i in range(count) for fault in faults_of(case, end, i)]


@pytest.mark.parametrize("name", QUICK)
def test_no_body_passes_through_a_mesh_and_none_gains_energy(name):
    assert faults(name, 701, 2) == []


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(FAMILIES))
def test_no_body_of_many_passes_through_a_mesh_and_none_gains_energy(name):
    assert [fault for seed in range(801, 804) for fault in faults(name, seed, 4)] == []


def same_bits(case: Case, some: slice) -> bool:
    """Return True if both engines give bitwise equal ends, counts and paths for the bodies `some` of a case."""
    ours, theirs = (fly_case(case, engine, some) for engine in ("compiled", "reference"))
    used = int(ours.first[-1, 1])
    return (
        np.array_equal(ours.finals, theirs.finals, equal_nan=True)
        and np.array_equal(ours.counts, theirs.counts)
        and np.array_equal(ours.pieces[:used], theirs.pieces[:used], equal_nan=True)
        and np.array_equal(ours.modes[:used], theirs.modes[:used])
    )


@pytest.mark.parametrize(("name", "seed"), [("ridges", 702), ("junctions", 703)])
def test_both_engines_fly_bodies_over_random_meshes_with_the_same_bits(name, seed):
    case = case_of(name, seed, 1)
    assert same_bits(case._replace(terms=case.terms._replace(max_time=0.6)), slice(None))


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(FAMILIES))
def test_both_engines_fly_bodies_over_every_kind_of_mesh_with_the_same_bits(name):
    case = case_of(name, 704, 1)
    assert same_bits(case._replace(terms=case.terms._replace(max_time=1.2)), slice(None))
