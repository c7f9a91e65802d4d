"""Tests that gaps in the message numbers of a publisher are counted as lost messages."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.engine.message_gaps import MessageGaps, Numbered

DEPTH = 3
NOW = 1_000


def lost(gaps, *numbers, received=NOW, publisher="", there=1):
    """Return, for each message number, how many messages `gaps` reports as lost before it.

    received : time (ns) of arrival; publisher : identity, "" if unknown; there : number of publishers of the topic
    """
    return [gaps.lost_before(Numbered(number, received, publisher), NOW, lambda: there) for number in numbers]


def test_messages_that_were_overwritten_are_counted_when_the_next_is_read():
    gaps = MessageGaps(DEPTH)
    assert lost(gaps, 1, 2, 11, 12, 14) == [0, 0, 8, 0, 1]


def test_a_new_publisher_begins_again_and_loses_nothing():
    gaps = MessageGaps(100)
    assert lost(gaps, 7, 8, 1, 2, 2, 3) == [0] * 6


def test_publishers_are_counted_apart():
    gaps = MessageGaps(DEPTH)
    assert lost(gaps, 1, publisher="a") + lost(gaps, 1, 2, publisher="b") + lost(gaps, 2, publisher="a") == [0] * 4
    assert lost(gaps, 5, publisher="b") + lost(gaps, 3, publisher="a") == [2, 0]


def test_of_publishers_that_cannot_be_distinguished_each_counts_by_itself():
    """Such publishers exist while a driver is restarted and its old process still publishes."""
    gaps = MessageGaps(100)
    assert lost(gaps, 500) + lost(gaps, 1, 501, 2, 502, 3, 4, 503, there=2) == [0] * 8
    assert lost(gaps, 505, 7, 506, 8, there=2) == [1, 2, 0, 0], "a loss of either is noticed"
    assert lost(gaps, 9, 10) == [0, 0]
    assert lost(gaps, 507) == [496], "the former one has gone: no message continues its number"


def test_a_loss_is_noticed_although_it_seems_to_continue_a_publisher_that_has_gone():
    gaps = MessageGaps(100)
    assert lost(gaps, 1, 2, 3) + lost(gaps, 1, 2, there=2) == [0] * 5
    assert lost(gaps, 4) == [1], "3 was lost; the former publisher had come to 3, too"


def test_the_last_message_of_a_publisher_that_has_gone_counts_as_a_loss():
    """Such a message cannot be distinguished from a loss: see the previous test."""
    gaps = MessageGaps(100)
    assert lost(gaps, 500) + lost(gaps, 1, there=2) + lost(gaps, 501) == [0, 0, 499]


def test_a_third_start_forgets_the_publisher_that_was_silent_for_longest():
    gaps = MessageGaps(100)
    assert lost(gaps, 500) + lost(gaps, 1, 2, 1, 3, 2, there=2) == [0] * 6
    assert lost(gaps, 501, there=2) == [497]


def test_a_first_message_behind_a_full_queue_has_lost_others_before_it():
    """The message number alone shows no loss, because the node may have subscribed after the earlier messages."""
    assert lost(MessageGaps(DEPTH), 9, 10, 11, 12) == [0, 0, 1, 0]
    assert lost(MessageGaps(DEPTH), 1, 2, 3, 4) == [0] * 4, "none was before it"
    gaps = MessageGaps(DEPTH)
    assert lost(gaps, 9, 10) + lost(gaps, 11, 12, received=NOW + 1) == [0] * 4, "the queue had room"
    assert lost(MessageGaps(0), *range(9, 99)) == [0] * 90, "nothing is overwritten in this queue"


def test_without_numbers_nothing_is_known():
    assert lost(MessageGaps(DEPTH), None, None) == [0, 0]
