"""Publishes the answers of the thread that flies rocks, and requests an alert decision on each of them."""

import traceback
from collections.abc import Callable, Hashable
from typing import NamedTuple

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.live.answers import Answer
from rpf3d_core.live.standing import PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.alerts.alert_desk import AlertDesk
from rpf3d_ros.alerts.answer_evidence import EvidenceContext, evidence_of_answer, evidence_without_answer
from rpf3d_ros.engine.configuration import StationConfiguration
from rpf3d_ros.engine.outlets import Outlets
from rpf3d_ros.messages.answer_content import figures_of, warnings_of
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.messages.stamps import stamp_of

ROOM_WITHIN = 0.1
"""Time (s) between two checks whether the simulator is being closed, while answers wait for their decisions."""


class PresentState(NamedTuple):
    """Functions that return parts of the current state of the simulator, by which answers are judged.

    desk : returns the alert desk; None without a site file, and until the station has made it
    region_of : returns the region of a trigger, that is the wall that its sources belong to
    standing : returns the terrain in use, None if there is none
    watch_present : passes the current outlines and terrain to the alert desk, before it decides
    while_known : as in `Flyer`
    """

    desk: Callable[[], AlertDesk | None]
    region_of: Callable[[Trigger], Hashable]
    standing: Callable[[], PreparedTerrain | None]
    watch_present: Callable[[], None]
    while_known: Callable[[Trigger, Callable[[], None]], bool]


class AnswerReports:
    """Receives answers and failures from the thread that flies rocks (`FlightListener`)."""

    def __init__(self, configuration: StationConfiguration, outlets: Outlets, state: PresentState) -> None:
        """Prepare to report answers and failures to `outlets` (publishers and diagnostics).

        configuration : parameters and scene of the simulator
        state : functions that return the current state of the simulator, or pass it on
        """
        self._configuration, self._outlets, self._state = configuration, outlets, state
        self._closing = False

    def close(self) -> None:
        """Wait no longer for decisions: the simulator is being closed."""
        self._closing = True

    def silence(self, outlets: Outlets) -> None:
        """Report to other outlets from now on; outlets : from `Outlets.silenced`."""
        self._outlets = outlets

    def answered(self, answer: Answer) -> None:
        """Request an alert decision on an answer, and publish the answer.

        An answer to places that are no longer reported is not published. An answer to sources that have been forgotten
        meanwhile, for example because the clock went back, counts for nothing. Return only when few answers wait for
        their decision (`AlertDesk.wait_for_room`), because the disk may be slow.
        """
        self._state.watch_present()
        desk = self._state.desk()
        if desk is not None:
            evidence = evidence_of_answer(answer, self._circumstances())
            if not self._decide_on(desk, answer.trigger, evidence):
                return
        if not answer.trigger.is_unreported:
            self._publish(answer)
        while desk is not None and not self._closing and not desk.wait_for_room(ROOM_WITHIN):
            pass  # the disk is slow: no rocks fly until the decisions have followed

    def _publish(self, answer: Answer) -> None:
        made = stamp_of(self._outlets.now())
        self._outlets.answers.publish(answer, self._configuration.parameters, made)
        warnings = warnings_of(answer)
        well = "every rock has an outcome" if answer.sources else "the sensors see no sources"
        level, sentence = (WARN, "; ".join(warnings)) if warnings else (OK, well)
        self._outlets.health.set("run", level, sentence, figures_of(answer))

    def unanswerable(self, trigger: Trigger, why: str) -> None:
        """Report why a trigger has no answer; the missing answer is a fault of the alert.

        For places that are no longer reported, there is no report in the diagnostics.
        """
        if not trigger.is_unreported:  # otherwise the message with the current sources may have an answer
            self._report_refused(why)
        self._decide_without_answer(trigger, why)

    def drop(self, trigger: Trigger, why: str) -> None:
        """Report why sources that wait are not answered for now, in the diagnostics and as a fault of the alert.

        Only the thread that receives sources, and forgets them, may call.
        """
        self._report_refused(why)
        desk = self._state.desk()
        if desk is not None:
            desk.decide_on(self._state.region_of(trigger), self._without_answer(trigger, why), trigger.topic)

    def _report_refused(self, why: str) -> None:
        self._outlets.health.set("run", WARN, f"sources refused: {why}")

    def groundless(self, trigger: Trigger) -> None:
        """Report that there is no terrain for an answer, which is a fault of the alert."""
        self.waiting("terrain")
        self._decide_without_answer(trigger, "there is no terrain, so no rock can fly")

    def waiting(self, what: str) -> None:
        """Report in the diagnostics that an input is still missing; what : "terrain" or "sources"."""
        self._outlets.health.set("run", WARN if what == "terrain" else OK, f"waiting for {what}")

    def failed(self, error: BaseException, trigger: Trigger | None = None) -> None:
        """Report an unforeseen error, which is a fault of the alert.

        trigger : the sources without an answer; their wall has a fault until this wall gets an answer. None if it is
            unknown what failed; every topic must then publish again
        """
        self._outlets.logger.error("".join(traceback.format_exception(error)))
        self._outlets.health.set("run", ERROR, f"{type(error).__name__}: {error}")
        desk = self._state.desk()
        if desk is not None:
            why = f"an answer failed: {type(error).__name__}"
            if trigger is None:
                desk.lose(why)
            else:
                self._decide_without_answer(trigger, why)

    def _decide_without_answer(self, trigger: Trigger, fault: str) -> None:
        desk = self._state.desk()
        if desk is not None:
            self._decide_on(desk, trigger, self._without_answer(trigger, fault))

    def _decide_on(self, desk: AlertDesk, trigger: Trigger, evidence: Evidence) -> bool:
        """Request a decision on evidence, unless its trigger has been forgotten; return False in this case.

        The clock may go back while the evidence is made. If the request came after that of `AlertDesk.forget`, the
        evidence would count as new.
        """
        region = self._state.region_of(trigger)
        return self._state.while_known(trigger, lambda: desk.decide_on(region, evidence, trigger.topic))

    def _without_answer(self, trigger: Trigger, fault: str) -> Evidence:
        return evidence_without_answer(trigger, fault, self._circumstances())

    def _circumstances(self) -> EvidenceContext:
        return EvidenceContext(
            standing=self._state.standing(), at_ns=self._outlets.now(), seed=self._configuration.scene.seed
        )
