"""Tests of which surveys and patches wait, in which order, and which are lost."""

import threading

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.engine import waiting_terrain
from rpf3d_ros.engine.waiting_terrain import UNTRIED, Moment, WaitingTerrain
from rpf3d_ros.messages.refusals import MessageRefused


def surveys(*wholes, patches=()):
    waiting = WaitingTerrain(8)
    for whole in wholes:
        waiting.put_whole(whole)
    for patch in patches:
        waiting.put_patch(patch)
    return waiting


def test_the_latest_whole_survey_wins_and_the_older_are_history_once_it_is_terrain():
    waiting = surveys("a", "b", "c")
    assert waiting.take() == ("whole", "c")
    waiting.accepted()
    assert len(waiting) == 0 and waiting.overtaken == 2


def test_a_good_survey_that_a_bad_one_overtook_becomes_the_terrain():
    waiting = surveys("good", "bad")
    assert waiting.take() == ("whole", "bad")
    waiting.refused()
    assert waiting.take() == ("whole", "good")
    waiting.accepted()
    assert len(waiting) == 0


def test_only_so_many_whole_surveys_wait():
    waiting, found = surveys(*range(10)), []
    while len(waiting):
        found.append(waiting.take()[1])
        waiting.refused()
    assert found == [9, 8, 7] and len(found) == UNTRIED


def test_patches_are_applied_in_order_after_the_survey_they_follow():
    waiting = surveys("old", patches=("of old",))
    waiting.put_whole("new")
    for patch in ("first", "second"):
        waiting.put_patch(patch)
    assert waiting.take() == ("whole", "new")
    waiting.accepted()
    assert [waiting.take(), waiting.take()] == [("patch", "first"), ("patch", "second")]
    assert len(waiting) == 0


def test_patches_outlive_a_survey_that_is_refused():
    waiting = surveys("bad", patches=("kept",))
    waiting.take()
    waiting.put_patch("kept too")
    waiting.refused()
    assert [waiting.take(), waiting.take()] == [("patch", "kept"), ("patch", "kept too")]


def test_a_survey_that_comes_while_another_is_tried_is_next():
    waiting = surveys("first")
    waiting.take()
    waiting.put_whole("second")
    waiting.accepted()
    assert waiting.take() == ("whole", "second")


def test_patches_that_find_no_room_are_refused_and_counted():
    waiting = surveys(patches=range(8))
    with pytest.raises(MessageRefused, match=r"8 patches are waiting already \(waiting_patches\)"):
        waiting.put_patch(9)
    assert waiting.lost_patches == 1


def test_a_whole_survey_makes_good_what_patches_were_lost():
    waiting = surveys(patches=range(8))
    with pytest.raises(MessageRefused):
        waiting.put_patch(9)
    waiting.put_whole("new")
    waiting.take()
    waiting.accepted()
    assert waiting.lost_patches == 0


def test_a_patch_lost_behind_a_survey_stays_lost_when_that_survey_is_the_terrain():
    waiting = surveys("new", patches=range(8))
    waiting.take()
    with pytest.raises(MessageRefused):
        waiting.put_patch(9)
    waiting.accepted()
    assert waiting.lost_patches == 1


def test_a_patch_that_is_not_used_is_lost_until_the_next_whole_survey():
    waiting = surveys(patches=["unusable"])
    waiting.take()
    waiting.put_whole("new")
    waiting.lost()
    assert waiting.lost_patches == 1
    waiting.take()
    waiting.accepted()
    assert waiting.lost_patches == 0


def test_a_survey_that_is_repeated_takes_nothing_from_the_terrain_and_makes_nothing_good():
    waiting = surveys("mesh", patches=("applied", "unusable"))
    waiting.take()
    waiting.accepted()
    waiting.take()
    waiting.take()
    waiting.lost()
    waiting.put_patch("before the repetition")
    waiting.put_whole("mesh again", Moment(9))
    waiting.put_patch("after it")
    assert waiting.take() == ("whole", "mesh again")
    waiting.repeated()
    assert waiting.lost_patches == 1
    assert [waiting.take(), waiting.take()] == [("patch", "before the repetition"), ("patch", "after it")]
    assert len(waiting) == 0


def test_a_survey_that_is_repeated_is_later_than_those_that_waited():
    waiting = surveys("mesh")
    waiting.take()
    waiting.accepted()
    waiting.put_whole("other", Moment(3))
    waiting.put_patch("of the other", Moment(4, 0))
    waiting.refuse("whole", 5, "bad")
    waiting.put_whole("mesh again", Moment(6))
    waiting.refuse("whole", 7, "bad, too")
    waiting.take()
    waiting.repeated(lost=2)
    assert (waiting.lost_patches, waiting.refused_surveys, waiting.why_refused) == (2, 2, "bad, too")
    assert waiting.take() == ("patch", "of the other")
    waiting.put_whole("mesh again", Moment(6))
    assert len(waiting) == 0, "the same publication, latched"


def test_patches_outlive_a_survey_that_is_dropped_untried():
    waiting = surveys("dropped", patches=["kept"])
    for survey in range(UNTRIED):
        waiting.put_whole(survey)
    found = []
    while len(waiting):
        kind, survey = waiting.take()
        found.append(survey)
        if kind == "whole":
            waiting.refused()
    assert found == [2, 1, 0, "kept"]


@pytest.mark.parametrize(
    ("patch", "whole", "follows"),
    [
        (Moment(2, 7), Moment(1), True),
        (Moment(1, 7), Moment(1), False),
        (Moment(1, 7), Moment(2), False),
        (Moment(2, 7), Moment(1, 7), True),
        (Moment(2, 6), Moment(1, 7), False),  # surveyed before the survey, published after it
        (Moment(1, 8), Moment(2, 7), True),  # the survey was published late, or again
        (Moment(1, 7), Moment(2, 7), False),
    ],
)
def test_a_patch_follows_a_survey_with_an_older_stamp_or_without_one_that_was_published_before(patch, whole, follows):
    assert patch.follows(whole) is follows


def late(*patches, most=8):
    """Return a queue of terrain that has received and handed out patches published at 1, 2, ....

    The tests then add a survey that was published before these patches. most : number of patches that are kept
    """
    waiting = WaitingTerrain(most)
    for number, patch in enumerate(patches, start=1):
        waiting.put_patch(patch, Moment(number, 0))
        waiting.take()
    return waiting


def laid(waiting):
    """Take a survey and all patches out of the queue; return their contents in this order."""
    kind, survey = waiting.take()
    assert kind == "whole"
    waiting.accepted()
    return [survey, *(waiting.take()[1] for _ in range(len(waiting)))]


def test_patches_heard_before_a_survey_that_they_follow_are_laid_upon_it_as_well():
    waiting = late("before", "taken")
    waiting.put_patch("waits", Moment(3, 0))
    waiting.put_whole("late", Moment(1))
    waiting.put_patch("last", Moment(4, 0))
    assert laid(waiting) == ["late", "taken", "waits", "last"]
    assert waiting.lost_patches == 0


def test_a_patch_that_was_lost_before_its_survey_came_is_laid_upon_it():
    waiting = late("early")
    waiting.lost()
    waiting.put_whole("late", Moment(0))
    assert laid(waiting) == ["late", "early"]
    assert waiting.lost_patches == 0


def test_a_late_survey_that_is_refused_lays_no_patch_twice():
    waiting = late("taken")
    waiting.put_patch("waits", Moment(2, 0))
    waiting.put_whole("bad", Moment(0))
    waiting.take()
    waiting.refused()
    assert waiting.take() == ("patch", "waits")
    assert len(waiting) == 0 and waiting.lost_patches == 0


def test_patches_that_are_kept_no_longer_are_lost_of_a_survey_that_they_follow(monkeypatch):
    waiting = late("one", "two", "three", most=2)
    waiting.put_whole("late", Moment(0))
    assert laid(waiting) == ["late", "two", "three"]
    assert waiting.lost_patches == 1
    monkeypatch.setattr(waiting_terrain, "LATE", 0.0)
    waiting.put_whole("later", Moment(1))
    assert laid(waiting) == ["later"]
    assert waiting.lost_patches == 2
    waiting.put_whole("after all of them", Moment(4))
    assert laid(waiting) == ["after all of them"]
    assert waiting.lost_patches == 0


def test_a_late_survey_that_is_refused_lacks_nothing(monkeypatch):
    waiting = late("laid upon the terrain before")
    monkeypatch.setattr(waiting_terrain, "LATE", 0.0)
    waiting.put_whole("bad", Moment(0))
    waiting.take()
    waiting.refused()
    assert waiting.lost_patches == 0 and len(waiting) == 0


def test_surveys_are_told_apart_where_the_middleware_tells_no_time():
    waiting = late()
    for survey in ("one", "other"):
        waiting.put_whole(survey, Moment(0))
        assert laid(waiting) == [survey]


def test_a_patch_that_is_too_old_to_be_laid_again_is_not_kept(monkeypatch):
    waiting = late("old")
    monkeypatch.setattr(waiting_terrain, "LATE", 0.0)
    waiting.drop_old_patches()
    assert [each.patch for each in waiting._received] == [None]


def test_a_survey_that_is_in_use_and_comes_again_is_none():
    waiting = late()
    waiting.put_whole("mesh", Moment(1))
    assert laid(waiting) == ["mesh"]
    waiting.put_patch("patch", Moment(2, 0))
    waiting.put_whole("mesh, latched", Moment(1))
    assert waiting.take() == ("patch", "patch")
    assert len(waiting) == 0


@pytest.mark.parametrize("is_clock_back", [True, False])
def test_patches_received_before_a_pause_are_not_applied_again_but_an_earlier_survey_lacks_them(is_clock_back):
    waiting = late("early")
    waiting.forget_received()
    if is_clock_back:
        waiting.clock_went_back(0)
    waiting.put_whole("late", Moment(0))
    assert laid(waiting) == ["late"]
    assert waiting.lost_patches == 1
    waiting.put_whole("later", Moment(5))
    assert laid(waiting) == ["later"]
    assert waiting.lost_patches == 0


def test_a_survey_that_was_measured_before_a_patch_lacks_it_after_a_pause_though_it_is_published_later():
    waiting = WaitingTerrain(5)
    waiting.put_patch("patch", Moment(1, 50))
    waiting.take()
    waiting.forget_received()
    for stamp, missing in ((40, 1), (60, 0)):
        waiting.put_whole("whole", Moment(stamp, stamp))
        assert laid(waiting) == ["whole"]
        assert waiting.lost_patches == missing


@pytest.mark.parametrize("is_forgotten_first", [True, False])
@pytest.mark.parametrize("kind", ["received", "restored", "refused"])
def test_after_the_clock_went_back_a_survey_from_before_the_step_still_lacks_a_patch(is_forgotten_first, kind):
    waiting = WaitingTerrain(5)
    if kind == "received":
        waiting.put_patch("patch", Moment(1, 50))
        waiting.take()
    elif kind == "restored":
        waiting.holds((1,), (50,))
    else:
        waiting.refuse("whole", 1, "in a foreign frame", stamp_ns=50)
    steps = [waiting.forget_received, lambda: waiting.clock_went_back(45)]
    for step in steps if is_forgotten_first else reversed(steps):
        step()
    for published, stamp, faults in ((2, 44, 1), (3, 46, 0)):
        waiting.put_whole("whole", Moment(published, stamp))
        assert laid(waiting) == ["whole"]
        assert waiting.lost_patches + waiting.refused_surveys == faults


def test_a_survey_that_was_measured_before_what_was_lost_or_restored_lacks_it_though_it_is_published_later():
    waiting = WaitingTerrain(5)
    waiting.lacks(patches=1, why_refused="", known_ns=20, stamp_ns=50)
    waiting.holds((10, 11), (48, 50))
    for published, stamp, missing in ((30, 47, 3), (31, 49, 2), (32, 51, 0)):
        waiting.put_whole("whole", Moment(published, stamp))
        assert laid(waiting) == ["whole"]
        assert waiting.lost_patches == missing


@pytest.mark.parametrize("kind", ["whole", "patch"])
def test_a_survey_that_was_measured_before_what_was_refused_does_not_make_it_good(kind):
    waiting = WaitingTerrain(5)
    waiting.refuse(kind, 20, "in a foreign frame", stamp_ns=200)
    for published, stamp, faults in ((30, 100, 1), (40, 300, 0)):
        waiting.put_whole("whole", Moment(published, stamp))
        assert laid(waiting) == ["whole"]
        assert waiting.lost_patches + waiting.refused_surveys == faults


def test_a_latched_survey_that_another_has_replaced_is_ignored_when_it_comes_again():
    waiting = surveys()
    for published in (1, 2):
        waiting.put_whole("survey", Moment(published))
        assert laid(waiting) == ["survey"]
    for published in (2, 1):
        waiting.put_whole("survey, latched", Moment(published))
    assert len(waiting) == 0


def test_a_latched_survey_that_comes_again_after_a_restart_lacks_the_patches_that_the_terrain_had():
    waiting = WaitingTerrain(5)
    waiting.holds((20, 30))
    waiting.forget_received()  # the node is deactivated and activated before the survey arrives
    for published, missing in ((10, 2), (25, 1), (40, 0)):
        waiting.put_whole("latched", Moment(published))
        waiting.take()
        waiting.accepted()
        assert waiting.lost_patches == missing


def test_a_survey_from_before_a_restart_makes_good_nothing_that_was_lost_before_it():
    waiting = WaitingTerrain(5)
    waiting.lacks(patches=1, why_refused="in a foreign frame", known_ns=20)
    for published, lacking in ((10, (1, "in a foreign frame")), (30, (0, ""))):
        waiting.put_whole("latched", Moment(published))
        waiting.take()
        waiting.accepted()
        assert (waiting.lost_patches, waiting.why_refused) == lacking


def test_who_waits_is_let_go_when_it_is_closed():
    waiting, found = surveys(), []
    thread = threading.Thread(target=lambda: found.append(waiting.take()))
    thread.start()
    waiting.close()
    thread.join(60.0)
    assert found == [None]


def test_a_survey_that_is_refused_is_told_of_until_a_later_one_is_the_terrain():
    waiting = WaitingTerrain(5)
    waiting.refuse("whole", 10)
    waiting.put_whole("unfit", Moment(20))
    assert waiting.take() == ("whole", "unfit")
    waiting.refused()
    assert waiting.refused_surveys == 2
    waiting.put_whole("good", Moment(30))
    waiting.refuse("whole", 40)
    assert waiting.take() == ("whole", "good") and waiting.refused_surveys == 3
    waiting.accepted()
    assert waiting.refused_surveys == 1, "the last was refused after it"
    waiting.put_whole("better", Moment(50))
    waiting.take()
    waiting.accepted()
    assert waiting.refused_surveys == 0


def test_a_survey_that_arrives_late_ends_no_refusal_of_what_was_published_after_it():
    waiting = WaitingTerrain(5)
    waiting.refuse("whole", 20)
    waiting.refuse("patch", 20)
    waiting.put_whole("late", Moment(10))
    waiting.take()
    waiting.accepted()
    assert (waiting.refused_surveys, waiting.lost_patches) == (1, 1)


def test_a_patch_that_is_refused_is_missing_until_the_next_whole_survey():
    waiting = WaitingTerrain(5)
    waiting.refuse("patch", 20)
    waiting.put_patch("another", Moment(30))
    assert waiting.take() == ("patch", "another") and waiting.lost_patches == 1
    waiting.put_whole("new", Moment(40))
    waiting.take()
    waiting.accepted()
    assert waiting.lost_patches == 0


def test_a_waiting_survey_with_the_stamp_of_the_one_in_use_is_compared_with_it():
    waiting = WaitingTerrain(8)
    for number, (survey, stamp) in enumerate((("older", 4), ("first", 5), ("second", 5)), 1):
        waiting.put_whole(survey, Moment(number, stamp))
    assert waiting.take() == ("whole", "second")
    waiting.put_patch("patch")
    waiting.accepted()
    assert waiting.take() == ("whole", "first")
    waiting.refused("it contradicts")
    assert waiting.why_refused == "it contradicts" and waiting.take() == ("patch", "patch")
    waiting.put_whole("later", Moment(4, 6))
    waiting.take()
    waiting.accepted()
    assert not waiting.why_refused and len(waiting) == 0


@pytest.mark.parametrize("waits", [False, True], ids=["refused before", "still waiting"])
def test_a_survey_that_is_built_again_gets_the_later_patches_once_and_lacks_none_of_them(waits):
    """After a restart without a store: a patch arrives before the latched survey that it belongs on top of."""
    waiting = WaitingTerrain(8)
    waiting.put_patch("p", Moment(20))
    if not waits:
        assert waiting.take() == ("patch", "p")
        waiting.lost()  # there is no terrain yet
        assert waiting.lost_patches == 1
    waiting.put_whole("a", Moment(10))
    assert waiting.take() == ("whole", "a")
    waiting.repeated(is_rebuilt=True)
    assert waiting.take() == ("patch", "p")
    assert (len(waiting), waiting.lost_patches) == (0, 0)


def test_a_survey_that_is_built_again_lacks_the_patches_that_are_no_longer_kept():
    waiting = WaitingTerrain(8)
    waiting.holds([20])  # a patch from before a restart
    waiting.put_whole("a", Moment(10))
    waiting.take()
    waiting.repeated(is_rebuilt=True)
    assert waiting.lost_patches == 1
