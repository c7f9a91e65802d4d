"""Decides on alerts and publishes them, on a thread of its own: each decision is on disk before anybody is told.

Where the log cannot be written the alert is published all the same, and the fault of the log with it. A disk that does
neither, and hangs, keeps the alert back; that is told, and the alarm sounded, after a second.
"""

import queue
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Acknowledgement, Alert, acknowledgement
from rpf3d_core.alerts.lines import Decision
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.log_files import NotLogged
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.errors import InputError
from rpf3d_core.live.evidence import together
from rpf3d_ros.engine.heard_topics import HeardTopics, is_cleared_by
from rpf3d_ros.engine.intake import SECOND
from rpf3d_ros.messages.refusals import report_error

Reply = Callable[[tuple[bool, str]], None]

FORGOTTEN = "a decision failed: what was heard before is not used"
"""Why nothing is known after an error."""

NO_CLOCK = "no /clock yet, or it stands at 0: nothing is decided before it runs"
"""Why there is no decision: it would be stamped 0, and say that a level is held since 1970."""

RENEWED_BEFORE = SECOND
"""ns before a decision ends in which the next is made, or half of the time for which it is valid, if that is less."""

LONGEST_WRITE = 1.0
"""Seconds that a decision may take to be on disk before the alarm is sounded without it."""

CLOSING = None
"""What ends the thread, where a piece of work is expected."""


class DecisionListener(Protocol):
    """Who is told of decisions, on the desk's thread."""

    def decided(self, alert: Alert, evidence: Evidence | None) -> None:
        """An alert is to be published."""

    def logged(self, fault: str) -> None:
        """The last decision is on disk ("") or why it is not."""

    def held_up(self, why: str) -> None:
        """No decision can be made, and why; for who is to be warned that is a fault. Empty once one can."""

    def unwritten(self) -> None:
        """A decision has been waiting for long to be written, and is not told before it is; once for each."""

    def undecided(self, error: BaseException) -> None:
        """A decision failed in a way that nobody has foreseen; the next tick decides again, without evidence."""


@dataclass(frozen=True)
class Request:
    """What makes the desk decide.

    evidence : of a region, or None; topic : that it was heard on
    faults : why nothing is known any more: all evidence is forgotten; deaf : and so is which topics have spoken
    acknowledged : who, why, and when (ns); reply : called with whether the level was lowered, or why not
    """

    region: Hashable = None
    evidence: Evidence | None = None
    topic: str = ""
    faults: str = ""
    deaf: bool = False
    acknowledged: tuple[str, str, int] | None = None
    reply: Reply | None = None


class TopicEvidence(NamedTuple):
    """Evidence, and the topic whose sources it is of."""

    topic: str
    evidence: Evidence

    @property
    def stamp_ns(self) -> int:
        """When its sources were seen."""
        return self.evidence.trigger_stamp_ns

    def with_faults_of(self, other: "TopicEvidence") -> "TopicEvidence":
        """This, and what is wrong by something else that is not kept, such as patches that are not in the terrain."""
        faults = tuple(dict.fromkeys((*self.evidence.faults, *other.evidence.faults)))
        return self._replace(evidence=self.evidence._replace(faults=faults))

    def clears(self, other: "TopicEvidence") -> bool:
        """Whether this, that nothing is seen, takes the place of something else that was told."""
        return other.stamp_ns <= self.stamp_ns and is_cleared_by(self.topic, other.topic)


TICK = Request()
"""Nothing new: time has gone by."""


class AlertDesk:
    """One thread that decides on evidence as it comes, and again before a decision ends.

    thresholds : the site's; log : of decisions, None where it could not be opened; now : the node's clock, ns
    """

    def __init__(
        self, thresholds: Thresholds, log: DecisionLog | None, now: Callable[[], int], listener: DecisionListener
    ) -> None:
        self._thresholds, self._log, self._now, self._listener = thresholds, log, now, listener
        self.alert: Alert | None = log.last_alert if log is not None else None
        self._evidence: dict[Hashable, TopicEvidence] = {}
        self._newest_at_ns = 0
        self._writing_since: float | None = None
        self._hanging_since: float | None = None
        self._topics = HeardTopics()
        self._requests: queue.SimpleQueue[Request | None] = queue.SimpleQueue()
        self._closed = self._failed = self._clock_ran = self._owed = False
        self._thread = threading.Thread(target=self._run, name="rpf3d alerts", daemon=True)
        self._thread.start()

    def report_error(self, region: Hashable, evidence: Evidence, topic: str) -> None:
        """Decide on new evidence of a region; that of no sources stands for all of them that its topic has told of."""
        self._requests.put(Request(region, evidence, topic))

    def forget(self, why: str, reply: Reply | None = None) -> None:
        """Nothing is known any more: decide on that, and say why, until there is new evidence.

        reply : called, on the desk's thread, once that has been told
        """
        self._requests.put(Request(faults=why, deaf=True, reply=reply))

    def lose(self, why: str) -> None:
        """What was heard is not known any more: as `forget`, but topics that fall silent are still told of."""
        self._requests.put(Request(faults=why))

    def acknowledge(self, by: str, why: str, reply: Reply) -> None:
        """Decide with an acknowledgement; `reply` is called, on the desk's thread, with what became of it."""
        self._requests.put(Request(acknowledged=(by, why, self._now()), reply=reply))

    def tick(self) -> None:
        """Decide again if the last decision is about to end, or failed; nothing where work waits already.

        Tells where a decision has been waiting for its log for long: a disk that hangs raises no error.
        """
        since = self._writing_since
        if since is not None and since != self._hanging_since and time.monotonic() - since > LONGEST_WRITE:
            self._hanging_since = since
            if self._writing_since == since:  # still
                self._listener.unwritten()
        if self._requests.empty() and (self._failed or self._is_over(self._now())):
            self._requests.put(Request(faults=FORGOTTEN) if self._failed else TICK)

    def close(self, timeout: float) -> bool:
        """Decide nothing further; wait at most timeout (s). True where the thread has ended, and the log is closed.

        The log is closed as soon as the thread ends, which may be after that.
        """
        self._closed = True
        self._requests.put(CLOSING)
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._serve_what_comes()
        finally:
            if self._log is not None:
                self._log.close()

    def _serve_what_comes(self) -> None:
        while (request := self._requests.get()) is not CLOSING and not self._closed:
            try:
                self._serve(request)
            except Exception as error:
                self._evidence.clear()
                self._failed = True
                report_error(self._listener.undecided, error)

    def _serve(self, request: Request) -> None:
        now, self._failed = self._now(), False
        if request.faults:
            self._evidence.clear()
            self._newest_at_ns = 0
        if request.deaf:
            self._topics.clear()
        if request.evidence is not None:
            self._topics.note(request.topic, request.evidence.trigger_stamp_ns, request.evidence.sources)
            self._take(request.region, TopicEvidence(request.topic, request.evidence))
        self._clock_ran = self._clock_ran or now > 0  # a clock that has gone back to 0 tells a time like any other
        if not self._clock_ran:
            self._wait_for_clock(request)
        elif request.acknowledged is not None:
            self._acknowledge(request, now)
        elif request.evidence is not None or request.faults or self._is_over(now):
            self._decide(now, None)
            if request.reply is not None:
                request.reply((True, request.faults))

    def _wait_for_clock(self, request: Request) -> None:
        """Keep what is told, and decide on it as soon as there is a time that a decision can be stamped with."""
        if not self._owed or request != TICK:
            self._listener.held_up(NO_CLOCK)
        self._owed = True
        if request.reply is not None:
            request.reply((request.acknowledged is None, NO_CLOCK))

    def _acknowledge(self, request: Request, now: int) -> None:
        """Decide with an acknowledgement; one that names nobody, or no reason, is only logged."""
        by, why, at = request.acknowledged or ("", "", now)
        try:
            given = acknowledgement(by, why, at)
        except InputError as refusal:
            said = (False, str(refusal))
            if self._log is not None:
                self._try_to_log(partial(self._log.refused, by, why, now, str(refusal)))
        else:
            alert = self._decide(now, given)
            said = (not alert.void, alert.void or f"the level is {alert.level.word}")
        if request.reply is not None:
            request.reply(said)

    def _decide(self, now: int, given: Acknowledgement | None) -> Alert:
        if self._owed:
            self._owed = False
            self._listener.held_up("")
        evidence = self._fresh(now)
        alert = decide(self.alert, evidence, self._thresholds, now, given)
        if self._log is not None:
            decision = Decision(self.alert, evidence, given, now, alert)
            self._try_to_log(partial(self._log.decided, decision, self._thresholds))
        self.alert = alert
        self._listener.decided(alert, evidence)
        return alert

    def _try_to_log(self, write: Callable[[], object]) -> None:
        self._writing_since = time.monotonic()
        try:
            write()
        except Exception as fault:  # whatever it is, the alert goes out
            said = str(fault) if isinstance(fault, NotLogged) else f"{type(fault).__name__}: {fault}"
            self._listener.logged(said)
        else:
            self._listener.logged("")
        finally:
            self._writing_since = None

    def _is_over(self, now: int) -> bool:
        """Whether it is time for another decision: it must be told before the last one says nothing any more.

        Where the evidence itself ends, so does every decision on it, and the fault that follows comes a tick later.
        """
        if self._owed or self.alert is None:
            return True
        early = min(RENEWED_BEFORE, (self.alert.valid_until_ns - self.alert.at_ns) // 2)
        return now >= self.alert.valid_until_ns - early or now < self.alert.at_ns

    def _take(self, region: Hashable, told: TopicEvidence) -> None:
        """Keep what is known of a region; who sees nothing clears what its topic told before, and nothing newer.

        Where others have told of sources, that nothing is seen is no evidence beside theirs, but for its faults.
        """
        known = self._evidence.get(region)
        if known is not None and told.stamp_ns < known.stamp_ns:
            return  # an answer to what the wall has said since is on its way, or there is none
        self._newest_at_ns = max(self._newest_at_ns, told.evidence.at_ns)
        seen = {each: one for each, one in self._evidence.items() if one.evidence.sources and each != region}
        if told.evidence.sources:
            self._evidence = {**seen, region: told}
        else:
            seen = {each: one.with_faults_of(told) for each, one in seen.items() if not told.clears(one)}
            self._evidence = seen or {region: told}

    def _fresh(self, now: int) -> Evidence | None:
        """The evidence of all regions that is not stale; where none is fresh, that of the newest sources.

        What is stale is left out, for the radar may have said since that rocks are elsewhere; where it has said nothing
        since, that is a fault.
        """
        if not self._evidence:
            return None
        oldest = now - int(self._thresholds.evidence.sources_max_age_s * SECOND)
        oldest = min(oldest, max(one.stamp_ns for one in self._evidence.values()))
        self._evidence = {each: one for each, one in self._evidence.items() if one.stamp_ns >= oldest}
        known = together([one.evidence for one in self._evidence.values()])
        faults = (*known.faults, *self._topics.silent(oldest, now))
        # What is newest may have gone since, cleared or stale: what remains is as new as the last that was heard.
        return known._replace(at_ns=max(known.at_ns, self._newest_at_ns), faults=faults)
