"""Tests of which triggers are kept, to be answered again when the terrain or an area changes."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.live_ground import over_the_wall

from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.alerts.source_topics import BY_HAND
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.messages.stamps import SECOND


def stamped(*seconds, topic="sources"):
    return [over_the_wall(1, stamp_ns=each * SECOND, topic=topic) for each in seconds]


def nobody(second, topic="sources"):
    return trigger_of(np.empty((0, 3)), np.empty((0, 3)), None, second * SECOND, topic)


def test_the_last_of_each_region_is_kept_and_no_more_of_them_than_may_be():
    answered, given = AnsweredSources(30.0, 2), stamped(1, 2, 3, 4)
    for region, trigger in zip("aabc", given, strict=True):
        answered.note(region, trigger)
    assert answered.others(given[3]) == [given[2]]
    assert not answered.holds(given[1])


def test_what_is_too_old_is_not_answered_anew():
    answered, (old, new) = AnsweredSources(30.0, 5), stamped(1, 32)
    answered.note("a", old)
    answered.note("b", new)
    assert answered.others(new) == []


def test_nothing_seen_clears_all_that_is_not_newer():
    answered, (old, new) = AnsweredSources(30.0, 5), stamped(1, 3)
    answered.note("a", old)
    answered.note("b", new)
    answered.note("nobody", nobody(2))
    assert not answered.holds(old) and answered.holds(new)


def test_nothing_seen_by_one_radar_clears_neither_what_another_sees_nor_what_was_clicked():
    answered, (seen,), (clicked,) = AnsweredSources(30.0, 5), stamped(1), stamped(1, topic=BY_HAND)
    answered.note("a", seen)
    answered.note("b", clicked)
    answered.note("nobody", nobody(2, "source_cloud"))
    assert answered.holds(seen) and answered.holds(clicked)
