"""The station: everything that exists between configuring and cleaning up, namely the threads and their connections."""

import itertools
import queue
import time
import traceback
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Protocol

from rclpy.impl.rcutils_logger import RcutilsLogger

from rpf3d_core.alerts.evidence import Evidence, areas_of, unfinished_of, untouched
from rpf3d_core.alerts.levels import Alert, Level, acknowledgement
from rpf3d_core.errors import InputError
from rpf3d_core.live.answers import Answer
from rpf3d_core.live.ground import LiveTerrain
from rpf3d_core.live.store import Store
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.alert_desk import LONGEST_WRITE, AlertDesk
from rpf3d_ros.engine.answered import AnsweredSources
from rpf3d_ros.engine.builder import Arrival, Builder
from rpf3d_ros.engine.configuration import Equipment, around_of, version
from rpf3d_ros.engine.flyer import Flyer
from rpf3d_ros.engine.intake import SECOND, WaitingSources, WaitingTerrain
from rpf3d_ros.interface.alert_publishers import AlertPublishers
from rpf3d_ros.interface.answer_publishers import AnswerPublishers
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.messages.answer_content import figures_of, warnings_of
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.messages.refusals import TAKEN_UP
from rpf3d_ros.messages.stamps import stamp_of

ANSWER_WITHIN = 0.04
"""Time (s) that a service's callback waits for a decision and its log: no callback may take longer than 50 ms."""

REMEMBERED = 4
"""Walls whose last sources are kept to be answered again or completed, as a multiple of the walls that may wait."""

COMPUTING = 0.5
"""Time (s) that the threads that fly and build may continue when the station is closed.

Both may compute for that long while someone waits for the node to end. Ground that is not yet in use is then lost, as
by a `kill -9`.
"""

WRITING = 1.0
"""Time (s) that decisions already made, and terrain in use, may take to reach the disk after that."""

LAST_WORD = 0.5
"""Time (s) that a transition waits for the last fault to be published; after that only the alarm sounds."""


@dataclass(frozen=True, eq=False)
class Outlets:
    """The outputs of the station: the node's publishers, diagnostics and log; now : the node's clock, ns."""

    answers: AnswerPublishers
    alerts: AlertPublishers
    health: HealthReport
    logger: RcutilsLogger
    now: Callable[[], int]


class NoOutlets:
    """Replaces an output and ignores all calls."""

    def __getattr__(self, name: str) -> "NoOutlets":
        """Return this object for any attribute."""
        return self

    def __call__(self, *args: object, **named: object) -> "NoOutlets":
        """Do nothing."""
        return self


_NOBODY: Any = NoOutlets()
SILENCE = Outlets(_NOBODY, _NOBODY, _NOBODY, _NOBODY, _NOBODY)
"""Outputs that discard everything from abandoned threads, because another station may use the real outputs by then."""


class Ending(Protocol):
    """An object with a thread that can be ended."""

    def close(self, timeout: float) -> bool:
        """Wait at most `timeout` (s); return True if the thread has ended."""


def _all_end(each: Iterable[Ending], timeout: float) -> bool:
    """End all of them within `timeout` (s) in total; return True if all have ended."""
    until = time.monotonic() + timeout
    ended = [one.close(max(until - time.monotonic(), 0.0)) for one in each]
    return all(ended)


class Station:
    """The threads of a configured simulator, and the connections between them."""

    def __init__(self, equipment: Equipment, outlets: Outlets) -> None:
        """Start the threads; nothing is answered before `activate`."""
        self._equipment, self._outlets = equipment, outlets
        parameters, scene = equipment.parameters, equipment.scene
        self.sources = WaitingSources(parameters.region_size, parameters.waiting_sources)
        self.terrain: WaitingTerrain[Arrival] = WaitingTerrain(parameters.waiting_patches)
        results, around = itertools.count(1), around_of(parameters)
        terms = equipment.thresholds.evidence if equipment.thresholds is not None else None
        age, least = (terms.sources_max_age_s, terms.fewest_rocks) if terms is not None else (0.0, 0)
        answered = AnsweredSources(age, REMEMBERED * parameters.waiting_sources)
        self.flyer = Flyer(scene, around, parameters.first_rocks, self.sources, results, self, answered, least)
        self.builder = Builder(scene, equipment.workshop, self.terrain, self.flyer, self, equipment.store)
        self.desk: AlertDesk | None = None
        self._level: Level | None = None
        self._is_silent = False
        if equipment.thresholds is not None:
            self.desk = AlertDesk(equipment.thresholds, equipment.log, outlets.now, self)
        if equipment.log_fault:
            self.logged(equipment.log_fault)
        if equipment.standing is not None:
            self.flyer.hand_over(ready=equipment.standing)
            self.stands(equipment.standing.ground, equipment.said)
        else:
            outlets.health.set("terrain", WARN, equipment.said or "no terrain yet")

    def activate(self) -> None:
        """Start to answer and decide."""
        self._is_silent = False
        self.flyer.activate()
        if self.desk is not None:
            self.desk.forget("the node has just been activated: nothing has been heard of sources since")
        self.say_waiting()

    def deactivate(self) -> None:
        """Stop answering, and forget waiting sources; terrain that was received is still processed.

        The last alert published is a fault, because a subscriber of the latched alarm must not take silence for safety.
        """
        self.flyer.deactivate()
        self.terrain.forget_heard()
        if self.desk is not None:
            replies: queue.SimpleQueue[tuple[bool, str]] = queue.SimpleQueue()
            self.desk.forget("the node is not active: it hears and decides nothing", replies.put)
            try:
                replies.get(timeout=LAST_WORD)
            except queue.Empty:  # the log's disk is slow: the alarm alone is published last
                self._is_silent = True
                self._outlets.alerts.sound_alarm()

    def close(self) -> bool:
        """End all threads, within COMPUTING and WRITING; return True if all have ended.

        Threads that have not ended are abandoned: nothing that they report is published any more.
        """
        self.terrain.close()
        ended = _all_end((self.flyer, self.builder), COMPUTING)
        ended &= _all_end([each for each in (self.desk, self._equipment.store) if each is not None], WRITING)
        self._outlets = replace(SILENCE, now=self._outlets.now)
        return ended

    def submit(self, trigger: Trigger) -> None:
        """Put a trigger in line.

        A trigger that is pushed out counts as a fault of its wall until it is answered, after all others.
        """
        pushed_out = self.flyer.submit(trigger)
        if pushed_out is not None:
            most = self._equipment.parameters.waiting_sources
            self.unanswerable(pushed_out, f"more than {most} walls tell of sources at once (waiting_sources)")
        self.say_waiting()

    def say_waiting(self) -> None:
        """Report the missing input."""
        if self.flyer.standing is None:
            self.waiting("terrain")
        elif not self.flyer.has_trigger:
            self.waiting("sources")

    def forget(self, why: str) -> None:
        """Forget sources and the times at which patches were published, because the clock went back."""
        self.terrain.forget_heard()
        self.flyer.forget()
        if self.desk is not None:
            self.desk.forget(why)

    def beat(self) -> None:
        """Do regular work: decide again if a decision is over, free old patches, and report the queues."""
        if self.desk is not None:
            self.desk.tick()
        self.terrain.let_go_of_old_patches()
        lost, dropped = self.terrain.lost_patches, self.sources.dropped
        values = {
            "sources_waiting": len(self.sources), "sources_dropped": dropped, "terrain_waiting": len(self.terrain),
            "terrain_overtaken": self.terrain.overtaken, "patches_lost": lost,
        }  # fmt: skip
        if self._equipment.store is not None:
            self._say_stored(self._equipment.store)
        lacking = "patches are not in the terrain: publish the whole terrain"
        level, sentence = (WARN, lacking) if lost else (OK, "in hand")
        self._outlets.health.set("queues", level, sentence, {name: str(value) for name, value in values.items()})

    def _say_stored(self, store: Store) -> None:
        if self.flyer.standing is None:
            said = "there is no terrain yet to be kept"
        else:
            said = "the terrain in use is kept" if store.flush(0.0) else "the terrain in use is being written"
        self._outlets.health.set("store", WARN if store.fault else OK, store.fault or said)

    def acknowledged(self, said: str) -> tuple[bool, str]:
        """Return True if an acknowledgement ("NAME: REASON") lowered the level, else False; and a sentence about it."""
        if self.desk is None:
            return False, "no site_file is set, so there are no alerts"
        by, _, why = said.partition(":")
        replies: queue.SimpleQueue[tuple[bool, str]] = queue.SimpleQueue()
        self.desk.acknowledge(by, why, replies.put)
        try:
            acknowledgement(by, why, self._outlets.now())
            lowered, answer = replies.get(timeout=ANSWER_WITHIN)
            return lowered, f"{by.strip()}: {answer}"
        except InputError as refusal:
            return False, f"{refusal}; acknowledged_by is to say NAME: REASON"
        except queue.Empty:
            return False, TAKEN_UP

    # --- reports of the flyer

    def answered(self, answer: Answer) -> None:
        """Decide on an answer and publish it."""
        if self.desk is not None:
            self.desk.decide_on(self.region_of(answer.trigger), self._evidence(answer), answer.trigger.topic)
        made = stamp_of(self._outlets.now())
        self._outlets.answers.publish(answer, self._equipment.parameters, made)
        warnings = warnings_of(answer)
        well = "every rock has an outcome" if answer.sources else "watched, nothing seen"
        level, sentence = (WARN, "; ".join(warnings)) if warnings else (OK, well)
        self._outlets.health.set("run", level, sentence, figures_of(answer))

    def unanswerable(self, trigger: Trigger, why: str) -> None:
        """Report why a trigger has no answer; for alerts that is a fault."""
        self._outlets.health.set("run", WARN, f"sources refused: {why}")
        if self.desk is not None:
            self.desk.decide_on(self.region_of(trigger), self._no_evidence(trigger, why), trigger.topic)

    def groundless(self, trigger: Trigger) -> None:
        """Report that there is no terrain to answer on; for alerts that is a fault."""
        self.waiting("terrain")
        if self.desk is not None:
            evidence = self._no_evidence(trigger, "there is no terrain to fly over")
            self.desk.decide_on(self.region_of(trigger), evidence, trigger.topic)

    def waiting(self, what: str) -> None:
        """Report that an input is still missing."""
        self._outlets.health.set("run", WARN if what == "terrain" else OK, f"waiting for {what}")

    def failed(self, error: BaseException) -> None:
        """Report an unforeseen error; for alerts it is a fault."""
        self._outlets.logger.error("".join(traceback.format_exception(error)))
        self._outlets.health.set("run", ERROR, f"{type(error).__name__}: {error}")
        if self.desk is not None:
            self.desk.lose(f"an answer failed: {type(error).__name__}")

    # --- reports of the builder

    def stands(self, ground: LiveTerrain, what: str) -> None:
        """Report which ground is in use."""
        age = (self._outlets.now() - ground.stamp_ns) / SECOND
        values = {
            "triangles": str(len(ground.terrain.triangles)), "digest": ground.digest,
            "stamp": f"{ground.stamp_ns / SECOND:.3f}", "age_s": f"{age:.0f}",
        }  # fmt: skip
        self._outlets.health.set("terrain", OK, what, values)
        self.say_waiting()

    def terrain_refused(self, why: str) -> None:
        """Report why a survey is not used."""
        self._outlets.health.set("terrain", WARN, f"message refused: {why}")

    # --- reports of the desk

    def decided(self, alert: Alert, evidence: Evidence | None) -> None:
        """Publish an alert, and log it if the level has changed."""
        if self._is_silent:
            return
        told = self._outlets.alerts.publish(alert, evidence, self._equipment.parameters.map_frame)
        if told and self._level != alert.level:
            self._level = alert.level
            self._outlets.logger.info(f"alert: {alert.level.word}: {alert.reasons[0]}")

    def held_up(self, why: str) -> None:
        """Report why nothing can be decided, and sound the alarm: a missing alert must not be taken for safety."""
        self._outlets.health.set("clock", ERROR if why else OK, why or "it runs")
        if why:
            self._outlets.alerts.sound_alarm()

    def unwritten(self) -> None:
        """Report that a decision waits for the disk, and sound the alarm, because the decision is unknown."""
        why = f"the disk does not answer: a decision has waited for {LONGEST_WRITE:g} s, and is not told before it is"
        self._outlets.health.set("decision log", ERROR, why)
        self._outlets.alerts.sound_alarm()

    def undecided(self, error: BaseException) -> None:
        """Report a decision that failed."""
        self._outlets.logger.error("".join(traceback.format_exception(error)))
        self._outlets.health.set("run", ERROR, f"no decision: {type(error).__name__}: {error}")

    def logged(self, fault: str) -> None:
        """Report whether decisions are on disk."""
        self._outlets.health.set("decision log", ERROR if fault else OK, fault or "every decision is on disk")

    def region_of(self, trigger: Trigger) -> Hashable:
        """Return the wall that a trigger belongs to."""
        return self.sources.region_of(trigger)

    def _evidence(self, answer: Answer) -> Evidence:
        faults = (answer.left_out,) if answer.left_out else ()
        if lost := self.terrain.lost_patches:
            faults = (*faults, f"{lost} patches are not in the terrain: the whole terrain must be published")
        found = self._no_evidence(answer.trigger, "")._replace(
            result=answer.result, stage=answer.stage, faults=faults, areas=untouched(answer.maps.area_names)
        )
        if not answer.sources:
            return found
        unfinished = unfinished_of(answer.outcomes)
        return found._replace(sources=answer.sources, unfinished=unfinished, areas=areas_of(answer.maps))

    def _no_evidence(self, trigger: Trigger, why: str) -> Evidence:
        standing = self.flyer.standing
        return Evidence(
            result=0, stage=0, at_ns=self._outlets.now(), trigger_stamp_ns=trigger.stamp_ns,
            terrain_stamp_ns=0 if standing is None else standing.ground.stamp_ns,
            terrain_digest="" if standing is None else standing.ground.digest,
            sources_digest=trigger.digest, sources=len(trigger.positions), seed=self._equipment.scene.seed,
            version=version(), areas=(), faults=(why,) if why else (),
        )  # fmt: skip
