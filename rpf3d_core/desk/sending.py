"""Send the view to the browser, one state after another, so that the browser cannot mix two states."""

import asyncio
from collections.abc import Callable

LONGEST = 10.0
"""Longest time (s) to wait until the browser has drawn a state; then the next state is sent."""


class Sender:
    """Sends the states of the view to the browser; waits after each one until the browser has drawn it.

    The browser keeps the arrays of former states. It uses those at once, but must fetch all others. So if two states
    were under way, the browser could draw the older one last, and colours of one hazard map would stay under the
    legend of another. This can still happen if a state takes the browser longer than LONGEST, or if a user has the page
    open twice, because the first of two browsers to draw a state ends the wait.
    """

    def __init__(self, send: Callable[[], int], do: Callable[[Callable[[], None]], None]) -> None:
        """Wait for the first state.

        send : sends the present state of the view, and returns its number, which is larger than all before
        do : calls the function that it is given, and then sends changed values of the page to the browser
        """
        self._send, self._do = send, do
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waiting: asyncio.TimerHandle | None = None
        self._has_changed = False
        self._sent = 0

    def connected(self, loop: asyncio.AbstractEventLoop) -> None:
        """Count the time with an event loop from now on; call this when browsers can connect."""
        self._loop = loop

    def update(self) -> None:
        """Send the present state of the view: now, or when the wait for the state before has ended."""
        self._has_changed = self._waiting is not None
        if self._has_changed:
            return
        self._sent = self._send()
        if self._loop is not None:  # otherwise nothing was sent: a browser receives the whole state when it connects
            self._waiting = self._loop.call_later(LONGEST, self._do, self._end_wait)

    def drawn(self, number: float) -> None:
        """End the wait for the state that was sent last if the browser has drawn it; call this for each report.

        number : the browser reports more than the number of the state that it has drawn (`VtkWindow.next_number`), and
            reports states again when a page is loaded; reports of states before the last one are ignored
        """
        if number > self._sent:
            self._end_wait()

    def _end_wait(self) -> None:
        """End the wait for the state that was sent last; send the view again if it has changed since."""
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None
        if self._has_changed:
            self.update()
