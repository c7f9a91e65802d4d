"""Tests that a missing survey or patch is a fault that neither a restart nor an unforeseen error hides."""

from collections import namedtuple
from dataclasses import replace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from never_green import combination, pit
from never_green.combination import Run, configuration_of
from never_green.plan import ClockRule, Plan, Send, Speaker, Truth
from never_green.stories import RADAR_A, patch_send, survey

from rpf3d_core.alerts.log import DecisionLog
from rpf3d_ros.engine.terrain_faults import (
    NOT_STORED,
    TerrainBefore,
    TerrainLack,
    lack_of,
    not_restored,
    terrain_to_remember,
)
from rpf3d_ros.nodes import inputs

TRUTH = Truth(sources=(), bank_until=np.inf, areas=(pit.outline(pit.ROAD),) * 2, area_since=0.0)
TOPICS = (RADAR_A, "terrain/points", "terrain/mesh", "terrain/update", "areas/polygon")
PLAN = Plan(
    truth=TRUTH, sends=(), speakers=tuple(Speaker(topic=topic, number=0) for topic in TOPICS), sensors=(RADAR_A,),
    limits="restrict", expects=False,
)  # fmt: skip
WHOLE = Send(sent=0.1, at=0.1, topic="terrain/points", kind="grid", places=survey(TRUTH, 0.1))
AREA = Send(sent=0.2, at=0.2, topic="areas/polygon", kind="polygon", places=pit.outline(pit.ROAD))
NOTHING = Send(sent=0.3, at=0.3, topic=RADAR_A, kind="poses", places=np.empty((0, 3)))
EARLIER = WHOLE._replace(sent=0.15, at=0.15, places=survey(TRUTH, 3.0))
PATCH = patch_send(TRUTH, 0.4, ((16.0, 24.0), (8.0, 24.0)))


def at(send, moment):
    return send._replace(sent=moment, at=moment)


def again(send, moment):
    """Return the same message, published again at a later time `moment` (s) with its original stamp."""
    return send._replace(sent=moment, at=moment, offset=send.sent - moment)


def published(sent):
    """Return the publication time (ns) of a message that is sent at a time (s), as in `Run.deliver`."""
    return round((1e9 + sent) * 1e9)


def faults_after(run, *sends):
    """Deliver messages to the node one by one; return the faults of its alert after the last."""
    for send in sends:
        run.deliver(send)
        run.node.tick()
    return run.node.station.desk.alert.faults


@pytest.fixture
def started(monkeypatch, tmp_path):
    """Yield a function that starts a node; all these nodes share a decision log.

    standing : restored terrain, or None; before : what the log recorded about the terrain
    """
    runs = []

    def start(standing=None, **before):
        def configured(plan):
            log, known = DecisionLog(tmp_path, "0.1.0"), TerrainBefore(**before)
            return replace(configuration_of(plan), log=log, standing=standing, standing_report="restored", before=known)

        monkeypatch.setattr(combination, "configuration_of", configured)
        runs.append(Run(PLAN))
        return runs[-1]

    yield start
    runs[-1].node.close()


@pytest.mark.parametrize(
    ("bad", "sentence"),
    [(PATCH._replace(frame="drone"), "1 patches are not in"), (at(WHOLE, 0.5)._replace(frame="drone"), "was refused")],
    ids=["a patch", "a survey"],
)
def test_a_restart_does_not_hide_what_the_terrain_lacks(started, bad, sentence):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    assert sentence in faults_after(run, bad)[0]
    standing = run.node.station.flyer.standing
    run.node.close()
    run = started(standing)
    assert sentence in faults_after(run, at(AREA, 1.0), at(NOTHING, 1.1))[0]
    assert faults_after(run, at(WHOLE, 1.2)) == ()


def test_a_latched_survey_that_comes_again_after_a_restart_hides_no_patch_that_it_replaces(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING, PATCH) == ()
    standing = run.node.station.flyer.standing
    run.node.close()
    run = started(standing, read_ns=published(0.5), patches_ns=(published(0.4),))
    assert faults_after(run, at(AREA, 1.0), at(NOTHING, 1.1)) == ()
    assert faults_after(run, WHOLE) == ()
    assert run.node.station.flyer.standing.ground.digest == standing.ground.digest
    assert "1 patches are not in" in faults_after(run, EARLIER)[0]
    assert faults_after(run, at(WHOLE, 1.2)) == ()


def test_a_survey_that_is_published_again_hides_neither_a_patch_nor_that_one_is_missing(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING, PATCH) == ()
    patched = run.node.station.flyer.standing.ground.digest
    assert faults_after(run, again(WHOLE, 0.5)) == ()
    assert run.node.station.flyer.standing.ground.digest == patched
    faults = faults_after(run, PATCH._replace(sent=0.6, frame="drone"), again(WHOLE, 0.7))
    assert "1 patches are not in" in faults[0]


@pytest.mark.parametrize("late", [WHOLE, EARLIER], ids=["the survey in use", "another one"])
def test_a_survey_from_before_a_refused_one_does_not_make_it_good(started, late):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    assert "was refused" in faults_after(run, at(WHOLE, 0.5)._replace(frame="drone"))[0]
    assert "was refused" in faults_after(run, again(late, 0.6))[0]
    assert faults_after(run, at(WHOLE, 0.7)) == ()


def test_a_survey_from_before_a_refused_patch_lacks_it(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    assert "1 patches are not in" in faults_after(run, PATCH._replace(frame="drone"))[0]
    assert "1 patches are not in" in faults_after(run, again(EARLIER, 0.6))[0]
    assert faults_after(run, at(WHOLE, 0.7)) == ()


def test_without_a_store_a_survey_that_is_published_again_after_a_restart_lacks_the_patches(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING, PATCH) == ()
    run.node.close()
    run = started(read_ns=published(0.5))
    faults = faults_after(run, again(WHOLE, 1.0), at(AREA, 1.1), at(NOTHING, 1.2))
    assert "1 patches are not in" in faults[0]
    assert faults_after(run, at(WHOLE, 1.3)) == ()


@pytest.mark.parametrize("stored", ["nothing is stored", "the terrain"])
def test_a_latched_survey_from_before_a_restart_ends_no_fault_of_what_the_terrain_lacked(started, stored):
    run = started()
    assert "1 patches are not in" in faults_after(run, WHOLE, AREA, NOTHING, PATCH._replace(frame="drone"))[0]
    standing = run.node.station.flyer.standing if stored == "the terrain" else None
    run.node.close()
    run = started(standing, read_ns=published(0.5))
    assert "1 patches are not in" in faults_after(run, WHOLE, at(AREA, 1.0), at(NOTHING, 1.1))[0]
    assert faults_after(run, at(WHOLE, 1.2)) == ()


def test_stored_patches_that_cannot_be_read_are_missing_until_the_next_whole_survey(started):
    run = started(read_ns=published(0.05), unread=2)
    sends = (at(WHOLE, 0.01), AREA, NOTHING)
    assert "2 patches are not in" in faults_after(run, *sends)[0]
    assert faults_after(run, at(WHOLE, 0.6)) == ()


def test_stored_patches_that_could_not_be_read_are_still_missing_after_the_store_wrote_the_whole_terrain(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    standing = run.node.station.flyer.standing
    run.node.close()
    run = started(standing, read_ns=published(0.35), unread=2)
    assert "2 patches are not in" in faults_after(run, at(AREA, 0.9), at(NOTHING, 1.0), at(PATCH, 1.1))[0]
    standing = run.node.station.flyer.standing
    assert standing.ground.patches == 1
    run.node.close()
    run = started(standing, read_ns=published(1.5))
    assert "2 patches are not in" in faults_after(run, at(AREA, 2.0), at(NOTHING, 2.1))[0]
    assert faults_after(run, at(WHOLE, 2.2)) == ()


def test_a_stored_terrain_that_cannot_be_read_may_have_had_patches(started):
    run = started(read_ns=published(0.05), unreadable="the last terrain could not be restored: damaged")
    assert "could not be restored: damaged" in faults_after(run, at(WHOLE, 0.01), AREA, NOTHING)[0]
    assert faults_after(run, at(WHOLE, 0.6)) == ()


def test_an_unforeseen_error_in_the_intake_of_a_survey_is_a_fault_until_the_next(started, monkeypatch):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    monkeypatch.setattr(inputs, "check_cloud", lambda *given: 1 / 0)
    assert "ZeroDivisionError" in faults_after(run, at(WHOLE, 0.5))[0]
    monkeypatch.undo()
    assert faults_after(run, at(WHOLE, 0.6)) == ()


def test_each_patch_whose_intake_raises_is_a_patch_that_the_terrain_lacks(started, monkeypatch):
    """Each patch counts even if the error is the same; a survey published before the patches does not end the fault."""
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    monkeypatch.setattr(inputs, "check_cloud", lambda *given: 1 / 0)
    assert "2 patches are not in" in faults_after(run, at(PATCH, 0.5), at(PATCH, 0.6))[0]
    monkeypatch.undo()
    assert "2 patches are not in" in faults_after(run, at(WHOLE, 0.45)._replace(at=0.7))[0]
    assert faults_after(run, at(WHOLE, 0.8)) == ()


def test_while_the_middleware_fails_the_terrain_is_a_fault_and_then_out_of_date(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    run.node.inputs._report_middleware("rcl returned 1", published(0.5))
    assert "cannot be received: rcl returned 1" in faults_after(run, at(WHOLE, 0.55))[0]
    run.node.inputs._report_middleware("", published(0.6))
    assert "was refused (rcl returned 1)" in faults_after(run, at(NOTHING, 0.65))[0]
    assert faults_after(run, at(WHOLE, 0.7)) == ()


def test_inputs_that_are_closed_while_the_middleware_fails_leave_the_terrain_out_of_date(started, monkeypatch):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING) == ()
    run.node.inputs._report_middleware("rcl returned 1", published(0.5))
    monkeypatch.setattr(inputs.time, "time_ns", lambda: published(0.6), raising=False)
    run.node.inputs.close()
    assert [fault for fault in faults_after(run) if "cannot be received" in fault] == []
    assert "was refused (rcl returned 1)" in run.node.station.desk.standing.sentences[0]


def test_faults_of_the_terrain_are_read_as_they_are_written():
    lack = TerrainLack(patches=3, why_refused="frame_id is 'a\nb'; it must be 'map'")
    assert lack_of(["the sources are stale", lack.survey_sentence, lack.patches_sentence]) == lack
    assert lack_of(["the sources are stale"]) == TerrainLack()


Restored = namedtuple("Restored", "digest patches whole_ns whole_digest", defaults=("w",))


@pytest.mark.parametrize(("restored", "unread", "lack"), [
    (Restored("c", 5, 20), 0, TerrainLack()),  # the store wrote the whole terrain and counts from 0 again
    (Restored("b", 69, 20), 0, TerrainLack(1)),
    (Restored("b", 70, 20), 0, TerrainLack(1)),  # at least one patch is missing, even if the counts agree
    (Restored("b", 4, 20), 0, TerrainLack(66)),
    (Restored("b", 5, 10), 0, TerrainLack(why_refused=NOT_STORED)),
    (Restored("b", 69, 20), 1, TerrainLack()),  # already reported as unreadable
    (None, 0, TerrainLack(70)),
])  # fmt: skip
def test_a_restored_terrain_is_compared_by_its_digest(restored, unread, lack):
    memory = terrain_to_remember(Restored("c", 70, 20), {})
    assert terrain_to_remember(None, memory) == memory
    assert not_restored(memory, restored, unread) == lack


def test_a_memory_of_an_earlier_version_has_only_the_number_of_patches():
    assert not_restored({"patches": 7}, Restored("b", 5, 20), 0) == TerrainLack(2)
    assert not_restored({}, Restored("b", 5, 20), 0) == TerrainLack()


OLD_PATCH = patch_send(TRUTH, 0.12, ((16.0, 24.0), (8.0, 24.0)))


@pytest.mark.parametrize("is_stored", [True, False], ids=["with the stored terrain", "with the decision log alone"])
def test_a_patch_that_is_older_than_the_terrain_in_use_is_refused_after_a_restart_too(started, is_stored):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING, PATCH) == ()
    standing = run.node.station.flyer.standing
    run.node.close()
    run = started(standing if is_stored else None, read_ns=published(0.5), patches_ns=(published(0.4),) * is_stored)
    whole = () if is_stored else (at(WHOLE, 0.9)._replace(offset=-0.4),)
    assert faults_after(run, *whole, at(AREA, 1.0), at(NOTHING, 1.1)) == ()
    digest = run.node.station.flyer.standing.ground.digest
    assert "1 patches are not in" in faults_after(run, again(OLD_PATCH, 1.2))[0]
    assert run.node.station.flyer.standing.ground.digest == digest


def test_a_survey_that_was_measured_before_a_stored_patch_lacks_it_after_a_restart(started):
    run = started()
    assert faults_after(run, WHOLE, AREA, NOTHING, PATCH) == ()
    standing, times = run.node.station.flyer.standing, {"read_ns": published(0.5), "patches_ns": (published(0.4),)}
    run.node.close()
    run = started(standing, **times, stamps_ns=(standing.ground.stamp_ns,))
    assert faults_after(run, at(AREA, 1.0), at(NOTHING, 1.1)) == ()
    assert "1 patches are not in" in faults_after(run, again(EARLIER, 1.2))[0]
    assert faults_after(run, at(WHOLE, 1.3)) == ()


def test_an_area_that_is_older_than_the_last_before_a_restart_ends_no_fault(started):
    run = started()
    assert faults_after(run, WHOLE, at(AREA, 0.4), NOTHING) == ()
    standing = run.node.station.flyer.standing
    run.node.close()
    run = started(standing, read_ns=published(0.5))
    faults = faults_after(run, again(AREA, 1.0), at(NOTHING, 1.1))
    assert any("older than the last message on areas/polygon" in fault for fault in faults)
    assert any("had an area before" in fault for fault in faults)
    assert faults_after(run, at(AREA, 1.2)) == ()


@pytest.mark.parametrize(
    "old", [OLD_PATCH, WHOLE._replace(places=survey(TRUTH, 6.0)), AREA], ids=["a patch", "a survey", "an area"]
)
def test_after_a_small_step_back_of_the_clock_an_older_message_is_refused(old):
    run = Run(PLAN._replace(clock=ClockRule(jump=-0.4, jump_at=2.0)))
    try:
        assert faults_after(run, WHOLE, AREA, NOTHING, at(WHOLE, 1.0), at(AREA, 1.1)) == ()
        digest = run.node.station.flyer.standing.ground.digest
        assert "clock went back" in faults_after(run, at(NOTHING, 1.9), at(AREA, 2.0))[0]
        assert faults_after(run, at(NOTHING, 2.1)) == ()
        assert len(faults_after(run, again(old, 2.2))) == 1
        assert run.node.station.flyer.standing.ground.digest == digest
        assert faults_after(run, at(WHOLE, 2.5), at(AREA, 2.5)) == ()
    finally:
        run.close()


def test_after_a_large_step_back_of_the_clock_areas_and_patched_terrain_must_be_published_again():
    run = Run(PLAN._replace(clock=ClockRule(jump=-1.0, jump_at=2.0)))
    try:
        assert faults_after(run, WHOLE, AREA, NOTHING, PATCH) == ()
        faults = faults_after(run, at(NOTHING, 1.9), at(NOTHING, 2.1), at(NOTHING, 2.2))
        assert len(faults) == 2 and "1 patches are not in" in faults[0] + faults[1]
        assert any("had an area before" in fault for fault in faults)
        assert faults_after(run, at(WHOLE, 2.5), at(AREA, 2.5)) == ()
    finally:
        run.close()
