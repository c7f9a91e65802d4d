"""Tests of which sources wait, in which order, and which are dropped."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.engine.waiting_sources import WaitingSources

SIZE = 50.0
"""Side (m) of a region."""


def at(x, y, stamp):
    return trigger_of(np.array([[x, y, 0.0]]), np.zeros((1, 3)), None, stamp)


def taken(waiting):
    return [trigger.stamp_ns for trigger in iter(waiting.take, None)]


def test_a_newer_message_takes_the_place_of_one_from_the_same_wall():
    waiting = WaitingSources(SIZE, 10)
    for stamp in range(5):
        waiting.put(at(10.0, 10.0, stamp))
    assert len(waiting) == 1 and waiting.dropped == 4
    assert taken(waiting) == [4]


def test_a_flood_from_one_wall_pushes_out_nothing_of_another():
    waiting = WaitingSources(SIZE, 10)
    waiting.put(at(10.0, 10.0, 1))
    for stamp in range(2, 10_000):
        waiting.put(at(500.0, 500.0, stamp))
    assert taken(waiting) == [9_999, 1]
    assert waiting.dropped == 9_997


def test_walls_take_turns_while_a_flood_goes_on():
    waiting, answered = WaitingSources(SIZE, 10), []
    waiting.put(at(10.0, 10.0, 1))
    for stamp in range(2, 6):
        waiting.put(at(500.0, 500.0, stamp))
        answered.append(waiting.take().stamp_ns)
    assert 1 in answered[:2]


def test_so_many_walls_wait_and_no_more_and_the_oldest_is_dropped():
    waiting = WaitingSources(SIZE, 3)
    pushed_out = [waiting.put(at(1000.0 * stamp, 0.0, stamp)) for stamp in range(6)]
    assert sorted(taken(waiting)) == [3, 4, 5]
    assert waiting.dropped == 3
    assert [trigger and trigger.stamp_ns for trigger in pushed_out] == [None, None, None, 0, 1, 2]


def test_a_message_that_a_newer_one_of_its_wall_replaces_is_not_one_without_an_answer():
    waiting = WaitingSources(SIZE, 3)
    assert [waiting.put(at(10.0, 0.0, stamp)) for stamp in range(6)] == [None] * 6
    assert waiting.dropped == 5


def test_nothing_seen_on_one_topic_does_not_replace_that_on_another():
    waiting = WaitingSources(SIZE, 3)
    for stamp, topic in enumerate(("sources", "source_cloud")):
        waiting.put(trigger_of(np.empty((0, 3)), np.empty((0, 3)), None, stamp, topic))
    assert sorted(taken(waiting)) == [0, 1]


def test_messages_of_nobody_are_a_region_of_their_own():
    waiting = WaitingSources(SIZE, 10)
    waiting.put(trigger_of(np.empty((0, 3)), np.empty((0, 3)), None, 1))
    waiting.put(at(1.0, 1.0, 2))
    assert sorted(taken(waiting)) == [1, 2]


def test_what_is_remembered_of_walls_is_bounded():
    waiting = WaitingSources(SIZE, 3)
    for stamp in range(1000):
        waiting.put(at(1000.0 * stamp, 0.0, stamp))
        waiting.take()
    assert len(waiting._served) <= 6


def test_a_click_takes_the_place_of_no_source_of_the_monitoring():
    waiting, none = WaitingSources(SIZE, 10), np.zeros((1, 3))
    waiting.put(trigger_of(none, none, None, 1, "sources"))
    waiting.put(trigger_of(none, none, None, 2, "clicked_point"))
    assert sorted(taken(waiting)) == [1, 2] and waiting.dropped == 0


def test_a_click_beside_another_takes_the_place_of_none():
    waiting = WaitingSources(SIZE, 10)
    for stamp, x in enumerate((1.0, 3.0, 3.0), start=1):
        waiting.put(trigger_of(np.array([[x, 1.0, 1.0]]), np.zeros((1, 3)), None, stamp, "clicked_point"))
    assert sorted(taken(waiting)) == [1, 3]


def among(places, stamp):
    positions = np.array([[x, y, 0.0] for x, y in places])
    return trigger_of(positions, np.zeros_like(positions), None, stamp)


WIDE = [(-30.0, -40.0), (90.0, 50.0)]
"""Places (m) of sources in two squares; the point midway between them lies in a third square."""


def test_a_message_replaces_no_source_in_a_square_that_it_has_no_source_in():
    """Otherwise a harmless source in the middle of two others would hide a dangerous one."""
    waiting = WaitingSources(SIZE, 10)
    waiting.put(among(WIDE, 1))
    waiting.put(at(30.0, 10.0, 2))
    waiting.put(among(WIDE[1:], 3))
    assert sorted(taken(waiting)) == [1, 2, 3] and waiting.dropped == 0
    assert waiting.region_of(among(WIDE, 1)) != waiting.region_of(at(30.0, 10.0, 2))


def test_a_message_replaces_all_messages_whose_squares_it_has_sources_in():
    waiting = WaitingSources(SIZE, 10)
    for stamp, place in enumerate(WIDE):
        waiting.put(at(*place, stamp))
    waiting.put(among([*WIDE, (300.0, 0.0)], 2))
    assert taken(waiting) == [2] and waiting.dropped == 2


def test_walls_take_turns_while_the_squares_of_a_flood_change():
    """Each message of the flood covers other squares, but none of them has waited longer than the wall's square."""
    waiting, answered = WaitingSources(SIZE, 10), []
    waiting.put(at(1000.0, 0.0, 0))
    waiting.put(at(0.0, 0.0, 1))
    answered += taken(waiting)
    waiting.put(at(1000.0, 0.0, 2))
    for stamp in range(3, 11):
        squares = [square for square in range(3) if (stamp - 3) >> square & 1 == 0] or [0]
        waiting.put(among([(SIZE * square + 1.0, 0.0) for square in squares], stamp))
        answered.append(waiting.take().stamp_ns)
    assert 2 in answered[:5]
