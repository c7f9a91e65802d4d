"""The requests to the alert desk, the thread that decides on alerts: new evidence, faults and acknowledgements."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Acknowledgement

Reply = Callable[[tuple[bool, str]], None]


@dataclass(frozen=True)
class Request:
    """A request to the alert desk: new evidence, a reason to forget evidence, or an acknowledgement.

    region : the region of the evidence; evidence : new evidence, or None; topic : topic of the evidence's sources
    faults : the reason why the state is unknown; all evidence is then forgotten, and every topic must publish again.
        "" if there is no such reason
    is_error : True if the reason is an error of the program; then a message counts only if its stamp is later than the
        last stamp of its topic before the error
    acknowledged : an acknowledgement, whose name and reason are not checked yet
    shown : the faults that were shown when the acknowledgement was given, except the fault that the acknowledgement
        may end
    reply : called with True and a sentence if the request succeeded, or with False and the reason
    is_changed : True to decide again because standing faults or lost messages have changed
    is_moved : True to decide again on the evidence, if there is any, because an outline or the terrain has changed
    """

    region: Hashable = None
    evidence: Evidence | None = None
    topic: str = ""
    faults: str = ""
    is_error: bool = False
    acknowledged: Acknowledgement | None = None
    shown: tuple[str, ...] = ()
    reply: Reply | None = None
    is_changed: bool = False
    is_moved: bool = False

    @property
    def decides(self) -> bool:
        """True if the request asks for a decision with all evidence, standing faults and lost messages.

        An acknowledgement does not count, because an acknowledgement without a name is refused without a decision.
        """
        return self.evidence is not None or bool(self.faults) or self.is_changed

    def is_covered_by(self, later: "Request") -> bool:
        """True if this request can be skipped, because the decision on a later request covers it.

        The outline of a moving machine changes often. Without skipping, new evidence would have to wait for a decision
        on each change.
        """
        return (self in (TICK, CHANGED, MOVED) and later.decides) or (self in (TICK, MOVED) and later.is_moved)

    @property
    def is_unanswered(self) -> bool:
        """True if the request has evidence without areas, which raises no level.

        Usually the sources got no answer, and the evidence is only a fault.
        """
        return self.evidence is not None and not self.evidence.areas


CHANGED = Request(is_changed=True)
"""A request to decide again, because the standing faults have changed, or messages were lost."""

MOVED = Request(is_moved=True)
"""A request to decide again on the evidence, because the outline of an area or the terrain has changed."""

TICK = Request()
"""A request without new evidence: the alert desk only checks whether the validity of the last decision ends soon."""

CLOSING = None
"""Value in place of a request, which ends the thread of the alert desk."""
