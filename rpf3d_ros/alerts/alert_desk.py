"""The alert desk decides on alerts on its own thread: each decision is on disk before its alert is published.

If the log cannot be written, the alert is published anyway, and the fault of the log is reported. A disk that hangs
without an error delays the alert; after a second the delay is reported and the alarm sounds.
"""

import contextlib
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Acknowledgement, Alert, acknowledgement
from rpf3d_core.alerts.lines import Decision
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.log_files import NotLogged
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.errors import InputError
from rpf3d_ros.alerts.alert_requests import CHANGED, CLOSING, MOVED, TICK, Reply, Request
from rpf3d_ros.alerts.first_scans import FirstScans
from rpf3d_ros.alerts.region_evidence import RegionEvidence
from rpf3d_ros.alerts.standing_faults import StandingFaults
from rpf3d_ros.alerts.unknown_before import UnknownBefore
from rpf3d_ros.alerts.unreported_evidence import UnreportedEvidence
from rpf3d_ros.messages.refusals import report_error
from rpf3d_ros.messages.stamps import SECOND

FORGOTTEN = "a decision failed: all sources received before are discarded"
"""Reason why the state of all walls counts as unknown after an unforeseen error."""

NO_CLOCK = "no time on /clock yet: no decision is made before the clock runs"
"""Reason why no decision is made before the clock runs: the decision would have a time in 1970."""

RENEWED_BEFORE = SECOND
"""Time (ns) before the end of a decision's validity at which the next decision is made.

If half of the validity is shorter than this time, the next decision is made after half of the validity.
"""

LONGEST_WRITE = 1.0
"""Longest time (s) that evidence may wait for its decision, and that all writes of one request may take.

After this time the alarm sounds, without the decision.
"""

MOST_UNDECIDED = 2
"""Number of answers that may wait for their decision, including the answer that is being decided on."""

MOST_WAITING = 10_000
"""Number of answers that may wait while the disk hangs; to limit memory, the messages of further answers count as lost.
"""


class DecisionListener(Protocol):
    """Receives each decision, and problems with decisions, from the thread of the alert desk."""

    def decided(self, alert: Alert, evidence: Evidence | None) -> None:
        """Publish the alert of a decision; evidence : the evidence of the decision, None if there is no answer."""

    def logged(self, fault: str) -> None:
        """Report whether the last decision, or refused acknowledgement, is on disk; fault : why not, "" if it is."""

    def remembered(self, fault: str) -> None:
        """Report whether the state that the next start needs was saved; fault : why it was not saved, "" if it was.

        The state describes what the node has received, such as refused messages, and the topics that have published.
        """

    def held_up(self, why: str) -> None:
        """Report why no decision can be made; why : the reason, "" as soon as decisions can be made again.

        For the subscribers of alerts, a missing decision is a fault.
        """

    def unwritten(self) -> None:
        """Report that evidence or a decision has waited longer than LONGEST_WRITE, for example for a slow disk.

        The decision is not published yet. The method is called once for each wait.
        """

    def undecided(self, error: BaseException) -> None:
        """Report that a decision failed with an unforeseen error; the next decision is made soon, without evidence."""


class AlertDesk:
    """Decides on the alert on its own thread: when evidence arrives, and again before the validity of a decision ends.

    The thread starts when the object is created.

    thresholds : thresholds of the site; log : the decision log, None if the log could not be opened
    now : returns the time of the node's clock (ns)
    alert : (attribute) the last decision, also one from before a restart; None if there is none
    listener : publishes the alerts, and receives the reports of problems
    standing : (attribute) the faults that every decision contains until their cause has ended
    unreported : (attribute) the answers to places that their topic no longer reports
    scans : (attribute) the first scan of each topic
    expected : topics of sources that must publish
    has_sensors : True if the node also has topics of sensors; False if its only topic of sources is `clicked_point`
    heard : topics of sources that had published before the start, and must publish again
    missed : time (ns) at which messages of a topic were lost before the start, by topic
    unknown : why it is unknown which level was held before the start, "" if it is known. An unknown level is a fault
        until persons acknowledge it
    remembered : returns the state to save for the next start, as plain values; the desk adds the topics of sensors that
        have published, and the lost messages
    """

    def __init__(
        self, thresholds: Thresholds, log: DecisionLog | None, now: Callable[[], int], listener: DecisionListener,
        expected: Sequence[str] = (), has_sensors: bool = False, heard: Sequence[str] = (), unknown: str = "",
        remembered: Callable[[], Mapping[str, Any]] = dict, missed: Mapping[str, int] | None = None,
    ) -> None:  # fmt: skip
        self._thresholds, self._log, self._now, self._listener = thresholds, log, now, listener
        self.alert: Alert | None = log.last_alert if log is not None else None
        self.unreported = UnreportedEvidence(thresholds, now, lambda: self._ask(CHANGED))
        terms = thresholds.evidence
        self.scans = FirstScans(terms.scan_period_s, terms.sources_max_age_s)
        self._evidence = RegionEvidence(terms, expected, has_sensors, heard, self.unreported, self.scans)
        self._missed = dict(missed or {})  # lost messages that the thread has not yet taken into account
        self._unknown, self._remembered = UnknownBefore(unknown, thresholds.acknowledge), remembered
        self._present: tuple[Mapping[str, str], str | None] = ({}, None)
        self._watching = threading.Lock()
        self._writing_since: float | None = None
        self._hanging_since: float | None = None
        self._requests: queue.SimpleQueue[Request | None] = queue.SimpleQueue()
        self._undecided: deque[float] = deque()  # when the evidence without a decision was received (s, steady clock)
        self._asked: list[Request] = []  # the waiting requests CHANGED and MOVED
        self._served = threading.Condition()
        self._closed = self._failed = self._clock_ran = self._owed = False
        self.standing = StandingFaults(lambda: self._ask(CHANGED))
        self._thread = threading.Thread(target=self._run, name="rpf3d alerts", daemon=True)
        self._thread.start()

    def decide_on(self, region: Hashable, evidence: Evidence, topic: str) -> None:
        """Request a decision on new evidence of a region (one wall of the pit), and return immediately.

        Evidence without sources applies to all regions of its topic. If MOST_WAITING answers already wait for their
        decision, the evidence is dropped, and the message with its sources counts as lost.

        topic : the topic on which the sources of the evidence were received
        """
        with self._served:
            if len(self._undecided) < MOST_WAITING:
                self._undecided.append(time.monotonic())
                self._requests.put(Request(region=region, evidence=evidence, topic=topic))
                return
        self.miss(topic, self._now())

    def wait_for_room(self, seconds: float) -> bool:
        """Wait at most `seconds` until fewer than MOST_UNDECIDED answers wait for their decision.

        Return True if fewer wait or the desk is closed, False if the time is up. The thread that flies rocks calls
        this method, so that answers do not come faster than a slow disk can log their decisions. Each answer needs its
        own decision, because a later answer may show less danger.
        """
        with self._served:
            return self._served.wait_for(lambda: len(self._undecided) < MOST_UNDECIDED or self._closed, seconds)

    def clicked(self, region: Hashable, stamp_ns: int) -> None:
        """Note a clicked source before it is answered; arguments as in `RegionEvidence.clicked`."""
        self._evidence.clicked(region, stamp_ns)

    def miss(self, topic: str, at_ns: int) -> None:
        """Record that messages of a topic of sources were lost before they could be read; at_ns : current time (ns)."""
        with self._served:
            self._missed[topic] = max(at_ns, self._missed.get(topic, at_ns))
        self._ask(CHANGED)

    def _ask(self, request: Request) -> None:
        """Queue the request CHANGED or MOVED to decide again, unless an equal request already waits.

        One request is enough, because the decision uses the state at the time of the decision. So the queue stays short
        while the disk hangs.
        """
        with self._served:
            if request not in self._asked:
                self._asked.append(request)
                self._requests.put(request)

    def watch(self, outlines: Callable[[], Mapping[str, str]], terrain: Callable[[], str] | None = None) -> None:
        """Set the current outlines of the areas and the current terrain, for all further decisions.

        If one of them has changed, request a decision. Evidence for a former outline or terrain is then outdated, even
        if many requests wait. Any thread may call.

        outlines : returns the digest of the current outline of each area, by name
        terrain : returns the digest of the current terrain, or "" without terrain; None if the terrain is not watched
        """
        with self._watching:  # otherwise an older state could be noted after a newer one
            present = outlines(), terrain() if terrain is not None else None
            if present == self._present:
                return
            self._present = present
            self._evidence.watch(*present, self._now())
            self._ask(MOVED)

    def forget(self, why: str, reply: Reply | None = None) -> None:
        """Request that all evidence is forgotten; until every topic of sources publishes again, the alert has a fault.

        why : the reason why the state is unknown
        reply : called with (True, `why`) on the thread of the alert desk, after the decision without evidence has been
            published. If the clock does not run yet, no decision is made, and `reply` is called with (True, NO_CLOCK).
            If the decision fails, or the desk is closed first, `reply` is not called
        """
        self._requests.put(Request(faults=why, reply=reply))

    def lose(self, why: str) -> None:
        """Request that all evidence is forgotten because of an error of the program.

        Afterwards, a message counts only if its stamp is later than the last stamp of its topic before the error. If a
        source of topic `clicked_point` is lost, the alert has a fault until the source would be too old.

        why : the reason why the state is unknown
        """
        self._requests.put(Request(faults=why, is_error=True))

    def acknowledge(self, by: str, why: str, reply: Reply, client: str = "") -> None:
        """Request a decision with an acknowledgement, and return immediately.

        A fault that the alert shows when this method is called makes the acknowledgement void, even if the fault ends
        before the decision. The only exception is the fault that the level before the start is unknown.

        by, why : name of the person, and reason; client : as in `Acknowledgement`
        reply : called on the thread of the alert desk, with True and a sentence, or with False and the reason why the
            acknowledgement has no effect; not called if the decision fails, or if the desk is closed first
        """
        given = Acknowledgement(by=by, why=why, at_ns=self._now(), client=client)
        faults = self.alert.faults if self.alert is not None else ()
        ended_by_it = self._unknown.sentences  # a fault that only acknowledgements end cannot make them void
        shown = tuple(each for each in _once(*self.standing.sentences, *faults) if each not in ended_by_it)
        self._requests.put(Request(acknowledged=given, reply=reply, shown=shown))

    def tick(self) -> None:
        """Request a decision if the last decision failed or its validity ends soon; call this method regularly.

        Nothing is requested if a request already waits. In any case, report a decision that takes too long to be
        written to the log, and evidence that has waited too long for its decision: a disk that is slow or hangs raises
        no error.
        """
        since = self._waiting_since()
        if since is not None and since != self._hanging_since and time.monotonic() - since > LONGEST_WRITE:
            self._hanging_since = since
            if self._waiting_since() == since:  # still the same decision
                self._listener.unwritten()
        if self._requests.empty() and (self._failed or self._is_over(self._now())):
            self._requests.put(Request(faults=FORGOTTEN, is_error=True) if self._failed else TICK)

    def _waiting_since(self) -> float | None:
        """Return when (s, steady clock) the oldest evidence or decision began to wait; None if nothing waits."""
        writing = self._writing_since  # read once: the thread of the desk may set it to None at any time
        with self._served:
            since = [*list(self._undecided)[:1], *([] if writing is None else [writing])]
        return min(since, default=None)

    def close(self, timeout: float) -> bool:
        """Stop deciding; wait at most `timeout` (s). Return True if the thread has ended and the log is closed.

        The log is closed as soon as the thread ends, which may be after the timeout.
        """
        self._closed = True
        self._requests.put(CLOSING)
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._serve_requests()
        finally:
            with contextlib.suppress(Exception):  # the requests that still wait would have saved this
                self._note_lost_messages()
                self._remember()
            if self._log is not None:
                self._log.close()

    def _serve_requests(self) -> None:
        waiting: deque[Request | None] = deque()
        while True:
            while not (waiting and self._requests.empty()):
                waiting.append(self._next())
            request = waiting.popleft()
            if request is CLOSING or self._closed:
                return
            if any(later is not CLOSING and request.is_covered_by(later) for later in waiting):
                continue
            try:
                self._serve(request, waiting[0] if waiting else None)
            except Exception as error:
                self._evidence.lose()
                self._failed = True
                report_error(self._listener.undecided, error)
            finally:
                self._writing_since = None
                self._note_served(request)

    def _next(self) -> Request | None:
        """Wait for the next request and return it; None if the desk must close.

        The request no longer counts as waiting: a later change of faults, areas or terrain queues a new request.
        """
        request = self._requests.get()
        with self._served:
            self._asked = [each for each in self._asked if each is not request]
        return request

    def _note_served(self, request: Request) -> None:
        if request.evidence is not None:
            with self._served:
                self._undecided.popleft()
                self._served.notify_all()

    def _serve(self, request: Request, following: Request | None) -> None:
        """Carry out a request, usually with a decision; following : the next request, None if no other request waits.

        If the evidence of both requests is about sources without an answer, no decision is made now: the decision on
        the next request contains the faults of both.
        """
        now = self._now()
        if request.faults:
            self._evidence.lose() if request.is_error else self._evidence.forget(now)
        self._note_lost_messages()
        if request.evidence is not None:
            self._evidence.note(request.region, request.topic, request.evidence)
        self._remember()
        if request.is_moved and not len(self._evidence):
            return
        if request.is_unanswered and following is not None and following.is_unanswered:
            return  # one decision contains the faults of both
        self._clock_ran = self._clock_ran or now > 0  # a clock that went back to 0 counts as running
        if not self._clock_ran:
            self._wait_for_clock(request)
        elif request.acknowledged is not None:
            self._acknowledge(request, now)
        elif request.decides or request.is_moved or self._is_over(now):
            self._decide(now, None)
            if request.reply is not None:
                request.reply((True, request.faults))

    def _note_lost_messages(self) -> None:
        with self._served:
            missed, self._missed = self._missed, {}
        for topic, at_ns in missed.items():
            self._evidence.miss(topic, at_ns)

    def _remember(self) -> None:
        """Save the state that the next start needs, if there is a log; report success or failure to the listener."""
        log = self._log
        if log is None:
            return
        self._listener.remembered(self._fault_of_writing(partial(self._keep_received, log)))

    def _keep_received(self, log: DecisionLog) -> None:
        try:
            topics = {"heard": list(self._evidence.heard), "missed": self._evidence.missed}
            received = {**self._remembered(), **topics}
        except Exception:
            log.lose_received()
            raise
        log.remember(received)

    def _wait_for_clock(self, request: Request) -> None:
        """Report, and reply, that no decision is possible before the clock runs; the evidence is kept until then."""
        if not self._owed or request != TICK:
            self._listener.held_up(NO_CLOCK)
        self._owed = True
        if request.reply is not None:
            request.reply((request.acknowledged is None, NO_CLOCK))

    def _acknowledge(self, request: Request, now: int) -> None:
        """Decide with the acknowledgement of a request, and reply; now : current time (ns).

        An acknowledgement without a name or reason causes no decision: the log notes that it was refused.
        """
        asked = request.acknowledged or Acknowledgement(by="", why="", at_ns=now)
        try:
            given = acknowledgement(*asked)
        except InputError as refusal:
            result = (False, str(refusal))
            if self._log is not None:
                self._log_it(partial(self._log.refused, asked._replace(at_ns=now), str(refusal)))
        else:
            result = self._decide_with(given, now, request.shown)
            if set(request.shown) - set(self.standing.sentences):
                self._decide(now, None)  # without the faults that have ended since the acknowledgement was given
        if request.reply is not None:
            request.reply(result)

    def _decide_with(self, given: Acknowledgement, now: int, shown: tuple[str, ...]) -> tuple[bool, str]:
        """Decide with an acknowledgement; return True and the level, or False and why the acknowledgement is void.

        If it is unknown which level was held before the start, the acknowledgement may end this fault. The same
        acknowledgement then does not lower a held level.

        shown : the faults that were shown when the acknowledgement was given; they count although they may have ended
        """
        if not self._unknown.sentences:
            alert = self._decide(now, given, shown)
            return not alert.void, alert.void or f"the level is {alert.level.word}"
        evidence, standing = self._evidence.fresh(now), _once(*self.standing.sentences, *shown)
        others = decide(self.alert, evidence, self._thresholds, now, None, standing).faults
        self._decide(now, given, shown)  # the log has the acknowledgement, and the fault until now
        if why := self._unknown.acknowledged(given.by, now, others):
            return False, why
        if self._log is not None:
            self._log.settle()
        alert = self._decide(now, None)
        return True, f"the fault of the unknown level has ended; the level is {alert.level.word}"

    def _decide(self, now: int, given: Acknowledgement | None, shown: tuple[str, ...] = ()) -> Alert:
        """Decide at a time `now` (ns), log the decision, publish the alert, and return it.

        given : an acknowledgement, None for none; shown : as in `_decide_with`
        """
        if self._owed:
            self._owed = False
            self._listener.held_up("")
        evidence = self._evidence.fresh(now)
        reported = _once(*self._unknown.sentences, *self.standing.sentences, *shown)
        alert = decide(self.alert, evidence, self._thresholds, now, given, reported)
        if self._log is not None:
            decision = Decision(
                previous=self.alert, evidence=evidence, acknowledgement=given, now_ns=now, alert=alert,
                reported=reported,
            )  # fmt: skip
            self._log_it(partial(self._log.decided, decision, self._thresholds))
        self.alert = alert
        self._listener.decided(alert, evidence)
        self._failed = False  # set only after a decision: a request without one does not repair a failed decision
        return alert

    def _log_it(self, write: Callable[[], object]) -> None:
        self._listener.logged(self._fault_of_writing(write))

    def _fault_of_writing(self, write: Callable[[], object]) -> str:
        """Write to the log; return why this failed, "" if it did not fail. The alert is published in both cases.

        The time that `tick` compares with LONGEST_WRITE counts from the first write for a request, because the alert
        waits for all writes of the request.

        write : function that writes to the log
        """
        if self._writing_since is None:
            self._writing_since = time.monotonic()
        try:
            write()
        except Exception as fault:
            return str(fault) if isinstance(fault, NotLogged) else f"{type(fault).__name__}: {fault}"
        return ""

    def _is_over(self, now: int) -> bool:
        """True if a new decision must be made: the validity of the last decision has ended or ends soon.

        Also True if unreported places were not simulated in time, which the last decision could not know.
        Also True if there is no decision yet, if decisions had to wait for the clock, or if the last decision is later
        than `now`. The validity of a decision ends at the latest when its evidence becomes stale, so the alert becomes
        a fault at the latest at the first call of `tick` after that time.

        now : current time (ns)
        """
        if self._owed or self.alert is None:
            return True
        early = min(RENEWED_BEFORE, (self.alert.valid_until_ns - self.alert.at_ns) // 2)
        is_late = self.unreported.has_become_late(self.alert.at_ns, now)
        return now >= self.alert.valid_until_ns - early or now < self.alert.at_ns or is_late


def _once(*sentences: str) -> tuple[str, ...]:
    """Return the sentences in their order, each once."""
    return tuple(dict.fromkeys(sentences))
