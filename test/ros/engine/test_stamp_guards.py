"""Tests of which message stamps are refused."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.engine.stamp_guards import StampGuards
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.stamps import SECOND

NOW, AHEAD = 1000 * SECOND, 2.0
"""The present time (ns), and how far (s) stamps may be ahead of it."""


def test_a_stamp_that_goes_back_is_refused_for_its_topic_alone():
    guards = StampGuards(AHEAD)
    guards.note("sources", 10 * SECOND)
    guards.check("sources", 10 * SECOND, NOW)
    guards.check("source_cloud", 1, NOW)
    with pytest.raises(MessageRefused, match=r"is 2\.500 s older than the last message on sources"):
        guards.check("sources", int(7.5 * SECOND), NOW)
    guards.note("sources", 1)
    with pytest.raises(MessageRefused):
        guards.check("sources", 9 * SECOND, NOW)


def test_a_negative_stamp_is_refused_also_before_the_clock_runs():
    """Otherwise the topic would neither have fresh sources nor count as silent."""
    for now in (0, NOW):
        with pytest.raises(MessageRefused, match=r"its stamp is negative, -1\.000 s"):
            StampGuards(AHEAD).check("sources", -SECOND, now)


def test_after_the_clock_went_back_stamps_from_after_the_step_are_accepted_and_older_ones_refused():
    guards = StampGuards(AHEAD)
    guards.note("areas/polygon", NOW)
    guards.note("terrain/update", NOW - 5 * SECOND)
    guards.clock_went_back(NOW - SECOND)
    guards.check("areas/polygon", NOW - SECOND, NOW)
    guards.check("terrain/update", NOW - 5 * SECOND, NOW)
    for topic, stamp in (("areas/polygon", NOW - SECOND - 1), ("terrain/update", NOW - 5 * SECOND - 1)):
        with pytest.raises(MessageRefused):
            guards.check(topic, stamp, NOW)


def test_after_a_restart_older_stamps_are_refused_also_if_the_clock_went_back_meanwhile():
    guards = StampGuards(AHEAD)
    guards.continue_from({"areas/polygon": NOW + 60 * SECOND, "terrain/update": NOW - 5 * SECOND})
    guards.continue_from({"terrain/update": NOW - 9 * SECOND})
    with pytest.raises(MessageRefused):
        guards.check("areas/polygon", NOW - 1, 0)
    for topic, stamp in (("areas/polygon", NOW), ("terrain/update", NOW - 5 * SECOND)):
        with pytest.raises(MessageRefused):
            guards.check(topic, stamp - 1, NOW)
        guards.check(topic, stamp, NOW)


def test_a_stamp_from_the_future_is_refused_unless_it_is_little_or_the_clock_has_not_begun():
    guards = StampGuards(AHEAD)
    guards.check("sources", NOW + 2 * SECOND, NOW)
    with pytest.raises(MessageRefused, match=r"in the future, 2\.500 s ahead of this clock; at most 2 s are allowed"):
        guards.check("sources", NOW + 5 * SECOND // 2, NOW)
    guards.check("sources", NOW, 0)
