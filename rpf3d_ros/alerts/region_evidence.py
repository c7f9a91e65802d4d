"""Keep the evidence of each region (wall), and combine all evidence that is not too old for a decision."""

from collections.abc import Hashable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.limits import is_small_answer
from rpf3d_core.alerts.site_model import EvidenceSpec
from rpf3d_core.alerts.time_units import ns_of
from rpf3d_core.live.evidence import together
from rpf3d_core.live.outlines import WatchedOutlines
from rpf3d_ros.alerts.first_scans import FirstScans
from rpf3d_ros.alerts.regions import unreported_region
from rpf3d_ros.alerts.source_topics import ANY_STAMP, BY_HAND, SourceTopics
from rpf3d_ros.alerts.unreported_evidence import UnreportedEvidence
from rpf3d_ros.alerts.watched_terrain import WatchedTerrain
from rpf3d_ros.messages.stamps import SECOND


class TopicEvidence(NamedTuple):
    """Evidence, and the topic on which its sources were received.

    judged : an earlier answer of the region, if too few rocks flew for `evidence`: the last answer with enough rocks,
        or else the first answer; None if enough rocks flew, or if there is no earlier answer
    """

    topic: str
    evidence: Evidence
    judged: Evidence | None = None

    @property
    def over_ground(self) -> Evidence:
        """The answer whose terrain counts as the terrain of this region.

        An answer with too few rocks does not count if there is an earlier answer.
        """
        return self.evidence if self.judged is None else self.judged

    @property
    def stamp_ns(self) -> int:
        """Stamp of the sources (ns)."""
        return self.evidence.trigger_stamp_ns

    def clears(self, other: "TopicEvidence") -> bool:
        """True if `other` has the same topic and an older stamp, so that this evidence replaces `other`.

        Call this for evidence without sources only. If the stamps are equal, the sources of `other` still count.
        """
        return other.topic == self.topic and other.stamp_ns < self.stamp_ns


def _of_topic(every: Sequence[TopicEvidence], topic: str) -> list[Evidence]:
    """Return the evidence of a topic; every : the evidence of all topics."""
    return [kept.evidence for kept in every if kept.topic == topic]


class RegionEvidence:
    """The last evidence of each region, that is of each wall, and the topics that have reported."""

    def __init__(
        self, terms: EvidenceSpec, expected: Sequence[str] = (), has_sensors: bool = False, heard: Sequence[str] = (),
        unreported: UnreportedEvidence | None = None, scans: FirstScans | None = None,
    ) -> None:  # fmt: skip
        """Begin without evidence.

        terms : the conditions of the site for evidence; expected, has_sensors, heard : as in `SourceTopics`
        unreported : the answers to places that their topic no longer reports; None if there can be none
        scans : the first scan of each topic; None if each message has all places of its topic
        """
        self._unreported, self._scans = unreported, scans or FirstScans(None, terms.sources_max_age_s)
        self._terms = terms
        self._max_age_ns = int(terms.sources_max_age_s * SECOND)
        self._ground = WatchedTerrain(terms.changed_terrain_s)
        self._evidence: dict[Hashable, TopicEvidence] = {}
        self._newest_at_ns = 0
        self._clicks: dict[Hashable, int] = {}  # stamp of each click that has no answer yet (ns), by region
        self._topics = SourceTopics(expected, has_sensors, heard, ns_of(terms.scan_period_s or 0.0))
        self._outlines = WatchedOutlines()

    @property
    def heard(self) -> tuple[str, ...]:
        """The topics of sensors that have published, also before a restart, sorted."""
        return self._topics.heard

    @property
    def missed(self) -> dict[str, int]:
        """The time (ns) at which messages were last lost, by topic; `fresh` drops losses that are too old to count."""
        return self._topics.missed

    def note(self, region: Hashable, topic: str, evidence: Evidence) -> None:
        """Keep the evidence of a region, unless newer evidence of the region is already kept.

        Evidence without sources removes older evidence of its topic. Of evidence without sources and without faults,
        only the last is kept. In any case, note that the topic has published.

        Evidence on the unreported places of a topic goes to `UnreportedEvidence` only.
        """
        if self._unreported is not None and region == unreported_region(topic):
            self._unreported.note(topic, evidence)
            return
        self._topics.note(topic, evidence.trigger_stamp_ns)
        self._scans.answered(topic, evidence.trigger_stamp_ns)
        if self._unreported is not None:
            self._unreported.note_reported(topic, evidence, self._scans.is_complete(topic))
        known = self._evidence.get(region)
        new = TopicEvidence(topic, evidence, None if known is None else self._judged_before(evidence, known))
        if known is not None and new.stamp_ns < known.stamp_ns:
            return  # newer sources of the wall are being answered, or have no answer
        self._newest_at_ns = max(self._newest_at_ns, evidence.at_ns)
        others = {wall: kept for wall, kept in self._evidence.items() if wall != region}
        if not evidence.sources:
            counts = {wall: kept for wall, kept in others.items() if kept.evidence.sources or kept.evidence.faults}
            others = {wall: kept for wall, kept in counts.items() if not new.clears(kept)}
        self._evidence = {**others, region: new}
        if self._clicks.get(region, ANY_STAMP) <= new.stamp_ns:
            self._clicks.pop(region, None)

    def clicked(self, region: Hashable, stamp_ns: int) -> None:
        """Note a click before it is answered; any thread may call, even before an earlier click is answered.

        Until it has an answer, an earlier click at the same place counts, even if it becomes too old.

        stamp_ns : stamp of the click (ns)
        """
        self._clicks[region] = stamp_ns

    def watch(self, outlines: Mapping[str, str], terrain: str | None, now_ns: int) -> None:
        """Set the current areas and terrain; evidence for other outlines or terrains is outdated from now (ns) on.

        Any thread may call this method.

        outlines : for each area, by name, the digest of its outline
        terrain : digest of the terrain, "" without terrain; None if the terrain is not watched
        """
        self._outlines.watch(outlines, now_ns)
        if self._unreported is not None:
            self._unreported.watch(outlines)
        if terrain is not None:
            self._ground.watch(terrain, now_ns)

    def miss(self, topic: str, now_ns: int) -> None:
        """Record that messages of a topic were lost before they could be read; now_ns : current time (ns)."""
        self._topics.miss(topic, now_ns)

    def __len__(self) -> int:
        """Return the number of regions with evidence."""
        return len(self._evidence)

    def fresh(self, now_ns: int) -> Evidence | None:
        """Return the evidence of all regions, combined into one for a decision at `now_ns` (ns); None without evidence.

        Stale evidence is forgotten: a later message of its sensor may have reported other sources. If the sensor has
        reported nothing later, its silence is a fault. If all evidence is stale, the newest evidence counts. Evidence
        of a click also counts until a later click at the same place is answered.
        If other evidence has sources, only the faults count of evidence without sources. `outdated` of the result lists
        each area whose current outline is missing in the evidence of a region. `faults` of the result also names silent
        topics, lost messages, incomplete first scans, dangerous unreported places, and answers over the former terrain.
        """
        if not self._evidence:
            return None
        oldest = min(now_ns - self._max_age_ns, max(kept.stamp_ns for kept in self._evidence.values()))
        clicks = {wall: stamp for wall, stamp in dict(self._clicks).items() if stamp >= oldest}
        self._evidence = {
            wall: kept for wall, kept in self._evidence.items() if kept.stamp_ns >= oldest or wall in clicks
        }
        every = list(self._evidence.values())
        failed = [fault for kept in every if not kept.evidence.sources for fault in kept.evidence.faults]
        every = [kept for kept in every if kept.evidence.sources] or every
        parts, grounds = [kept.evidence for kept in every], [kept.over_ground for kept in every]
        known = self._outlines.described(together(parts))
        own = dict.fromkeys((*known.faults, *failed))
        faults = (*own, *self._topics.silent(oldest, now_ns), *self._scans.faults())
        if self._unreported is not None:
            shown = partial(_of_topic, every)
            faults = (*faults, *self._unreported.faults(shown).values())
            unreported = self._unreported.parts()
            parts, grounds = [*parts, *unreported], [*grounds, *unreported]
        faults = (*faults, *self._ground.faults(grounds, now_ns))
        # The newest evidence may have been dropped, but its time of arrival also applies to the remaining evidence.
        at_ns, outdated = max(known.at_ns, self._newest_at_ns), self._outlines.outdated(parts)
        return known._replace(
            at_ns=at_ns, faults=faults, outdated=outdated, complete_until_ns=self._complete_until_ns(grounds)
        )

    def _judged_before(self, evidence: Evidence, known: TopicEvidence) -> Evidence | None:
        """Return the earlier answer for `TopicEvidence.judged`; None if enough rocks flew for the new evidence.

        This is the last answer of the region with enough rocks, or else its first answer; None if there is no answer.

        evidence : the new evidence; known : the evidence of the region until now
        """
        if not is_small_answer(evidence, self._terms):
            return None
        before = known.judged or known.evidence
        return before if before.areas else None

    def _complete_until_ns(self, grounds: Sequence[Evidence]) -> int:
        """Return the time (ns) at which the first fault begins if no further message arrives; 0 if no fault will begin.

        grounds : the evidence whose terrain is compared with the current terrain

        The fault is a topic that falls silent, an answer that still counts too long after its terrain was replaced, or
        places that are no longer reported and have had no answer for too long.
        """
        first_ns = self._topics.oldest_ns
        silent_ns = [] if first_ns is None else [first_ns + self._max_age_ns]
        unanswered_ns = [] if self._unreported is None else self._unreported.ends_ns()
        return min([*silent_ns, *unanswered_ns, *self._ground.ends_ns(grounds)], default=0)

    def forget(self, now_ns: int) -> None:
        """Forget all evidence and stamps, for example because the clock went back; every topic must publish again.

        now_ns : current time (ns); earlier times are invalid
        """
        self._clear()
        self._topics.forget()
        if self._unreported is not None:
            self._unreported.forget()
        self._outlines.restart(now_ns)
        self._ground.restart(now_ns)

    def lose(self) -> None:
        """Forget all evidence because of an error of the program: every topic must publish again.

        A lost source of topic `clicked_point` is a fault until the source would be too old.
        """
        clicks = [kept.stamp_ns for kept in self._evidence.values() if kept.topic == BY_HAND]
        self._clear()
        self._topics.lose(max(clicks, default=None))
        if self._unreported is not None:
            self._unreported.lose()

    def _clear(self) -> None:
        self._evidence.clear()
        self._clicks.clear()
        self._newest_at_ns = 0
