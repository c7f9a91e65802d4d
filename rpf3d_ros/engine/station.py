"""The station: all threads of a configured simulator and their connections, until the node is cleaned up."""

import itertools
import math
import queue
import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from rpf3d_core.alerts.levels import acknowledgement
from rpf3d_core.alerts.limits import limits_of
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.errors import InputError
from rpf3d_core.live.answers import EnsembleSize
from rpf3d_core.live.ground import LiveTerrain
from rpf3d_core.live.standing import Outlines
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.alerts.alert_desk import AlertDesk
from rpf3d_ros.alerts.areas_before import AreasBefore
from rpf3d_ros.alerts.place_checks import PlaceChecks
from rpf3d_ros.alerts.refused_inputs import RefusedInputs
from rpf3d_ros.alerts.source_topics import BY_HAND
from rpf3d_ros.alerts.topics_before import TopicsBefore
from rpf3d_ros.engine.answer_reports import AnswerReports, PresentState
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.before_start import BeforeStart
from rpf3d_ros.engine.builder import Builder
from rpf3d_ros.engine.configuration import StationConfiguration, spread_of
from rpf3d_ros.engine.decision_reports import DecisionReports
from rpf3d_ros.engine.diagnostics import report_ground, report_queues, report_store
from rpf3d_ros.engine.flyer import Flyer
from rpf3d_ros.engine.outlets import Outlets
from rpf3d_ros.engine.stamp_guards import StampGuards
from rpf3d_ros.engine.survey_in_use import Arrival
from rpf3d_ros.engine.terrain_faults import TerrainLack
from rpf3d_ros.engine.waiting_sources import WaitingSources
from rpf3d_ros.engine.waiting_terrain import WaitingTerrain
from rpf3d_ros.messages.area_messages import EQUIPMENT, LIVE_AREA
from rpf3d_ros.messages.health import WARN
from rpf3d_ros.messages.refusals import TAKEN_UP

AREA_TOPICS = {"areas/polygon": LIVE_AREA, "areas/equipment": EQUIPMENT}
"""The topics of areas, and the name of the area that each defines."""

REMEMBERED_STAMPS = ("terrain/points", "terrain/update", *AREA_TOPICS)
"""Topics whose last stamps are kept for the next start, so that no older terrain or area is used then.

Sources need no stamps: their age has a limit.
"""

ANSWER_WITHIN = 0.04
"""Longest time (s) that `~/acknowledge` waits until its decision is logged: no callback may take longer than 50 ms."""

REMEMBERED = 4
"""Factor: the last triggers of at most REMEMBERED * `waiting_sources` regions are kept, to be answered again."""

COMPUTING = 0.5
"""Time (s) for which the threads that fly rocks and build terrain may continue when the simulator is closed.

After this time, a terrain that is not yet in use is lost, as after a `kill -9`.
"""

WRITING = 1.0
"""Time (s) after COMPUTING in which the made decisions and the terrain in use must reach the disk."""

LAST_FAULT = 0.5
"""Time (s) for which deactivation waits until the last fault is published; after that, only the alarm is published."""


class ClosableThread(Protocol):
    """A thread of the simulator node that `close` can end."""

    def close(self, timeout: float) -> bool:
        """End the thread, and wait for it for at most `timeout` (s); return True if it has ended."""


def _all_end(threads: Iterable[ClosableThread], timeout: float) -> bool:
    """End all threads within `timeout` (s) in total; return True if all have ended."""
    until = time.monotonic() + timeout
    ended = [one.close(max(until - time.monotonic(), 0.0)) for one in threads]
    return all(ended)


class Station:
    """All threads of a configured simulator (receiving, building, flying, deciding), and their connections."""

    def __init__(self, configuration: StationConfiguration, outlets: Outlets) -> None:
        """Start the threads; no sources are answered before `activate`."""
        self._was_deactivated = False
        self._configuration, self._outlets = configuration, outlets
        parameters, scene = configuration.parameters, configuration.scene
        self._before = BeforeStart(configuration)
        self.guards = StampGuards(configuration.most_ahead, configuration.most_behind)
        self.terrain: WaitingTerrain[Arrival] = WaitingTerrain(parameters.waiting_patches)
        terms = configuration.thresholds.evidence if configuration.thresholds is not None else None
        age, least = (terms.sources_max_age_s, terms.fewest_rocks) if terms is not None else (0.0, 0)
        self.sources_max_age_s = age if terms is not None else math.inf
        answered = AnsweredSources(age, REMEMBERED * parameters.waiting_sources)
        period = terms.scan_period_s if terms is not None else None
        self.sources = WaitingSources(parameters.region_size, parameters.waiting_sources, period is not None)
        cluster = terms.cluster_m if terms is not None else math.inf
        self.desk: AlertDesk | None = None
        self.reports = AnswerReports(configuration, outlets, self._present_state())
        size = EnsembleSize(first=parameters.first_rocks, least=least, cluster=cluster)
        self.flyer = Flyer(spread_of(parameters), size, self.sources, itertools.count(1), self.reports, answered)
        self.builder = Builder(
            scene, configuration.workshop, self.terrain, self.flyer, self, configuration.store, outlets.now,
            self._before.survey(), self._before.replaced_meshes(),
        )  # fmt: skip
        self._clicked_s: float | None = None  # when a source was last clicked (s, steady clock)
        self._places: PlaceChecks | None = None  # without a site file, places are not checked
        persons = configuration.thresholds.acknowledge if configuration.thresholds is not None else None
        # A refused message may be about a place that is reported only once in a scan.
        self._refused_inputs = RefusedInputs(self.report_fault, max(age, period or 0.0), persons)
        self._areas = AreasBefore(self.report_fault, self._before.areas(self.watched_area_topics))
        self._topics = TopicsBefore(self.report_fault, persons, self._before.unjudged(AREA_TOPICS))
        self.decisions = DecisionReports(outlets, parameters.map_frame)
        self._note_terrain_before()
        self._continue_stamps()
        if configuration.thresholds is not None:
            # The thread of the alert desk may write to disk and decide as soon as it runs. So all that is known from
            # before the start is noted first.
            self._remember_refusals()
            self.desk = self._desk_of(configuration, configuration.thresholds)
            self._places = self._places_of(configuration.thresholds, self.desk)
            self._places.restore(self._before.places, self._before.sensors, self._before.dangers)
            self._report_terrain()
            self._refused_inputs.repeat()
            self._areas.repeat()
            self._topics.repeat()
        if configuration.log_fault:
            self.decisions.begin(configuration.log_fault)
        if configuration.standing is not None:
            self.flyer.hand_over(ready=configuration.standing)
            self.stands(configuration.standing.ground, configuration.standing_report)
        else:
            outlets.health.set("terrain", WARN, configuration.standing_report or "no terrain yet")

    def _present_state(self) -> PresentState:
        return PresentState(
            desk=lambda: self.desk, region_of=self.sources.region_of, standing=lambda: self.flyer.standing,
            watch_present=self._watch_present,
            while_known=lambda trigger, do: self.flyer.while_known(trigger, do),
        )  # fmt: skip

    def _desk_of(self, configuration: StationConfiguration, thresholds: Thresholds) -> AlertDesk:
        """Return the alert desk, which continues from the decisions and topics before the start."""
        sensors, log = configuration.parameters.sensors, configuration.log
        return AlertDesk(
            thresholds, log, self._outlets.now, self.decisions, sensors.expected,
            has_sensors=bool(self._before.sensors), heard=self._before.heard,
            unknown=configuration.log_fault if log is None else log.unknown, remembered=self._inputs_to_remember,
            missed=self._before.missed,
        )  # fmt: skip

    @property
    def watched_area_topics(self) -> list[str]:
        """The topics of areas that have limits in the site file, under their names or a pattern."""
        thresholds = self._configuration.thresholds
        if thresholds is None:
            return []
        return [topic for topic, name in AREA_TOPICS.items() if limits_of(thresholds, name) is not None]

    def _remember_refusals(self) -> None:
        """Set the faults of messages that were refused before the start, for topics that the node still has."""
        now = time.monotonic()
        for topic, why in self._before.refused(AREA_TOPICS).items():
            self._refused_inputs.refused(topic, why, at=now)

    def _places_of(self, thresholds: Thresholds, desk: AlertDesk) -> PlaceChecks:
        """Return the check of the places of sources."""
        spread = self._configuration.parameters.position_spread
        return PlaceChecks(
            thresholds, spread, desk.unreported, desk.scans, self.report_fault, self.flyer.end_unreported
        )

    def _inputs_to_remember(self) -> dict[str, Any]:
        """Return the state to save for the next start, as plain values; called on the thread of the alert desk.

        The state has the refused messages, the topics with areas, the last stamps of terrain and areas, the terrain in
        use (digests, stamp and number of patches), the surveys before it, the number of missing patches, why a whole
        survey was refused, the origin of the map, and the topics whose sources cannot be judged. The alert desk adds
        the topics of sources.
        """
        standing = self.flyer.standing
        terrain = self._before.terrain_to_remember(standing.ground if standing is not None else None)
        stamps = {topic: at for topic, at in self.guards.stamps.items() if topic in REMEMBERED_STAMPS}
        topics = {"refused": self._refused_inputs.reasons, "unjudged": self._topics.reasons}
        others = {"areas": list(self._areas.topics), "stamps": stamps, "lacks": list(self._terrain_lack)}
        places = self._places.to_remember() if self._places is not None else {}
        origin = {"map_origin": list(self._before.origin)}
        return {**topics, **others, **origin, **places, **terrain, **self.builder.to_remember()}

    def _note_terrain_before(self) -> None:
        """Note the patches that the restored terrain contains, and the patches and whole survey that it lacks.

        A whole survey that arrives late, but was published before these patches, lacks all of them.
        """
        lack, before = self._before.terrain_lack(), self._configuration.before
        self.terrain.lacks(lack.patches, lack.why_refused, before.read_ns, self._before.stamps.get("terrain/update"))
        self.terrain.holds(before.patches_ns, before.stamps_ns)

    def _continue_stamps(self) -> None:
        """Refuse terrain and areas with older stamps than those before the start."""
        self.guards.continue_from(self._before.stamps)
        restored = self._before.terrain
        if restored is not None:  # patches that are older than the restored terrain are out of date
            self.guards.continue_from({"terrain/update": max(restored.stamp_ns, restored.whole_ns)})

    def activate(self) -> None:
        """Begin to answer sources and to decide on alerts.

        After an earlier activation, messages may have been missed while the node was not active. Therefore areas must
        be published again. The whole terrain must be published again, too, if the node has received patches.
        """
        if self._was_deactivated:
            self._demand_anew()
        self.decisions.resume()
        self._outlets.alerts.forget()
        self.flyer.activate()
        if self.desk is not None:
            self.desk.forget("the node has just been activated and has received no sources yet")
        self.report_waiting()

    def _demand_anew(self) -> None:
        """Report faults that last until all areas and, if there are patches, the whole terrain are published again."""
        self._areas.interrupted(self.watched_area_topics)
        if self.terrain.has_patches:
            self.terrain.refuse("patch", time.time_ns(), stamp_ns=self._outlets.now() or None)
            self._report_terrain()

    def deactivate(self) -> None:
        """Stop answering, and forget waiting sources; received terrain is still processed.

        The last published alert is a fault, because a subscriber of the latched alarm must not take silence for safety.
        If the disk is slow, only the alarm is published as the last message.
        """
        self.flyer.deactivate()
        self.terrain.forget_received()
        self._forget_clicks()
        if self._places is not None:
            self._places.restart()
        self._was_deactivated = True
        if self.desk is not None:
            replies: queue.SimpleQueue[tuple[bool, str]] = queue.SimpleQueue()
            self.desk.forget("the node is not active: it receives nothing and makes no decision", replies.put)
            try:
                replies.get(timeout=LAST_FAULT)
            except queue.Empty:  # the log's disk is slow: the alarm alone is published last
                self.decisions.end_with_alarm()

    def close(self) -> bool:
        """End all threads within COMPUTING + WRITING (s) in total; return True if all have ended.

        Threads that have not ended are abandoned: their results and reports are discarded.
        """
        self.reports.close()
        self.terrain.close()
        ended = _all_end((self.flyer, self.builder), COMPUTING)
        ended &= _all_end([each for each in (self.desk, self._configuration.store) if each is not None], WRITING)
        self._outlets = self._outlets.silenced()
        self.reports.silence(self._outlets)
        self.decisions.close()
        return ended

    def submit(self, trigger: Trigger) -> None:
        """Queue the sources of one message to be answered.

        Places that the topic no longer reports are queued, too. If a full queue drops a trigger of another wall, that
        wall has a fault until the trigger is answered, which happens after all waiting triggers.
        """
        if trigger.topic == BY_HAND:
            self._clicked_s = time.monotonic()
            if self.desk is not None:
                self.desk.clicked(self.sources.region_of(trigger), trigger.stamp_ns)
        for each in [trigger] if self._places is None else self._places.submitted(trigger):
            self._queue(each)
        self.report_waiting()

    def _queue(self, trigger: Trigger) -> None:
        pushed_out = self.flyer.submit(trigger)
        if pushed_out is not None:
            most = self._configuration.parameters.waiting_sources
            self.reports.drop(
                pushed_out, f"more than {most} regions report sources at once: raise waiting_sources or region_size"
            )

    def report_waiting(self) -> None:
        """Report in the diagnostics which input is missing: terrain, or else sources; nothing if both are there."""
        if self.flyer.standing is None:
            self.reports.waiting("terrain")
        elif not self.flyer.has_trigger:
            self.reports.waiting("sources")

    def forget(self, why: str) -> None:
        """Forget all sources, evidence and received patches, because the clock went back.

        why : sentence of the fault that lasts until every topic of sources has published again
        """
        self.terrain.forget_received()
        self.flyer.forget()
        self._forget_clicks()
        if self._places is not None:
            self._places.restart()
        if self.desk is not None:
            self.desk.forget(why)

    def _forget_clicks(self) -> None:
        """Report a fault if a clicked source is forgotten that would still count, because no sensor repeats it."""
        thresholds = self._configuration.thresholds
        if self.desk is None or thresholds is None or self._clicked_s is None:
            return
        if time.monotonic() - self._clicked_s <= thresholds.evidence.sources_max_age_s:
            self.desk.miss(BY_HAND, self._outlets.now())

    def clock_went_back(self, seconds: float) -> None:
        """Accept messages with stamps from after a step back of the clock, and still refuse messages from before it.

        The method is also called while the node is not active. If the step is longer than the time by which stamps may
        be ahead of the clock, the stamps of areas and patches in use may be in the future, and do not show which
        message is newer. Faults then last until the areas with limits and, if patches are known, the whole terrain are
        published again.

        seconds : length of the step (s)
        """
        now = self._outlets.now()
        self.guards.clock_went_back(now)
        self.terrain.clock_went_back(now)
        self.builder.clock_went_back(now)
        if seconds > self._configuration.most_ahead:
            self._demand_anew()

    def beat(self) -> None:
        """Renew a decision that ends soon, repeat the alert, free old patches, report states; call this regularly."""
        if self.desk is not None:
            self.desk.tick()
            self._outlets.alerts.beat()
        self.terrain.drop_old_patches()
        self._report_terrain()
        if self._configuration.store is not None:
            report_store(self._outlets.health, self._configuration.store, self.flyer.standing is not None)
        report_queues(self._outlets.health, self.sources, self.terrain)

    def acknowledged(self, acknowledged_by: str, client: str = "") -> tuple[bool, str]:
        """Acknowledge the alert; return True and a sentence with the new level, or False and why the level stays.

        If the decision is not in the log within ANSWER_WITHIN, return False and TAKEN_UP. The acknowledgement may also
        end faults of refused messages, of places that are no longer reported, and of topics from before the start. It
        then does not lower the level, because the person has seen a fault, not the level that follows.

        acknowledged_by : "NAME: REASON"; client : the nodes that may have called, for the log
        """
        if self.desk is None:
            return False, "no site_file is set, so there are no alerts"
        by, _, why = acknowledged_by.partition(":")
        replies: queue.SimpleQueue[tuple[bool, str]] = queue.SimpleQueue()
        is_named = bool(by.strip() and why.strip())
        alert = self.desk.alert
        shown = alert.faults if alert is not None else ()
        # The desk is asked before the acknowledgement ends any fault: a fault that is shown now makes it void.
        self.desk.acknowledge(by, why, replies.put, client)
        silent = self._refused_inputs.acknowledged(by, time.monotonic(), shown) if is_named else ()
        ended = f"; the faults of refused messages on {', '.join(silent)} have ended" if silent else ""
        gone = self._places.acknowledged(by, shown) if is_named and self._places is not None else ()
        ended += f"; the faults of places that {', '.join(gone)} no longer reports have ended" if gone else ""
        unjudged = self._topics.acknowledged(by, shown) if is_named else ()
        ended += f"; the faults of {', '.join(unjudged)} from before the start have ended" if unjudged else ""
        try:
            acknowledgement(by, why, self._outlets.now())
            lowered, answer = replies.get(timeout=ANSWER_WITHIN)
            return lowered, f"{by.strip()}: {answer}{ended}"
        except InputError as refusal:
            return False, f"{refusal}; set acknowledged_by to NAME: REASON"
        except queue.Empty:
            return False, TAKEN_UP

    def failed(self, error: BaseException) -> None:
        """Report an unforeseen error of a thread; every topic of sources must then publish again."""
        self.reports.failed(error)

    # --- reports of the builder

    def stands(self, ground: LiveTerrain, what: str, holes: int = 0) -> None:
        """Report which terrain is in use, and which patches or surveys it lacks; see `TerrainListener.stands`."""
        report_ground(self._outlets.health, ground, what, holes, self._outlets.now())
        self._report_terrain()
        self.report_waiting()
        self._watch_present()

    def terrain_refused(self, why: str) -> None:
        """Report in the diagnostics why a survey is not used; an outdated terrain is a fault of the alert."""
        self._outlets.health.set("terrain", WARN, f"message refused: {why}")
        self._report_terrain()

    def set_areas(self, topic: str, outlines: Outlines) -> None:
        """Replace the areas of interest of a topic; evidence for their former outlines is outdated.

        outlines : the rings (P, 2) m of each area in plan, map frame, by name; empty if the topic defines no area
        """
        if outlines:
            self._areas.announce(topic)
        self.flyer.set_areas(topic, outlines)
        self._areas.received(topic, bool(outlines))
        self._watch_present()

    def _watch_present(self) -> None:
        if self.desk is not None:
            self.desk.watch(lambda: self.flyer.outlines, lambda: self.flyer.terrain_digest)

    def input_lost(self, topic: str, at_ns: int) -> None:
        """Report a fault because messages of sources were lost before they could be read; at_ns : current time (ns)."""
        if self.desk is not None:
            self.desk.miss(topic, at_ns)

    def input_refused(self, topic: str, why: str) -> None:
        """Report a fault of a topic because a message of sources or areas was refused; why : reason of the refusal.

        `input_understood` or an acknowledgement ends the fault, under the conditions of `RefusedInputs`.
        """
        self._refused_inputs.refused(topic, why, time.monotonic())

    def input_understood(self, topic: str, speakers: Callable[[], int]) -> None:
        """Note an understood message, which ends the fault of its topic under the conditions of `RefusedInputs`.

        speakers : returns the number of publishers of the topic; while there are several, the fault stays
        """
        self._refused_inputs.understood(topic, speakers, time.monotonic(), is_whole=topic in AREA_TOPICS)

    def report_fault(self, cause: str, sentence: str) -> None:
        """Add a fault to all decisions until it ends; do nothing without a site file.

        cause, sentence : as in `StandingFaults.report`; an empty sentence ends the fault
        """
        if self.desk is not None:
            self.desk.standing.report(cause, sentence)

    @property
    def _terrain_lack(self) -> TerrainLack:
        return TerrainLack(patches=self.terrain.lost_patches, why_refused=self.terrain.why_refused)

    def _report_terrain(self) -> None:
        """Report patches and surveys that the terrain lacks as standing faults."""
        lack = self._terrain_lack
        self.report_fault("patches", lack.patches_sentence)
        self.report_fault("surveys", lack.survey_sentence)
