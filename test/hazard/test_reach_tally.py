"""Tests that counts of rocks alone, as live answers need them of facets, are those of the counts of all figures."""

import numpy as np
import pytest
from scenes.small_pit import scene_file

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.hazard.maps import Layers, ReachCounts
from rpf3d_core.hazard.reach_tally import ReachTally
from rpf3d_core.hazard.tallies import Tallies, with_reach_only
from rpf3d_core.hazard.walks.visits import USED, empty_visits, next_rock, visit
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import Prepared, empty_tallies, prepare, releases_in_ranges


@pytest.fixture(scope="module", params=["compiled", "reference"])
def prepared(request, tmp_path_factory) -> Prepared:
    if request.param == "compiled":
        pytest.importorskip("numba", reason="numba is not installed")
    path = scene_file(tmp_path_factory.mktemp("pit"))
    path.write_text(path.read_text() + f"\nengine: {request.param}\n")
    return prepare(read_scene(path))


def counted(prepared: Prepared, *ranges: range, tallies: Tallies) -> Tallies:
    """Count the rocks in the given ranges, one range for each source, on several threads; return the tallies."""
    fly_ensemble(prepared.engine, prepared.flight, releases_in_ranges(prepared, ranges), watch=tallies)
    return tallies


def reached_by(tallies: Tallies) -> ReachCounts:
    found = tallies.maps(1, ()).reached_facets
    assert found is not None
    return found


def assert_same(reached: ReachCounts, layers: Layers) -> None:
    assert len(layers.cell) > 10 and layers.rocks.max() > 1
    assert np.array_equal(reached.cell, layers.cell) and np.array_equal(reached.rocks, layers.rocks)


def test_the_rocks_on_each_facet_are_those_of_the_full_counts(prepared):
    full = counted(prepared, range(40), range(20), tallies=empty_tallies(prepared)).maps(60, ())
    lean = counted(prepared, range(40), range(20), tallies=with_reach_only(empty_tallies(prepared))).maps(60, ())
    assert full.reached_facets is None and lean.reached_facets is not None
    assert len(lean.facets.cell) == 0, "nothing else of facets is counted"
    assert_same(lean.reached_facets, full.facets)
    for one, other in ((lean.cells, full.cells), (lean.zones, full.zones)):
        assert np.array_equal(one.rocks, other.rocks) and np.array_equal(one.impacts, other.impacts)
        assert np.array_equal(one.energy.largest, other.energy.largest)
        assert np.array_equal(one.height.p95, other.height.p95, equal_nan=True)


def test_counts_of_two_parts_add_up(prepared):
    full = counted(prepared, range(40), range(20), tallies=empty_tallies(prepared)).maps(60, ())
    first = counted(prepared, range(25), range(5), tallies=with_reach_only(empty_tallies(prepared)))
    last = counted(prepared, range(25, 40), range(5, 20), tallies=with_reach_only(empty_tallies(prepared)))
    first.add(last)
    assert_same(reached_by(first), full.facets)


def test_an_emptied_tally_counts_anew_in_the_same_memory(prepared):
    tallies = counted(prepared, range(40), range(20), tallies=with_reach_only(empty_tallies(prepared)))
    assert tallies.reach is not None
    memory = tallies.reach.rocks
    again = tallies.reach.emptied()
    assert again.rocks is memory and not memory.any() and len(again.reached().cell) == 0


@pytest.mark.parametrize("compiled", [True, False])
def test_a_widened_tally_keeps_its_counts_and_has_room_for_more_cells(compiled):
    tally, visits = ReachTally(3, compiled), empty_visits(100, 8, figures=False)
    for rock, cells in enumerate(([0, 2], [2, 2, 0], [2])):
        next_rock(visits, rock)
        for cell in cells:
            visit(visits, cell, 0.0, 1.0)
    tally.fold(visits)
    assert visits.state[USED] == 0
    tally.widened(100)
    next_rock(visits, 3)
    visit(visits, 99, 0.0, 1.0)
    tally.fold(visits)
    found = tally.reached()
    assert found.cell.tolist() == [0, 2, 99] and found.rocks.tolist() == [2, 3, 1] and found.all_cells >= 100
