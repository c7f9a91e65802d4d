"""Properties of every decision, for any evidence, earlier decisions and time (Hypothesis)."""

import json

from hypothesis import given
from hypothesis import strategies as st
from live_sites.alert_evidence import NOW, RAMP, S, area, decided, evidence, later, seen_by, site
from suite.property_budget import examples

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import AreaEvidence, Evidence, Outdated
from rpf3d_core.alerts.levels import Acknowledgement, Alert, AreaAlert, Judged, Level, Since
from rpf3d_core.alerts.lines import Decision, canonical, decision_content, decision_of
from rpf3d_core.alerts.origins import Origin, Origins
from rpf3d_core.alerts.site_model import AcknowledgeSpec
from rpf3d_core.ensemble.statistics import wilson_interval

SITES = [
    site(), site(reach_probability_is="share"), site({"r*": RAMP, "crusher": {"evacuate": {"p95_energy_j": 5e4}}}),
    site({"?": RAMP}), site(fewest_rocks=20_000),
    site().model_copy(update={"acknowledge": AcknowledgeSpec(persons=2, within_s=50.0)}),
]  # fmt: skip

floats = st.one_of(st.floats(), st.sampled_from([0.0, -0.0, 1.0, 5e4, 1e5, 10.0]))
counts = st.one_of(st.integers(), st.integers(0, 20_000), st.sampled_from([0, 1, 999, 1000, 10_000, 2**63]))
stamps = st.one_of(st.integers(NOW - 100 * S, NOW + 2 * S), st.integers(NOW - 3 * S, NOW), st.integers())
times = st.just(NOW) | stamps
texts = st.sampled_from(["ramp", "crusher", "", "\ud800", "r"])
places = st.floats(allow_nan=False)
any_origin = st.builds(Origin, texts, st.tuples(places, places, places), counts, texts, texts, stamps)
any_origins = st.builds(Origins, *[st.none() | any_origin] * len(Origins._fields))
any_area = st.builds(
    AreaEvidence, texts, counts, counts, floats, floats, st.none() | floats, st.none() | floats, st.none() | floats,
    origins=st.none() | any_origins, outline=texts, outlined_ns=stamps,
)  # fmt: skip
any_since = st.none() | st.builds(Since, stamps, st.none() | stamps)
any_evidence = st.builds(
    Evidence, counts, counts, stamps, stamps, stamps, texts, texts, counts, counts, texts,
    st.lists(any_area, max_size=3).map(tuple), st.lists(texts, max_size=1).map(tuple), counts,
    st.lists(st.builds(Outdated, texts, stamps), max_size=2).map(tuple),
)  # fmt: skip
some_acknowledgement = st.none() | st.builds(Acknowledgement, st.sampled_from(["A. Shift", " "]), texts, stamps)
dangers = st.sampled_from([Level.NORMAL, Level.WATCH, Level.RESTRICT, Level.EVACUATE])
any_areas = st.lists(
    st.builds(
        AreaAlert, texts, st.sampled_from(list(Level)), dangers, dangers, texts, any_since, st.none() | any_origin,
        st.none() | st.builds(Judged, texts, st.none() | stamps),
    ),
    max_size=3,
    unique_by=lambda one: one.name,
).map(tuple)
any_waiting = st.builds(Acknowledgement, st.sampled_from(["A. Shift", "B."]), texts, stamps)
any_alert = st.builds(
    Alert, st.sampled_from(list(Level)), dangers, dangers, st.just(("said",)), st.sampled_from([(), ("broken",)]),
    st.just(()), stamps, stamps, stamps, stamps, st.none() | stamps, st.booleans(), areas=any_areas,
    since=any_since, terrain_digest=texts, terrain_stamp_ns=stamps,
    waiting=st.lists(any_waiting, max_size=1).map(tuple),
)  # fmt: skip
NUMBERS_OF_AREA = [name for name in AreaEvidence._fields if name not in ("name", "origins", "outline")]
sites = st.sampled_from(SITES)
many = examples(300)


@st.composite
def sound_areas(draw: st.DrawFn) -> AreaEvidence:
    """Draw consistent evidence of the ramp from 2,000 rocks."""
    reached = draw(st.integers(0, 500))
    if reached == 0:
        return area(0, flown=2000)
    largest = draw(st.floats(0.0, 2e5))
    p95 = draw(st.none() | st.floats(0.0, largest))
    return area(reached, flown=2000, largest_energy=largest, p95_energy=p95, first_arrival_s=draw(st.floats(0.0, 30.0)))


@st.composite
def worse_pairs(draw: st.DrawFn) -> tuple[AreaEvidence, AreaEvidence]:
    """Draw evidence of an area, and of the same area with more rocks, more energy or an earlier arrival."""
    one = draw(sound_areas())
    reached = draw(st.integers(one.reached, 600))
    if reached == 0:
        return one, one
    low, high = wilson_interval(reached, 2000)
    largest = draw(st.floats(one.largest_energy or 0.0, 3e5))
    told = None if one.reached > 0 and one.p95_energy is None else draw(st.floats(one.p95_energy or 0.0, largest))
    arrival = draw(st.floats(0.0, 30.0 if one.first_arrival_s is None else one.first_arrival_s))
    worse = AreaEvidence("ramp", 2000, reached, low, high, told, largest, arrival)
    return one, worse


@st.composite
def spoiled(draw: st.DrawFn) -> Evidence:
    """Draw consistent evidence of which at most one value is replaced by an arbitrary one."""
    one = draw(sound_areas())
    spoilt = draw(st.sampled_from([None, *NUMBERS_OF_AREA, *Evidence._fields[2:5], "sources", "unfinished"]))
    if spoilt in AreaEvidence._fields:
        kind = counts if spoilt in ("flown", "reached") else stamps if spoilt == "outlined_ns" else floats
        return evidence(one._replace(**{spoilt: draw(kind)}))
    return evidence(one, **({} if spoilt is None else {spoilt: draw(counts if "_ns" not in spoilt else stamps)}))


evidences = st.none() | any_evidence | spoiled()


@many
@given(st.none() | any_alert, evidences, sites, times, some_acknowledgement)
def test_every_evidence_gets_a_decision_and_always_the_same(previous, answer, thresholds, now, given) -> None:
    alert = decide(previous, answer, thresholds, now, given)
    assert alert == decide(previous, answer, thresholds, now, given)
    assert alert.reasons
    assert alert.held != Level.FAULT != alert.evident
    assert alert.level in (alert.held, Level.FAULT)
    assert alert.alarm >= bool(alert.faults)
    assert alert.valid_until_ns >= now


@many
@given(st.none() | any_alert, evidences, sites, times, some_acknowledgement)
def test_a_decision_comes_back_from_its_line_bit_for_bit(previous, answer, thresholds, now, given) -> None:
    alert = decide(previous, answer, thresholds, now, given)
    written = canonical(decision_content(Decision(previous, answer, given, now, alert)))

    back = decision_of(json.loads(written))
    assert canonical(decision_content(back)) == written
    assert decide(back.previous, back.evidence, thresholds, back.now_ns, back.acknowledgement) == alert == back.alert


@many
@given(st.none() | any_alert, evidences, sites, times, some_acknowledgement)
def test_normal_is_said_only_on_fresh_evidence(previous, answer, thresholds, now, given) -> None:
    alert = decide(previous, answer, thresholds, now, given)
    if alert.level == Level.NORMAL:
        terms = thresholds.evidence
        assert answer is not None and not answer.faults and alert.evident == Level.NORMAL
        assert now - answer.trigger_stamp_ns <= terms.sources_max_age_s * S
        assert now - answer.terrain_stamp_ns <= terms.terrain_max_age_s * S
        ahead = terms.clock_tolerance_s * S
        assert max(answer.at_ns, answer.trigger_stamp_ns, answer.terrain_stamp_ns) <= now + ahead
        assert alert.valid_until_ns - answer.trigger_stamp_ns <= terms.sources_max_age_s * S


@many
@given(any_alert, evidences, sites, times)
def test_nothing_steps_down_without_an_acknowledgement(previous, answer, thresholds, now) -> None:
    alert = decide(previous, answer, thresholds, now)
    assert alert.held >= previous.held
    if previous.level == previous.held:
        assert alert.level.severity >= previous.level.severity


@many
@given(any_alert, evidences, sites, times, some_acknowledgement)
def test_with_an_acknowledgement_it_falls_no_lower_than_the_evidence(previous, answer, thresholds, now, given) -> None:
    alert = decide(previous, answer, thresholds, now, given)
    assert alert.held >= alert.evident
    if alert.held < previous.held:
        assert given is not None and given.by.strip() and given.why.strip()
        assert alert.held == alert.evident and not alert.faults and not alert.void
        assert previous.worse_ns <= given.at_ns <= now and alert.evident <= previous.evident
        others = [one.by for one in previous.waiting if one.by != given.by and 0 <= now - one.at_ns <= 50 * S]
        assert thresholds.acknowledge.persons == 1 or others


@many
@given(worse_pairs(), st.none() | any_alert, sites, st.booleans())
def test_worse_evidence_never_gives_a_lower_level(pair, previous, thresholds, acknowledged) -> None:
    if previous is not None:
        previous = previous._replace(at_ns=min(previous.at_ns, NOW))
    given = seen_by(NOW) if acknowledged else None
    better, worse = (decide(previous, evidence(one), thresholds, NOW, given) for one in pair)
    assert better.evident <= worse.evident
    assert better.held <= worse.held
    assert better.level.severity <= worse.level.severity


@many
@given(st.lists(sound_areas(), min_size=1, max_size=6), st.lists(st.booleans(), min_size=6, max_size=6))
def test_over_a_whole_shift_the_level_is_the_highest_since_the_last_step_down(areas, acknowledged) -> None:
    alert, highest = decided(evidence()), Level.NORMAL
    for step, one in enumerate(areas, start=1):
        now = NOW + step * S
        alert = decide(alert, later(evidence(one), step), site(), now, seen_by(now) if acknowledged[step - 1] else None)
        stepped_down = alert.acknowledgement is not None and not alert.void
        highest = alert.evident if stepped_down else max(highest, alert.evident)
        assert (alert.level, alert.held, alert.faults) == (highest, highest, ())


@many
@given(st.none() | any_alert, evidences, sites, times, some_acknowledgement)
def test_a_level_is_shown_since_a_time_that_has_passed_and_no_longer_than_it_is_not_normal(
    previous, answer, thresholds, now, given
) -> None:
    alert = decide(previous, answer, thresholds, now, given)
    for one in (alert, *alert.areas):
        assert one.since.level_ns <= now
        assert (one.since.not_normal_ns is None) == (one.level == Level.NORMAL)
        assert one.since.not_normal_ns is None or one.since.not_normal_ns <= now


@many
@given(any_alert, evidences, sites, times)
def test_no_area_steps_down_or_is_forgotten_without_an_acknowledgement(previous, answer, thresholds, now) -> None:
    alert = decide(previous, answer, thresholds, now)
    told = {area.name: area for area in alert.areas}
    assert len(told) == len(alert.areas)
    for before in previous.areas:
        if before.held > Level.NORMAL:
            assert told[before.name].held >= before.held
        elif alert.faults:
            assert before.name in told
    for area_alert in alert.areas:
        assert area_alert.held >= area_alert.evident
        is_unknown = bool(alert.faults) and area_alert.held < Level.EVACUATE
        assert area_alert.level == (Level.FAULT if is_unknown else area_alert.held)


@many
@given(st.none() | any_alert, evidences, sites, times, some_acknowledgement)
def test_an_area_is_said_to_be_normal_only_where_enough_rocks_flew_or_a_decision_on_it_stands(
    previous, answer, thresholds, now, given
) -> None:
    alert = decide(previous, answer, thresholds, now, given)
    standing = {one.name for one in previous.areas} if previous is not None and not previous.faults else set()
    for one in alert.areas:
        if one.level == Level.NORMAL:
            assert not alert.faults and answer is not None
            told = [area for area in answer.areas if area.name == one.name]
            enough = answer.sources == 0 or all(area.flown >= thresholds.evidence.fewest_rocks for area in told)
            assert one.name in standing or (told and enough)


@many
@given(st.lists(st.tuples(evidences, st.booleans()), min_size=1, max_size=6), sites)
def test_what_is_held_of_the_site_is_the_highest_that_is_held_of_its_areas(shift, thresholds) -> None:
    alert = None
    for step, (answer, is_acknowledged) in enumerate(shift):
        now = NOW + step * S
        alert = decide(alert, answer, thresholds, now, seen_by(now) if is_acknowledged else None)
        assert alert.held == max((one.held for one in alert.areas), default=Level.NORMAL)
        assert alert.evident == max((one.evident for one in alert.areas), default=Level.NORMAL)
        assert set(thresholds.named_in_full) <= {one.name for one in alert.areas}
