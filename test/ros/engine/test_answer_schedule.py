"""Tests of the order in which triggers are answered again while areas change faster than the node answers."""

from dataclasses import replace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.live_ground import over_the_wall

from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.engine.answer_schedule import AnswerSchedule
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.waiting_sources import WaitingSources

WALLS = 5


@pytest.fixture
def schedule():
    """Return a schedule of five walls, each answered once; the last wall has the newest trigger."""
    made = AnswerSchedule(WaitingSources(50.0, 10), AnsweredSources(30.0, 40))
    for stamp in range(WALLS):
        here = over_the_wall(1, stamp_ns=stamp)
        made.submit(trigger_of(here.positions * (1.0 + 100.0 * stamp), here.velocities, None, stamp))
    answer(made, WALLS)
    return made


def answer(schedule, count, changes=False):
    """Answer the next `count` triggers; return their stamps. changes : whether an area moves before each answer."""
    stamps = []
    for _ in range(count):
        if changes:
            schedule.answer_again()
        trigger = schedule.next_trigger()
        stamps.append(trigger.stamp_ns)
        schedule.begin(trigger, can_answer=True)
        schedule.progress(trigger, complete=not changes)
    return stamps


def test_all_walls_take_turns_while_an_area_moves_faster_than_they_are_answered(schedule):
    """Otherwise the first wall would be answered again and again, and the newest trigger never."""
    stamps = answer(schedule, 3 * WALLS, changes=True)
    assert all(set(stamps[first : first + WALLS]) == set(range(WALLS)) for first in range(2 * WALLS + 1))


def test_after_the_last_change_every_wall_is_answered_the_newest_last(schedule):
    answer(schedule, 3, changes=True)
    schedule.answer_again()
    stamps = []
    while (trigger := schedule.next_trigger()) is not None:
        stamps.append(trigger.stamp_ns)
        schedule.begin(trigger, can_answer=True)
        schedule.progress(trigger, complete=True)
    assert set(stamps) == set(range(WALLS)) and stamps[-1] == WALLS - 1


def test_missing_places_are_answered_again_although_no_message_was_answered_yet():
    schedule = AnswerSchedule(WaitingSources(50.0, 10), AnsweredSources(30.0, 40))
    unreported = replace(over_the_wall(1), is_unreported=True)
    schedule.submit(unreported)
    assert schedule.next_trigger() is unreported
    schedule.finish()
    schedule.answer_again()
    assert schedule.next_trigger() is unreported and schedule.next_trigger() is None
