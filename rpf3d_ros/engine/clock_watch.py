"""Detect that the node's clock stands still: without the time, the age of all evidence is unknown."""

STANDS = "the clock stands still, so the age of all evidence is unknown: start the publisher of /clock again"
"""Sentence of the fault that the node's clock stands still."""


class ClockWatch:
    """Detects that the node's clock stands still, by comparison with a steady clock."""

    def __init__(self, patience_s: float) -> None:
        """Begin without a time; patience_s : time (s) for which the clock may stand still."""
        self._patience = patience_s
        self._last: tuple[int, float] | None = None

    def stands(self, now_ns: int, steady_s: float) -> bool:
        """Return True if the node's clock has not changed for longer than `patience_s`; call this regularly.

        now_ns : time of the node's clock (ns), 0 before it runs: the result is then False
        steady_s : time of a steady clock (s)
        """
        if self._last is None or self._last[0] != now_ns:
            self._last = now_ns, steady_s
        return now_ns > 0 and steady_s - self._last[1] > self._patience
