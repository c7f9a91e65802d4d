"""Tests of the sender of the view: one state under way, the last state always sent, no wait for ever."""

import asyncio
from collections.abc import Callable

from rpf3d_core.desk import sending
from rpf3d_core.desk.sending import Sender


class Timer:
    """Stands in for an event loop with one timer, which the test lets expire."""

    def __init__(self) -> None:
        self.due: Callable[[], None] | None = None

    def call_later(self, seconds: float, do: Callable[..., None], work: Callable[[], None]) -> "Timer":
        assert seconds == sending.LONGEST and self.due is None, "two states are under way"
        self.due = lambda: do(work)
        return self

    def cancel(self) -> None:
        self.due = None


def at_once(work: Callable[[], None]) -> None:
    work()


def sender_to_a_browser() -> tuple[Sender, list[str], Timer, Callable[[str], None]]:
    """Return a sender, the list of what it sends, its timer, and a function that shows a text.

    The states have the numbers 10, 20 and so on.
    """
    state, sent, timer = [""], [], Timer()

    def send() -> int:
        sent.append(state[0])
        return 10 * len(sent)

    sender = Sender(send, at_once)
    sender.connected(timer)  # type: ignore[arg-type]

    def show(text: str) -> None:
        state[0] = text
        sender.update()

    return sender, sent, timer, show


def test_a_state_waits_until_the_browser_has_drawn_the_one_before() -> None:
    sender, sent, timer, show = sender_to_a_browser()
    show("a")
    show("b")
    show("c")
    assert sent == ["a"]
    sender.drawn(11)
    assert sent == ["a", "c"]
    sender.drawn(21)
    assert sent == ["a", "c"] and timer.due is None
    show("d")
    assert sent == ["a", "c", "d"]


def test_a_second_report_of_a_state_does_not_end_the_wait_for_the_next_state() -> None:
    """The browser reports a state twice if its page is loaded while the state is under way."""
    sender, sent, timer, show = sender_to_a_browser()
    show("a")
    show("b")
    sender.drawn(11)
    sender.drawn(12)
    show("c")
    assert sent == ["a", "b"] and timer.due is not None
    sender.drawn(21)
    assert sent == ["a", "b", "c"]


def test_without_a_report_of_the_browser_the_last_state_is_sent_after_some_seconds() -> None:
    _, sent, timer, show = sender_to_a_browser()
    show("a")
    show("b")
    assert timer.due is not None
    timer.due()
    assert sent == ["a", "b"]
    timer.due()
    show("c")
    assert sent == ["a", "b", "c"]


def test_states_before_a_browser_can_connect_do_not_wait() -> None:
    sent: list[int] = []

    def send() -> int:
        sent.append(len(sent))
        return len(sent)

    sender = Sender(send, at_once)
    sender.update()
    sender.update()
    loop = asyncio.new_event_loop()
    sender.connected(loop)
    sender.update()
    sender.update()
    loop.close()
    assert sent == [0, 1, 2]
