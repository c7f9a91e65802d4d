"""Tests that the tallies of a part of a run can be pickled without loss, stay small, and can count further rocks."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scenes.small_pit import scene_file

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.hazard.bins import Scales
from rpf3d_core.hazard.partial import add_packed, packed, packed_tallies, unpacked
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import empty_tallies, prepare, releases_in_ranges


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    return prepare(read_scene(scene_file(tmp_path_factory.mktemp("pit"))))


def counted(prepared, *ranges, tallies=None):
    """Count the rocks in the given ranges, one per source; return the tallies, new ones if `tallies` is None."""
    tallies = tallies or empty_tallies(prepared)
    fly_ensemble(prepared.engine, prepared.flight, releases_in_ranges(prepared, ranges), watch=tallies)
    return tallies


def columns(tally):
    bins = np.concatenate([np.empty((0, tally.slots.bins.shape[1]), np.uint32), *tally.bins_found()])
    return {**tally.found()._asdict(), "bins": bins}


def assert_same(one, other):
    assert (one.merges, one.used, one.scales, one.limit) == (other.merges, other.used, other.scales, other.limit)
    for name, column in columns(one).items():
        assert np.array_equal(column, columns(other)[name]), name


NAMES = ("squares", "facets", "zones", "inside")


def test_a_tally_comes_back_from_another_process_as_it_was(prepared):
    tallies = counted(prepared, range(40), range(20))
    for name, part in zip(NAMES, pickle.loads(pickle.dumps(packed_tallies(tallies))), strict=True):
        assert getattr(tallies, name).used > 0
        assert_same(unpacked(part), getattr(tallies, name))


def test_a_tally_of_no_rocks_travels_too(prepared):
    tallies = empty_tallies(prepared)
    back = unpacked(pickle.loads(pickle.dumps(packed(tallies.facets))))
    assert back.used == 0 and len(back.slot) == len(tallies.facets.slot)


def test_more_rocks_can_be_counted_in_what_came_back(prepared):
    whole = counted(prepared, range(40), range(20))
    first = counted(prepared, range(15), range(20))
    for name in NAMES:
        setattr_frozen(first, name, unpacked(packed(getattr(first, name))))
    counted(prepared, range(15, 40), range(0), tallies=first)
    for name in NAMES:
        assert_same(getattr(first, name), getattr(whole, name))


def setattr_frozen(record, name, value):
    object.__setattr__(record, name, value)


def test_what_travels_grows_with_what_rocks_did_and_not_with_the_terrain(prepared):
    tallies = counted(prepared, range(10), range(0))
    tally = tallies.facets
    dense = sum(bins.nbytes for bins in tally.bins_found())
    assert len(pickle.dumps(packed(tally))) < 0.2 * dense
    assert len(packed(tally).rocks) <= 2 * tally.found().rocks.sum(), "a rock of the only mass fills two bins"


def test_parts_of_another_ensemble_are_refused(prepared):
    tallies = empty_tallies(prepared)
    part = packed_tallies(counted(prepared, range(5), range(0)))
    scales = part[0].scales
    for change in ({"cells": 7}, {"limit": 1.0}, {"scales": Scales((1.0, 1.0, 1.0), scales.bins, scales.per_octave)}):
        with pytest.raises(ValueError, match="another ensemble"):
            add_packed(tallies, [replace(part[0], **change), *part[1:]])
    assert all(getattr(tallies, name).used == 0 for name in NAMES)


def test_what_was_packed_does_not_change_when_counting_goes_on(prepared):
    tallies = counted(prepared, range(10), range(0))
    part = packed(tallies.facets)
    before = columns(unpacked(part))
    back = unpacked(part)
    back.add(tallies.facets)
    counted(prepared, range(10, 20), range(0), tallies=tallies)
    for name, column in columns(unpacked(part)).items():
        assert np.array_equal(column, before[name]), name
