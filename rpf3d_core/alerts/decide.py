"""Make the decision: a pure function of the previous decision, the evidence, the site's thresholds and the time.

The level rises immediately, falls only by acknowledgement, and is never normal without fresh evidence
(docs/explanation/alerts.md shows the rules as lists). The function `decide` reads no clock and no file, and draws no
random numbers, so `rpf3d audit` can repeat each decision with the same function.
"""

from collections.abc import Mapping
from typing import NamedTuple

from rpf3d_core.alerts.areas import area_alerts, got_worse, undecided, worst_of
from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.evidence_faults import faults_of, went_back
from rpf3d_core.alerts.levels import Acknowledgement, Alert, Level
from rpf3d_core.alerts.limits import LimitFinding, findings_of, is_small_answer, lacks_predictive, without_limits
from rpf3d_core.alerts.outlines import places_end_ns
from rpf3d_core.alerts.persons import Acknowledged, acknowledged_by, waiting_sentences
from rpf3d_core.alerts.since import shown_by, since_of
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.alerts.time_units import ns_of, when


class _Held(NamedTuple):
    """The held level after a decision, and why it is held.

    level : the held level; by : sentences on the areas whose evidence raised the level to this value; () at NORMAL
    since_ns : time (ns) since when the level is held
    void : why the acknowledgement has no effect, "" if it has an effect or there is none
    """

    level: Level
    by: tuple[str, ...]
    since_ns: int
    void: str = ""


def decide(
    previous: Alert | None,
    evidence: Evidence | None,
    thresholds: Thresholds,
    now_ns: int,
    acknowledgement: Acknowledgement | None = None,
    reported: tuple[str, ...] = (),
) -> Alert:
    """Decide on the alert level of the site and its areas at this time, and return the alert for the mine.

    The evidence may contain any numbers, also NaN. The result depends on the parameters only.

    Parameters
    ----------
    previous : Alert or None
        The previous decision; None only if this is the first decision.
    evidence : Evidence or None
        The evidence of the newest answer; None if there is no answer.
    thresholds : Thresholds
        The thresholds of the site.
    now_ns : int
        Time of the decision (ns), by the same clock as the stamps.
    acknowledgement : Acknowledgement or None
        An acknowledgement given since the previous decision. The acknowledgement counts for this decision only.
    reported : tuple of str
        The current faults that do not come from the evidence, such as a refused input.

    Returns
    -------
    Alert
        `valid_until_ns` of a decision without faults is never later than the time at which the evidence becomes stale.
    """
    findings = () if evidence is None else findings_of(evidence, thresholds)
    worst = worst_of(findings)
    evident = max((finding.level for finding in findings), default=Level.NORMAL)
    small = evidence is not None and is_small_answer(evidence, thresholds.evidence)
    faults = tuple(dict.fromkeys((*reported, *faults_of(previous, evidence, thresholds, now_ns))))
    if small and not faults:
        faults = _too_small(previous, evidence, worst, thresholds, now_ns)
    trusted = not faults and not small
    is_worse = previous is None or evident > previous.evident or got_worse(previous, worst)
    void = "" if acknowledgement is None else _why_void(previous, acknowledgement, evident, trusted, is_worse, now_ns)
    acknowledged = acknowledged_by(
        previous, None if void else acknowledgement, thresholds.acknowledge, now_ns, is_reset=bool(faults) or is_worse
    )
    held = _held(previous, evident, findings, now_ns, acknowledgement, void or acknowledged.lacking)
    steps_down = acknowledgement is not None and not held.void
    level = held.level if held.level == Level.EVACUATE or not faults else Level.FAULT
    return Alert(
        level=level,
        held=held.level,
        evident=evident,
        reasons=_reasons(faults, findings, held, evident, evidence, thresholds, acknowledged),
        faults=faults,
        held_by=held.by,
        held_since_ns=held.since_ns,
        worse_ns=now_ns if is_worse or previous is None or went_back(previous, now_ns) else previous.worse_ns,
        at_ns=now_ns,
        valid_until_ns=_valid_until(previous, evidence, worst, thresholds, now_ns, faults, small),
        evidence_at_ns=_newest(previous, evidence, thresholds, now_ns),
        alarm=bool(faults) or held.level >= Level[thresholds.alarm_from.upper()],
        acknowledgement=acknowledgement,
        void=held.void,
        areas=area_alerts(
            previous, None if evidence is None else worst, thresholds, bool(faults), steps_down, small, now_ns
        ),
        since=since_of(level, shown_by(previous, previous), now_ns),
        terrain_digest="" if evidence is None else evidence.terrain_digest,
        terrain_stamp_ns=0 if evidence is None else evidence.terrain_stamp_ns,
        waiting=acknowledged.waiting,
        waiting_until_ns=acknowledged.until_ns,
    )


def _stands(previous: Alert | None, now_ns: int) -> bool:
    """Return True if there is a previous decision that has no faults and is still valid.

    An answer with too few rocks must not replace such a decision.

    now_ns : time of the new decision (ns)
    """
    return previous is not None and not previous.faults and now_ns < previous.valid_until_ns


def _too_small(
    previous: Alert | None,
    evidence: Evidence | None,
    worst: Mapping[str, LimitFinding],
    thresholds: Thresholds,
    now_ns: int,
) -> tuple[str, ...]:
    """Return why an answer with too few rocks is a fault, as sentences; empty if the answer is not a fault.

    Without a valid previous decision, the whole answer is a fault: one sentence. With a valid previous decision, there
    is a sentence for each area on which this decision cannot be kept (`undecided`).

    worst : for each area, by name, the answer's finding with the highest level; now_ns : time of the decision (ns)
    """
    new, stands = undecided(previous, worst, thresholds, now_ns), _stands(previous, now_ns)
    if stands and not new:
        return ()
    areas = () if evidence is None else evidence.areas
    flown = min((area.flown for area in areas), default=0)
    few = f"only {flown:,} rocks have flown (evidence.fewest_rocks: {thresholds.evidence.fewest_rocks:,})"
    if any(lacks_predictive(area, thresholds.evidence) for area in areas):
        few = "too few rocks of each parameter set have flown for a predictive interval"
    if stands:
        return tuple(f"{name}: {few}, and no earlier decision on this area is valid" for name in new)
    return (f"{few}, and no earlier decision is valid",)


def _held(
    previous: Alert | None,
    evident: Level,
    findings: tuple[LimitFinding, ...],
    now_ns: int,
    acknowledgement: Acknowledgement | None,
    void: str,
) -> _Held:
    """Return the held level after this decision: it rises immediately, and falls only by a valid acknowledgement.

    evident : the level that the evidence gives by itself; findings : level and reason for each area
    now_ns : time of the decision (ns)
    void : why the acknowledgement has no effect, "" if it has an effect or there is none
    """
    sentences = tuple(finding.sentence for finding in findings if finding.level == evident and evident > Level.NORMAL)
    before = Level.NORMAL if previous is None else previous.held
    if evident > before or previous is None:
        return _Held(level=evident, by=sentences, since_ns=now_ns, void=void)
    if acknowledgement is not None and not void:
        return _Held(level=evident, by=sentences, since_ns=now_ns)
    return _Held(level=before, by=previous.held_by, since_ns=min(previous.held_since_ns, now_ns), void=void)


def _why_void(
    previous: Alert | None,
    acknowledgement: Acknowledgement,
    evident: Level,
    trusted: bool,
    is_worse: bool,
    now_ns: int,
) -> str:
    """Return why an acknowledgement cannot lower the held level; "" if it can, once enough persons have acknowledged.

    previous : the previous decision; evident : the level that the evidence gives by itself
    trusted : True if the evidence is believed and enough rocks flew; is_worse : True if the evidence got worse
    now_ns : time of the decision (ns)
    """
    if previous is None or previous.held == Level.NORMAL:
        return "no level above normal is held, so there is nothing to lower"
    if not acknowledgement.by.strip() or not acknowledgement.why.strip():
        return "it has no name or no reason"
    if not trusted:
        return "the evidence has a fault, or too few rocks have flown yet; acknowledge again when this has ended"
    if acknowledgement.at_ns > now_ns:
        return "its time is in the future"
    if is_worse or acknowledgement.at_ns < previous.worse_ns:
        return "the evidence has become worse since it was given; look at the alert, then acknowledge again"
    if evident >= previous.held:
        return f"the evidence still gives {evident.word}; acknowledge again when it gives a lower level"
    return ""


def _newest(previous: Alert | None, evidence: Evidence | None, thresholds: Thresholds, now_ns: int) -> int | None:
    """Return the time (ns) of the newest answer of this and all earlier decisions; None if there was no answer.

    An answer from the future is ignored. If the clock was set back, answers of earlier decisions are ignored.

    now_ns : time of the decision (ns)
    """
    before = None if previous is None or went_back(previous, now_ns) else previous.evidence_at_ns
    if evidence is None or evidence.at_ns > now_ns + ns_of(thresholds.evidence.clock_tolerance_s):
        return before
    return evidence.at_ns if before is None else max(before, evidence.at_ns)


def _valid_until(
    previous: Alert | None,
    evidence: Evidence | None,
    worst: Mapping[str, LimitFinding],
    thresholds: Thresholds,
    now_ns: int,
    faults: tuple[str, ...],
    small: bool,
) -> int:
    """Return until when (ns) the mine may rely on the decision: `valid_s` from now, at most until evidence is too old.

    The age of the evidence does not matter for a decision with faults. Otherwise the decision ends when any part of the
    evidence becomes too old, or when a sensor becomes silent for too long (`complete_until_ns`). An answer with too few
    rocks does not extend the validity of the previous decision.

    worst : for each area, by name, the answer's finding with the highest level; small : True if too few rocks flew
    now_ns : time of the decision (ns)
    """
    until = now_ns + ns_of(thresholds.valid_s)
    if evidence is None or faults:
        return until
    fresh = (
        evidence.trigger_stamp_ns + ns_of(thresholds.evidence.sources_max_age_s),
        evidence.terrain_stamp_ns + ns_of(thresholds.evidence.terrain_max_age_s),
    )
    until = min(until, *fresh, *places_end_ns(previous, worst, evidence, thresholds, small))
    if evidence.complete_until_ns:
        until = min(until, max(evidence.complete_until_ns, now_ns))
    return min(until, previous.valid_until_ns) if small and previous is not None else until


def _reasons(
    faults: tuple[str, ...],
    findings: tuple[LimitFinding, ...],
    held: _Held,
    evident: Level,
    evidence: Evidence | None,
    thresholds: Thresholds,
    acknowledged: Acknowledged,
) -> tuple[str, ...]:
    """Return why the alert has its level, as sentences for the mine; the most important reasons are first.

    The order is: faults, why an acknowledgement has no effect, acknowledgements that wait for another person, why the
    level is held, the findings for the areas (highest level first), the notes of the evidence, and the areas without
    limits. If `evacuate` is held, the faults follow after the findings.

    findings : level and reason for each area; held : the held level after this decision
    evident : the level that the evidence gives by itself
    acknowledged : the acknowledgements after this decision
    """
    sentences = tuple(finding.sentence for finding in sorted(findings, key=lambda finding: -finding.level))
    holding: tuple[str, ...] = ()
    if held.level > evident:
        since = f"{held.level.word} has been held since {when(held.since_ns)} and falls only after an acknowledgement"
        holding = (f"{since}: {', '.join(held.by)}",)
    counts = "does not count alone" if acknowledged.lacking else "does not count"
    void = (f"the acknowledgement {counts}: {held.void}",) if held.void else ()
    void = (*void, *waiting_sentences(acknowledged))
    unwatched = () if evidence is None else without_limits(evidence, thresholds)
    unlimited = tuple(f"{name}: the site file has no limits for this area" for name in unwatched)
    notes = unlimited if evidence is None else (*evidence.notes, *unlimited)
    if held.level == Level.EVACUATE:
        return (*void, *holding, *sentences, *faults, *notes)
    return (*faults, *void, *holding, *sentences, *notes)
