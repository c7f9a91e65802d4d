"""Send the view to the browser, one state after another, so that the browser cannot mix two states."""

import asyncio
from collections.abc import Callable

LONGEST = 10.0
"""Longest time (s) to wait until the browser has drawn a state; then the next state is sent."""


class Sender:
    """Sends the states of the view to the browser; waits after each one until the browser has drawn it.

    The browser keeps the arrays of former states. It uses those at once, but must fetch all others. So if two states
    were under way, the browser could draw the older one last, and colours of one hazard map would stay under the
    legend of another.
    """

    def __init__(self, send: Callable[[], None], do: Callable[[Callable[[], None]], None]) -> None:
        """Wait for the first state.

        send : function that sends the present state of the view
        do : calls the function that it is given, and then sends changed values of the page to the browser
        """
        self._send, self._do = send, do
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waiting: asyncio.TimerHandle | None = None
        self._has_changed = False

    def connected(self, loop: asyncio.AbstractEventLoop) -> None:
        """Count the time with an event loop from now on; call this when browsers can connect."""
        self._loop = loop

    def update(self) -> None:
        """Send the present state of the view: now, or when the browser has drawn the state before."""
        self._has_changed = self._waiting is not None
        if self._has_changed:
            return
        self._send()
        if self._loop is not None:  # otherwise nothing was sent: a browser receives the whole state when it connects
            self._waiting = self._loop.call_later(LONGEST, self._do, self.drawn)

    def drawn(self) -> None:
        """Send the view again if it has changed; call this when the browser has drawn the state that was sent last."""
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None
        if self._has_changed:
            self.update()
