"""Standing faults of the alert: faults that last until their cause has ended, independent of the evidence."""

import threading
from collections.abc import Callable


class StandingFaults:
    """The current standing faults: one sentence for each cause. Any thread may call.

    changed : called after each change of the faults
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._sentences: dict[str, str] = {}
        self._lock = threading.Lock()

    def report(self, cause: str, sentence: str) -> None:
        """Set the standing fault of a cause; the fault stays until another sentence is reported for this cause.

        cause : name of the cause, such as "patches"
        sentence : describes the fault in alerts; "" ends the fault. If the cause has this sentence already, nothing
            changes
        """
        with self._lock:
            if self._sentences.get(cause, "") == sentence:
                return
            others = {each: other for each, other in self._sentences.items() if each != cause}
            self._sentences = {**others, cause: sentence} if sentence else others
        self._changed()

    def settle(self, cause: str) -> None:
        """End the standing fault of a cause; do nothing if the cause has none."""
        self.report(cause, "")

    @property
    def sentences(self) -> tuple[str, ...]:
        """The sentences of all faults, in the order in which they were set; a changed sentence moves to the end."""
        return tuple(self._sentences.values())
