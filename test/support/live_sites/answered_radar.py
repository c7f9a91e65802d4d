"""A radar in tests: a topic of sources with the real checks, regions and queue; only the answers are made by hand."""

import numpy as np

from live_sites.alert_evidence import FLOWN, NOW, S, area, evidence, site
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import untouched
from rpf3d_core.alerts.levels import Level
from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.alerts.first_scans import FirstScans
from rpf3d_ros.alerts.place_checks import PlaceChecks
from rpf3d_ros.alerts.region_evidence import RegionEvidence
from rpf3d_ros.alerts.unreported_evidence import UnreportedEvidence
from rpf3d_ros.engine.answer_schedule import AnswerSchedule
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.waiting_sources import WaitingSources

RADAR = "radar/sources"
A, B, C, D = (0.0, 0.0, 10.0), (10.0, 0.0, 10.0), (20.0, 0.0, 10.0), (30.0, 0.0, 10.0)
FAR = (70.0, 0.0, 10.0)
"""A place in another region than the others."""
DANGER, HARMLESS = area(FLOWN // 2), area()
REGION = 50.0


class Radar:
    """A topic of sources, and all that decides from its messages and answers.

    saved : what `to_remember` of a former radar returned, to continue from it; period : scan period (s), None for none
    """

    def __init__(self, saved=None, period=None):
        self.now_ns, self.dangerous, self.standing = NOW, {A}, {}
        self.site = site(sources_max_age_s=30, scan_period_s=period)
        self.checks = UnreportedEvidence(self.site, lambda: self.now_ns, lambda: None)
        scans = FirstScans(period, 30.0)
        waiting = WaitingSources(REGION, 10, period is not None)
        self.region_of, self.schedule = waiting.region_of, AnswerSchedule(waiting, AnsweredSources(30.0, 40))
        self.places = PlaceChecks(
            self.site, 2.0, self.checks, scans, self.standing.__setitem__, self.schedule.end_unreported
        )
        self.regions = RegionEvidence(self.site.evidence, (), True, (), self.checks, scans)
        if saved is not None:
            self.places.restore(saved.get("places", {}), (RADAR,), saved["dangers"])

    def send(self, second, *places):
        """Send a message with a stamp (s after NOW); return the triggers to answer."""
        self.now_ns = max(self.now_ns, int(NOW + second * S) + S // 10)
        positions = np.array(places, dtype=float).reshape(-1, 3)
        sources = trigger_of(positions, np.zeros_like(positions), None, int(NOW + second * S), RADAR)
        return self.places.submitted(sources)

    def answer(self, *triggers):
        """Answer triggers: with danger if a dangerous place is among the places; without places, no rock flies."""
        for trigger in triggers:
            places = {tuple(place) for place in trigger.positions.tolist()}
            areas = (DANGER if self.dangerous & places else HARMLESS,) if places else untouched([HARMLESS.name])
            found = evidence(
                *areas, trigger_stamp_ns=trigger.stamp_ns, at_ns=self.now_ns, sources_digest=trigger.digest,
                sources=len(places),
            )  # fmt: skip
            self.regions.note(self.region_of(trigger), RADAR, found)

    def queue(self, second, *places):
        """Send a message as `send` does, and put its triggers in the queue."""
        for trigger in self.send(second, *places):
            self.schedule.submit(trigger)

    def fly(self):
        """Answer all triggers in the queue, in its order."""
        while self.fly_one():
            pass

    def fly_one(self):
        """Answer the next trigger in the queue; return False if there is none."""
        if not self.schedule.has_next or (trigger := self.schedule.next_trigger()) is None:
            return False
        self.schedule.begin(trigger, True)
        self.schedule.progress(trigger, True)
        self.answer(trigger)
        return True

    def forget(self):
        """Forget all answers, as after a step back of the clock and after a deactivation."""
        self.places.restart()
        self.regions.forget(self.now_ns)

    def alert(self):
        """Return the decision on the current evidence, without a held level."""
        standing = tuple(sentence for sentence in self.standing.values() if sentence)
        return decide(None, self.regions.fresh(self.now_ns), self.site, self.now_ns, None, standing)

    @property
    def is_green(self):
        """True if neither a level nor a fault is shown."""
        alert = self.alert()
        return alert.evident == Level.NORMAL and not alert.faults
