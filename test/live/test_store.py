"""Tests of the store that keeps the last valid terrain on disk."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from live_sites.surveyed_hills import cloud, grid, live_facets, mesh

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.store import LOCK, WHOLE, Store, read_last
from rpf3d_core.live.stored import StoredSurvey, read_piece, write_piece

ROOT = Path(__file__).parents[2]
PIECE = StoredSurvey(grid(4, 5), "d" * 64, "", 12, 34)


def kept(folder, *surveys, most_patches=64):
    """Keep a survey and patches in a store; return the resulting terrain.

    surveys : the survey, then the patches; most_patches : patches that the store keeps before it writes a whole mesh
    """
    workshop, store = Workshop(), Store(folder, most_patches)
    ground = workshop.whole(surveys[0], stamp_ns=1)
    store.keep(ground, surveys[0])
    for k, patch in enumerate(surveys[1:]):
        ground = workshop.patched(ground, patch, stamp_ns=2 + k)
        store.keep(ground, patch)
    store.close(20.0)
    assert store.fault is None
    return ground


PATCHES = (grid(8, 8, 12.3, 9.2, seed=1), cloud(100, 20.0, 14.0, 8.0, seed=2), grid(6, 9, 15.1, 9.9, seed=3))


@pytest.mark.parametrize("survey", [grid(), mesh(grid()), cloud(300, 0.0, 0.0, 20.0)], ids=["grid", "mesh", "cloud"])
def test_a_ground_comes_back_to_the_last_bit_and_says_how_old_it_is(tmp_path, survey):
    ground = kept(tmp_path, survey)
    last = read_last(tmp_path)
    again = last.ground(Workshop())
    assert np.array_equal(again.facets.geometry, ground.facets.geometry)
    assert (again.digest, again.stamp_ns) == (ground.digest, 1)
    assert last.age_s(ground.received_ns + 90 * 10**9) == 90.0
    assert last.age_s(ground.received_ns - 5) == 0.0


def test_patches_come_back_in_their_order(tmp_path):
    ground = kept(tmp_path, grid(), *PATCHES)
    again = read_last(tmp_path).ground(Workshop())
    assert np.array_equal(again.facets.geometry, ground.facets.geometry)
    assert (again.digest, again.stamp_ns, again.patches) == (ground.digest, 4, 3)


def test_a_whole_survey_takes_the_place_of_all_before(tmp_path):
    kept(tmp_path, grid(), *PATCHES)
    ground = kept(tmp_path, grid(seed=9))
    assert {path.name for path in tmp_path.iterdir()} == {WHOLE, LOCK}
    assert read_last(tmp_path).ground(Workshop()).digest == ground.digest


def test_patches_of_a_ground_before_are_not_laid_upon_another(tmp_path):
    kept(tmp_path, grid(), *PATCHES)
    stale = {path.name: path.read_bytes() for path in tmp_path.glob("patch*")}
    ground = kept(tmp_path, grid(seed=9))
    for name, content in stale.items():
        (tmp_path / name).write_bytes(content)  # the state after a kill between the two steps
    last = read_last(tmp_path)
    assert [piece.digest for piece in last.pieces] == [ground.digest]
    assert last.faults == ()


def test_many_patches_are_folded_into_a_whole_mesh(tmp_path):
    ground = kept(tmp_path, grid(), *PATCHES, most_patches=2)
    last = read_last(tmp_path)
    again = last.ground(Workshop())
    assert len(last.pieces) == 1
    assert again.digest == ground.digest
    assert len(live_facets(again)) == len(live_facets(ground))


def test_a_ground_that_is_stored_whole_after_patches_is_no_younger_and_knows_of_them(tmp_path):
    ground = kept(tmp_path, grid(), *PATCHES, most_patches=2)
    last = read_last(tmp_path)
    again = last.ground(Workshop())
    assert (again.stamp_ns, again.whole_ns) == (4, 1) == (ground.stamp_ns, ground.whole_ns)
    assert last.patches_ns(ground.received_ns) == (ground.received_ns,) * 3


def test_patches_are_known_by_the_times_of_their_reception_and_none_later_than_now(tmp_path):
    ground = kept(tmp_path, grid(), *PATCHES)
    last = read_last(tmp_path)
    times = last.patches_ns(ground.received_ns)
    assert len(times) == 3 and times == tuple(sorted(times)) and times[-1] == ground.received_ns
    assert last.patches_ns(5) == (5, 5, 5), "the machine's clock was set back"


def without_whole_ns(piece):
    """Return the header of a stored piece as an older version wrote it, without `whole_ns`."""
    return {name: getattr(piece, name) for name in ("digest", "upon", "stamp_ns", "received_ns")}


@pytest.mark.parametrize(("most_patches", "expected"), [(64, (1, 3)), (2, (0, 1))], ids=["patches", "stored whole"])
def test_a_store_of_an_older_version_makes_no_ground_younger(tmp_path, monkeypatch, most_patches, expected):
    """If the store wrote a whole mesh with its patches, the age of the survey is unknown: the stamp is 0."""
    monkeypatch.setattr("rpf3d_core.live.stored._header_of", without_whole_ns)
    ground = kept(tmp_path, mesh(grid()), *PATCHES, most_patches=most_patches)
    last = read_last(tmp_path)
    again = last.ground(Workshop())
    assert again.digest == ground.digest
    assert (again.whole_ns, len(last.patches_ns(ground.received_ns))) == expected


def test_patches_go_on_after_a_return(tmp_path):
    kept(tmp_path, grid(), *PATCHES[:1])
    last, store, workshop = read_last(tmp_path), Store(tmp_path), Workshop()
    ground = workshop.patched(last.ground(workshop), PATCHES[1])
    store.follow(last)
    store.keep(ground, PATCHES[1])
    store.close(20.0)
    assert read_last(tmp_path).ground(Workshop()).digest == ground.digest
    assert len(read_last(tmp_path).pieces) == 3


def test_an_empty_folder_holds_nothing(tmp_path):
    assert read_last(tmp_path) is None
    assert read_last(tmp_path / "none") is None


def test_every_cut_and_every_flipped_bit_is_refused_with_a_sentence(tmp_path):
    path = tmp_path / WHOLE
    write_piece(path, PIECE)
    content = path.read_bytes()
    rng = np.random.default_rng(0)
    damaged = [content[:n] for n in range(0, len(content), 7)]
    for bit in rng.integers(0, 8 * len(content), 400).tolist():
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        damaged.append(bytes(changed))
    for bad in [*damaged, content + b"x"]:
        path.write_bytes(bad)
        with pytest.raises(TerrainError, match=r"damaged|not a stored survey"):
            read_last(tmp_path)
    path.write_bytes(content)
    assert read_piece(path).digest == PIECE.digest


def test_a_survey_of_an_unknown_kind_is_refused_with_a_sentence(tmp_path, monkeypatch):
    class FutureSurvey(type(PIECE.survey)):
        pass

    path = tmp_path / WHOLE
    write_piece(path, PIECE._replace(survey=FutureSurvey(PIECE.survey.points)))
    with pytest.raises(TerrainError, match="unknown kind"):
        read_piece(path)


def test_a_damaged_patch_leaves_the_terrain_before_it_and_a_sentence(tmp_path):
    kept(tmp_path, grid(), *PATCHES)
    second = sorted(tmp_path.glob("patch*"))[1]
    second.write_bytes(second.read_bytes()[:-9])
    last = read_last(tmp_path)
    assert (len(last.pieces), last.unread) == (2, 2)
    assert last.faults[0].endswith("the terrain before this patch is used")
    assert second.name in last.faults[0]


def test_patches_after_a_damaged_patch_are_read_at_the_next_restart(tmp_path):
    """They were once stored behind the damaged file, where a later restart did not read them."""
    kept(tmp_path, grid(), *PATCHES)
    second = sorted(tmp_path.glob("patch*"))[1]
    second.write_bytes(second.read_bytes()[:-9])
    last, store, workshop = read_last(tmp_path), Store(tmp_path), Workshop()
    ground = last.ground(workshop)
    store.follow(last)
    for patch in (PATCHES[2], PATCHES[1]):
        ground = workshop.patched(ground, patch)
        store.keep(ground, patch)
        assert store.flush(20.0)
    store.close(20.0)
    after = read_last(tmp_path)
    assert (after.unread, after.faults) == (0, ())
    assert [piece.upon != "" for piece in after.pieces] == [False, True], "a whole terrain, then patches again"
    assert after.ground(Workshop()).digest == ground.digest


def test_a_disk_that_cannot_be_written_to_is_a_fault_told_and_no_more(tmp_path):
    ground, store = Workshop().whole(grid()), Store(tmp_path / "store")
    (tmp_path / "store" / LOCK).unlink()
    (tmp_path / "store").rmdir()
    store.keep(ground, grid())
    assert store.flush(20.0)
    assert "could not be saved" in store.fault
    (tmp_path / "store").mkdir()
    store.keep(ground, grid())
    assert store.flush(20.0)
    assert store.fault is None


def test_a_second_store_in_a_folder_is_refused_by_the_folders_name_until_the_first_is_closed(tmp_path):
    first = Store(tmp_path)
    with pytest.raises(InputError, match=f"^{re.escape(str(tmp_path))}: another simulator uses this folder"):
        Store(tmp_path)
    first.keep(Workshop().whole(grid()), grid())
    first.close(20.0)
    Store(tmp_path).close(20.0)
    assert read_last(tmp_path) is not None


def test_a_folder_that_cannot_be_locked_is_told_of_and_written_to_all_the_same(tmp_path):
    (tmp_path / LOCK).mkdir()
    store = Store(tmp_path)
    assert "could not be locked" in store.fault
    store.keep(Workshop().whole(grid()), grid())
    store.close(20.0)
    assert "could not be locked" in store.fault, "it is no safer for having been written to"
    assert read_last(tmp_path) is not None


WRITER = """
import sys
from pathlib import Path
sys.path[:0] = [{root!r}, {test!r}]
from live_sites.surveyed_hills import grid
from rpf3d_core.live.stored import StoredSurvey, write_piece
from rpf3d_core.live.store import WHOLE
surveys = [grid(300, 300, seed=k) for k in range(2)]
while True:
    for k, survey in enumerate(surveys):
        write_piece(Path({folder!r}) / WHOLE, StoredSurvey(survey, str(k), "", k, k))
        print(k, flush=True)
"""


def test_a_writer_that_is_killed_at_any_moment_leaves_a_whole_file(tmp_path):
    code = WRITER.format(root=str(ROOT), test=str(ROOT / "test" / "support"), folder=str(tmp_path))
    expected = [grid(300, 300, seed=k).points for k in range(2)]
    writer = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    try:
        for _ in range(3):
            writer.stdout.readline()
        for _ in range(20):
            os.kill(writer.pid, signal.SIGSTOP)  # a kill would leave the present files
            piece = read_last(tmp_path).pieces[0]
            assert np.array_equal(piece.survey.points, expected[int(piece.digest)])
            os.kill(writer.pid, signal.SIGCONT)
            time.sleep(0.003)
    finally:
        writer.kill()
        writer.wait()
    assert read_last(tmp_path) is not None


def test_a_patch_that_could_not_be_written_leaves_no_gap_for_those_that_follow(tmp_path, monkeypatch):
    workshop, store = Workshop(), Store(tmp_path)
    ground = workshop.whole(grid(), stamp_ns=1)
    store.keep(ground, grid())
    assert store.flush(20.0)

    def full(path, piece):
        raise OSError("no space left on device")

    monkeypatch.setattr("rpf3d_core.live.store.write_piece", full)
    ground = workshop.patched(ground, PATCHES[0], stamp_ns=2)
    store.keep(ground, PATCHES[0])
    assert store.flush(20.0) and "no space left" in store.fault
    monkeypatch.undo()
    ground = workshop.patched(ground, PATCHES[1], stamp_ns=3)
    store.keep(ground, PATCHES[1])
    store.close(20.0)
    assert store.fault is None
    assert read_last(tmp_path).pieces[-1].digest == ground.digest
