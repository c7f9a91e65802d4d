"""Tests of messages that wait to be recorded: at most one per interval passes, and always the newest."""

from hypothesis import given
from hypothesis import strategies as st

from rpf3d_ros.recording.waiting import SETTLED, HeldLines, PacedMessages

INTERVAL = 10


def passed(paced, moments, looks=()):
    """Return the numbers of the messages that pass, in this order.

    moments : times at which messages 0, 1, ... arrive; looks : times at which `due` is called
    """
    found = []
    for at, number in sorted([*((at, None) for at in looks), *((at, n) for n, at in enumerate(moments))], key=str_last):
        reads = paced.due(at)
        if number is not None:
            reads += paced.take(at, lambda n=number: n)
        found += [read() for read in reads]
    return found + [read() for read in paced.rest()]


def str_last(item):
    """Return the sort key of (time, number or None): looks come before messages of the same time."""
    return item[0], item[1] is not None, item[1] or 0


def test_the_first_passes_at_once_then_the_newest_of_each_interval_and_the_last_at_the_end():
    assert passed(PacedMessages(INTERVAL), range(0, 34, 2)) == [0, 4, 9, 14, 16]


def test_without_an_interval_every_message_passes():
    assert passed(PacedMessages(0), range(5)) == [0, 1, 2, 3, 4]


def test_a_message_that_comes_alone_after_a_while_passes_at_once():
    paced = PacedMessages(INTERVAL)
    assert [len(paced.take(at, str)) for at in (0, 10, 19, 50)] == [1, 1, 0, 1]


def test_what_waits_passes_when_it_is_opened_and_so_does_the_next():
    paced = PacedMessages(INTERVAL)
    assert len(paced.take(0, str)) == 1
    assert paced.take(1, lambda: "waits") == []
    assert [read() for read in paced.open()] == ["waits"]
    assert len(paced.take(2, str)) == 1
    assert paced.take(3, str) == []


def test_a_clock_that_goes_back_stops_nothing():
    paced = PacedMessages(INTERVAL)
    assert [len(paced.take(at, str)) for at in (100, 40, 45, 50)] == [1, 1, 0, 1]


@given(
    st.lists(st.integers(0, 200), max_size=40).map(sorted),
    st.lists(st.integers(0, 200), max_size=40),
    st.lists(st.integers(0, 200), max_size=40),
)
def test_it_does_not_matter_how_often_one_looks(moments, some, others):
    assert passed(PacedMessages(INTERVAL), moments, some) == passed(PacedMessages(INTERVAL), moments, others)


@given(st.lists(st.integers(0, 1000), min_size=1, max_size=80).map(sorted))
def test_no_more_pass_than_the_intervals_allow_and_the_last_always(moments):
    found = passed(PacedMessages(INTERVAL), moments)
    assert found[-1] == len(moments) - 1
    assert len(found) <= 2 + (moments[-1] - moments[0]) // INTERVAL


def test_lines_wait_for_their_points_and_are_let_go_when_none_follow():
    held = HeldLines()
    assert held.take(0, lambda: "first") == []
    assert [read() for read in held.take(1, lambda: "second")] == ["first"]
    assert held.due(SETTLED) == []
    assert [read() for read in held.due(1 + SETTLED)] == ["second"]
    assert held.take(5, lambda: "third") == []
    held.drop()
    assert held.rest() == []
