"""Tests that a killed and restarted node still has what it knew before, or the level is a fault."""

import fcntl
import os
import shutil
from dataclasses import replace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from never_green import combination, pit
from never_green.combination import Run, configuration_of
from never_green.plan import Plan, Send, Speaker, Truth
from never_green.stories import MAX_AGE, RADAR_A, RADAR_B, patch_send, survey
from programs.waiting import wait_for

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.site_model import AcknowledgeSpec, Thresholds
from rpf3d_ros.alerts import unreported_places
from rpf3d_ros.alerts.areas_before import AreasBefore
from rpf3d_ros.alerts.topics_before import TopicsBefore, unjudged_topics
from rpf3d_ros.alerts.unknown_before import ADVICE, UnknownBefore
from rpf3d_ros.engine.configuration import _log_of
from rpf3d_ros.engine.terrain_faults import TerrainBefore
from rpf3d_ros.messages.stamps import SECOND

TRUTH = Truth(sources=(), bank_until=np.inf, areas=(pit.outline(pit.ROAD),) * 2, area_since=0.0)
TOPICS = (RADAR_A, RADAR_B, "terrain/points", "terrain/update", "areas/polygon", "areas/equipment")
PLAN = Plan(
    truth=TRUTH, sends=(), speakers=tuple(Speaker(topic=topic, number=0) for topic in TOPICS),
    sensors=(RADAR_A, RADAR_B), limits="restrict", expects=False,
)  # fmt: skip
WHOLE = Send(sent=0.1, at=0.1, topic="terrain/points", kind="grid", places=survey(TRUTH, 0.1))
ROAD = Send(sent=0.2, at=0.2, topic="areas/polygon", kind="polygon", places=pit.outline(pit.ROAD))
QUIET = Send(sent=0.3, at=0.3, topic=RADAR_A, kind="poses", places=np.empty((0, 3)))
DANGER = QUIET._replace(places=pit.placed(10.0, 20.0, 31.0)[None])
PATCH = patch_send(TRUTH, 0.4, ((16.0, 24.0), (8.0, 24.0)))
MACHINE = Send(sent=0.2, at=0.2, topic="areas/equipment", kind="poses", places=pit.placed(48.0, 20.0, 0.0)[None])


class Mine:
    """Starts nodes one after another with the same decision log, and sends them messages at increasing times."""

    def __init__(self, folder, thresholds):
        self.folder, self.thresholds = folder, thresholds
        self.at, self.run = 0.0, None
        self.changed = {}  # parameters of the nodes that start from now on

    def configured(self, plan):
        made = configuration_of(plan)
        parameters = replace(made.parameters, **self.changed)
        log, fault = _log_of(replace(parameters, decision_log=str(self.folder), site_file=str(self.folder)))
        thresholds = made.thresholds if self.thresholds is None else self.thresholds
        before = TerrainBefore(read_ns=round((1e9 + self.at + 0.05) * SECOND))
        return replace(made, parameters=parameters, log=log, log_fault=fault, thresholds=thresholds, before=before)

    def restart(self, has_survey=True):
        """Stop the node, if one runs, without a further decision, as a kill does; then start a new node."""
        if self.run is not None:
            self.run.node.station.close()
            self.run.node._patches.close()
        self.run = Run(PLAN)
        if has_survey:
            self.send(WHOLE)

    def send(self, *sends):
        """Send messages, one every 0.1 s; return the last alert."""
        for send in sends:
            self.at += 0.1
            self.run.deliver(send._replace(sent=self.at, at=self.at))
            self.run.node.tick()
        return self.alert

    def stay_quiet(self, seconds, topics=(RADAR_B, RADAR_A)):
        """Let radars see nothing for some seconds; return the last alert."""
        until = self.at + seconds
        while self.at < until:
            self.send(*(QUIET._replace(topic=topic) for topic in topics))
        return self.alert

    @property
    def alert(self):
        return self.run.node.station.desk.alert

    def acknowledge(self, by="A. Shift"):
        self.run.node.station.acknowledged(f"{by}: looked at every area")
        self.run.node.settle()
        return self.alert


@pytest.fixture
def mine(monkeypatch, tmp_path, request):
    made = Mine(tmp_path / "decisions", getattr(request, "param", None))
    monkeypatch.setattr(combination, "configuration_of", made.configured)
    made.restart()
    yield made
    made.run.node.close()


def pattern_site():
    """Return the site thresholds of the campaign, with areas named by patterns as in site_example.yaml."""
    values = combination.site_values("restrict", has_machines=True)
    return Thresholds.model_validate({**values, "areas": {f"{each}*": it for each, it in values["areas"].items()}})


def locked(mine):
    mine.lock = os.open(mine.folder, os.O_RDONLY | os.O_DIRECTORY)
    fcntl.flock(mine.lock, fcntl.LOCK_EX | fcntl.LOCK_NB)


def damaged(mine):
    path = sorted(mine.folder.glob("*.jsonl"))[-1]
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 3].ljust(len(whole), b"\0"))


def gone(mine):
    shutil.rmtree(mine.folder)


@pytest.mark.parametrize("harm", [locked, damaged, gone], ids=lambda harm: harm.__name__)
def test_of_a_log_that_cannot_be_continued_the_level_is_a_fault_until_a_person_acknowledges(mine, harm):
    assert mine.send(ROAD, QUIET, DANGER).held == Level.RESTRICT
    mine.run.node.station.close()
    harm(mine)
    mine.restart()
    alert = mine.send(ROAD, QUIET)
    assert alert.level == Level.FAULT and ADVICE in alert.faults[0]
    alert = mine.acknowledge()
    assert (alert.level, alert.faults) == (Level.NORMAL, ())
    if harm is locked:
        os.close(mine.lock)
        mine.restart()
        assert "not in the log" in mine.send(ROAD, QUIET).faults[0], "what was decided meanwhile is in no log"
        assert mine.acknowledge().faults == ()
    mine.restart()
    assert mine.send(ROAD, QUIET).faults == ()


def test_an_acknowledgement_of_an_unknown_level_counts_only_when_nothing_else_is_a_fault(mine):
    mine.send(ROAD, QUIET, DANGER)
    mine.run.node.station.close()
    gone(mine)
    mine.restart()
    assert ADVICE in mine.acknowledge().faults[0], "no sensor has reported yet"
    alert = mine.send(ROAD, DANGER)
    assert (alert.level, alert.held) == (Level.FAULT, Level.RESTRICT)
    alert = mine.acknowledge()
    assert (alert.level, alert.held) == (Level.RESTRICT, Level.RESTRICT), "it lowers nothing by itself"
    mine.send(QUIET)
    assert mine.acknowledge().level == Level.NORMAL
    assert audit_log(mine.folder).sound


@pytest.mark.parametrize("mine", [pattern_site()], indirect=True)
def test_an_area_of_a_pattern_is_a_fault_after_a_restart_until_its_topic_publishes_again(mine):
    assert mine.send(ROAD, MACHINE, QUIET).faults == ()
    for _ in range(2):
        mine.restart()
        faults = mine.send(ROAD, QUIET).faults
        assert len(faults) == 1 and "nothing has been received on areas/equipment since the start" in faults[0]
    assert mine.send(MACHINE, QUIET).faults == ()
    mine.send(MACHINE._replace(places=np.empty((0, 3))))
    mine.restart()
    assert mine.send(ROAD, QUIET).faults == (), "the machines had left before"


@pytest.mark.parametrize("mine", [pattern_site()], indirect=True)
@pytest.mark.parametrize("bad", [
    ROAD._replace(places=np.array([[-5.0, -9.0], [5.0, 9.0], [5.0, -9.0], [-5.0, 9.0]])),
    DANGER._replace(frame="drone"), QUIET._replace(topic=RADAR_B, frame="drone"),
], ids=["area", "sources", "another sensor"])  # fmt: skip
def test_a_refused_message_is_a_fault_after_a_restart_too(mine, bad):
    assert mine.send(ROAD, QUIET).faults == ()
    assert "was refused" in mine.send(bad).faults[0]
    mine.restart()
    others = [send for send in (ROAD, MACHINE, QUIET) if send.topic != bad.topic]  # a mute publisher is a fault
    assert any(f"a message on {bad.topic} was refused" in fault for fault in mine.send(*others).faults)
    good = QUIET._replace(topic=bad.topic) if bad.kind == "poses" else ROAD
    if bad.kind == "poses":
        assert any("was refused" in fault for fault in mine.send(good, QUIET).faults), "another wall may be meant"
        mine.stay_quiet(MAX_AGE)
    assert mine.send(good, QUIET).faults == ()


def test_after_a_pause_areas_and_if_patches_are_in_use_the_whole_terrain_must_be_published_again(mine):
    assert mine.send(ROAD, QUIET, PATCH, QUIET).faults == ()
    mine.run.node.station.deactivate()
    mine.run.node.station.activate()
    mine.run.node.settle()
    faults = mine.send(QUIET).faults
    assert any("1 patches are not in" in fault for fault in faults)
    assert any("nothing has been received on areas/polygon" in fault for fault in faults)
    assert mine.send(ROAD, WHOLE, QUIET).faults == ()


def test_after_a_pause_without_patches_only_the_areas_must_be_published_again(mine):
    assert mine.send(ROAD, QUIET).faults == ()
    mine.run.node.station.deactivate()
    mine.run.node.station.activate()
    mine.run.node.settle()
    (fault,) = mine.send(QUIET).faults
    assert "nothing has been received on areas/polygon" in fault
    assert mine.send(ROAD, QUIET).faults == ()


def test_a_refused_message_stays_a_fault_while_the_node_is_not_active(mine):
    mine.send(ROAD, QUIET, QUIET._replace(topic=RADAR_B, frame="drone"))
    mine.run.node.station.deactivate()
    mine.run.node.station.activate()
    mine.run.node.settle()
    assert any("was refused" in fault for fault in mine.send(ROAD, QUIET).faults)


def test_a_patch_that_no_store_has_is_missing_after_a_restart_until_the_next_whole_survey(mine):
    assert mine.send(ROAD, QUIET, PATCH, QUIET).faults == ()
    for _ in range(2):
        mine.restart(has_survey=False)
        mine.run.deliver(WHOLE._replace(at=mine.at))  # a latched survey that was published before the patch
        faults = mine.send(ROAD, QUIET).faults
        assert len(faults) == 1 and "1 patches are not in the terrain" in faults[0]
    assert mine.send(WHOLE, QUIET).faults == ()
    mine.restart()
    assert mine.send(ROAD, QUIET).faults == ()


@pytest.mark.parametrize("kind", ["grid", "mesh"])
def test_a_patch_that_replaced_the_whole_terrain_is_missing_after_a_restart_with_the_survey_from_before_it(mine, kind):
    """Such a patch counts as the whole terrain, so no patch seems to be in it; but the latched survey lacks it."""
    everything = Send(sent=0.4, at=0.4, topic="terrain/update", kind="patch", places=survey(TRUTH, 0.4))
    topic = {"grid": "terrain/points", "mesh": "terrain/mesh"}[kind]
    earlier = WHOLE._replace(topic=topic, kind=kind, places=survey(TRUTH._replace(bank_until=0.0), 0.1))
    mine.send(earlier)
    published = mine.at
    mine.send(ROAD, QUIET)
    assert mine.send(everything, QUIET).faults == ()
    for _ in range(2):
        mine.restart(has_survey=False)
        mine.run.deliver(earlier._replace(sent=published, at=mine.at))
        assert any("1 patches are not in the terrain" in fault for fault in mine.send(ROAD, QUIET).faults)
    mine.stay_quiet(0.5)
    mine.send(WHOLE._replace(places=survey(TRUTH, 9.0)), ROAD)
    assert mine.stay_quiet(0.5).faults == (), "until the next whole survey"


def test_the_number_of_missing_patches_does_not_grow_with_each_restart(mine):
    assert mine.send(ROAD, QUIET, PATCH, QUIET).faults == ()
    for _ in range(3):
        mine.restart(has_survey=False)
        assert any("1 patches are not in the terrain" in fault for fault in mine.send(ROAD, QUIET).faults)


@pytest.mark.parametrize("mine", [pattern_site()], indirect=True)
def test_what_is_received_while_nothing_is_decided_is_known_after_a_restart(mine):
    """A patch or an area needs no decision before the first sources or while the last decision is valid."""
    decided = mine.alert
    assert mine.send(MACHINE, PATCH) is decided
    mine.restart(has_survey=False)
    mine.run.deliver(WHOLE._replace(at=mine.at))  # a latched survey that was published before the patch
    faults = " ".join(mine.send(ROAD, QUIET).faults)
    assert "1 patches are not in the terrain" in faults and "nothing has been received on areas/equipment" in faults


def test_an_area_is_remembered_as_soon_as_the_thread_that_flies_rocks_watches_it(mine, monkeypatch):
    """The simulating thread may see the new area before the desk does, and a kill may come before the desk acts."""
    station = mine.run.node.station
    set_areas, log = station.flyer.set_areas, station._configuration.log

    def seen_at_once(topic, outlines):
        set_areas(topic, outlines)
        station._watch_present()
        mine.run.node.settle()

    monkeypatch.setattr(station.flyer, "set_areas", seen_at_once)
    mine.send(ROAD)
    mine.run.node.settle()
    assert log._facts["memory"]["areas"] == ["areas/polygon"]


def test_what_the_terrain_lacked_before_anything_was_decided_is_a_fault_after_a_restart(mine, monkeypatch):
    """Before the first message on /clock no decision contains the fault, so the node's files must contain it."""
    monkeypatch.setattr(mine.run.node.station.desk, "_now", lambda: 0)
    monkeypatch.setattr(mine.run.node.station.desk, "_clock_ran", False)
    decided = mine.alert
    assert mine.send(PATCH._replace(frame="drone"), WHOLE._replace(frame="drone")) is decided
    mine.restart(has_survey=False)
    faults = " ".join(mine.send(ROAD, QUIET).faults)
    assert "1 patches are not in the terrain" in faults and "a survey was refused" in faults


@pytest.mark.parametrize("has_lacks", [True, False], ids=["this version", "a former version"])
def test_what_the_terrain_lacked_is_known_before_the_desk_writes_or_decides(mine, monkeypatch, has_lacks):
    """Otherwise the desk's thread could overwrite the record on disk, or decide without it, while the node starts."""
    mine.send(ROAD, QUIET, PATCH._replace(frame="drone"), WHOLE._replace(frame="drone"))
    faults = " ".join(mine.send(QUIET).faults)
    assert "1 patches are not in the terrain" in faults and "a survey was refused" in faults
    configured, remember, repeat, lacks = mine.configured, DecisionLog.remember, AreasBefore.repeat, []

    def of_former_version(plan):
        made = configured(plan)
        made.log.memory.pop("lacks")
        return made

    def observed(log, received):
        remember(log, received)
        lacks.append(received["lacks"])

    def slow(areas):
        repeat(areas)
        wait_for(lambda: lacks, seconds=20.0)

    if not has_lacks:
        monkeypatch.setattr(combination, "configuration_of", of_former_version)
    monkeypatch.setattr(DecisionLog, "remember", observed)
    monkeypatch.setattr(AreasBefore, "repeat", slow)
    mine.restart(has_survey=False)
    assert lacks[0][0] == 1 and "drone" in lacks[0][1]
    mine.run.deliver(WHOLE._replace(at=mine.at))  # a latched survey that was published before the refused one
    faults = " ".join(mine.send(ROAD, QUIET).faults)
    assert "1 patches are not in the terrain" in faults and "a survey was refused" in faults


def test_lost_messages_are_a_fault_after_a_restart_too(mine):
    assert mine.send(ROAD, QUIET).faults == ()
    mine.run.node.station.input_lost(RADAR_A, mine.run.now_ns())
    for _ in range(2):
        mine.run.node.settle()
        mine.restart()
        assert any("were lost" in fault for fault in mine.send(ROAD, QUIET).faults)
    assert mine.stay_quiet(MAX_AGE).faults == ()


WITHOUT_A = {"source_topics": (RADAR_B,), "optional_topics": (RADAR_B,)}
QUIET_B = QUIET._replace(topic=RADAR_B)
HARMLESS = QUIET._replace(places=pit.placed(55.0, 20.0, 0.5)[None])
"""A message of radar A about a place below the road, from which no rock reaches the road."""


def site_with(scan_period):
    values = combination.site_values("restrict", has_machines=True)
    if scan_period is not None:
        values["evidence"] = {**values["evidence"], "scan_period_s": scan_period}
    return Thresholds.model_validate(values)


EACH_SITE = pytest.mark.parametrize("mine", [site_with(each) for each in (None, 0, 5)], indirect=True)
ENDS = pytest.mark.parametrize("ends", ["killed", "deactivated", "clock went back"])


def end(mine, how):
    """Let the node end in one of the three ways; the next start follows."""
    if how == "deactivated":
        mine.run.node.station.deactivate()
    if how == "clock went back":
        mine.run.node.station.forget("the clock went back")
    mine.run.node.settle()


def lacks_a(alert):
    return any(f"danger was possible on {RADAR_A}," in fault for fault in alert.faults)


def reports_danger(mine):
    assert mine.send(ROAD, DANGER).held == Level.RESTRICT


def is_refused(mine):
    assert any("was refused" in fault for fault in mine.send(ROAD, QUIET, QUIET._replace(frame="drone")).faults)


def is_lost(mine):
    mine.send(ROAD, QUIET)
    mine.run.node.station.input_lost(RADAR_A, mine.run.now_ns())
    mine.run.node.settle()


@pytest.mark.parametrize("happens", [reports_danger, is_refused, is_lost], ids=lambda each: each.__name__)
def test_a_radar_that_is_removed_or_renamed_after_danger_was_possible_is_a_fault_until_a_person_acknowledges(
    mine, happens
):
    happens(mine)
    mine.changed = WITHOUT_A
    for _ in range(2):
        mine.restart()
        mine.send(ROAD, QUIET_B)
        alert = mine.send(QUIET_B)
        assert alert.level == Level.FAULT and lacks_a(alert)
    mine.changed = {}
    mine.restart()
    assert lacks_a(mine.send(ROAD, QUIET, QUIET_B)), "what was not received meanwhile is still not known"
    assert not lacks_a(mine.acknowledge())
    mine.restart()
    assert not lacks_a(mine.send(ROAD, QUIET, QUIET_B))
    assert audit_log(mine.folder).sound


STARTS = pytest.mark.parametrize("starts", [0, 1, 2], ids=["at once", "after another start", "after two other starts"])
"""How often the node starts with unchanged parameters before radar A is removed; radar A is silent then."""


def start_unchanged(mine, starts, ends):
    for _ in range(starts):
        mine.restart()
        mine.send(ROAD, QUIET_B)
        end(mine, ends)


@EACH_SITE
@ENDS
@STARTS
def test_danger_on_a_radar_that_is_removed_is_a_fault_on_every_site_however_the_node_had_ended(mine, ends, starts):
    reports_danger(mine)
    end(mine, ends)
    start_unchanged(mine, starts, ends)
    mine.changed = WITHOUT_A
    mine.restart()
    mine.send(ROAD, QUIET_B)
    alert = mine.stay_quiet(6.0, [RADAR_B])
    assert alert.level == Level.FAULT and lacks_a(alert)
    assert not lacks_a(mine.acknowledge())


@EACH_SITE
@ENDS
def test_too_many_dangerous_places_to_be_saved_are_a_fault_if_their_radar_is_removed_later(mine, ends, monkeypatch):
    monkeypatch.setattr(unreported_places, "REMEMBERED", 0)
    reports_danger(mine)
    end(mine, ends)
    start_unchanged(mine, 1, ends)
    mine.changed = WITHOUT_A
    mine.restart()
    mine.send(ROAD, QUIET_B)
    assert lacks_a(mine.send(QUIET_B))


@EACH_SITE
@ENDS
@STARTS
def test_a_radar_that_saw_nothing_dangerous_may_be_removed_without_a_fault(mine, ends, starts):
    for _ in range(3):
        mine.send(ROAD, HARMLESS, QUIET_B)
    mine.run.node.settle()
    assert mine.alert.held == Level.NORMAL
    end(mine, ends)
    start_unchanged(mine, starts, ends)
    mine.changed = WITHOUT_A
    mine.restart()
    assert not lacks_a(mine.send(ROAD, QUIET_B, QUIET_B))


@pytest.mark.parametrize("ends", ["killed", "deactivated"])
def test_dangerous_places_of_a_map_with_another_origin_are_a_fault_until_a_person_acknowledges(mine, ends):
    reports_danger(mine)
    end(mine, ends)
    mine.changed = {"map_origin": (20.0, 0.0, -8.9)}
    for _ in range(2):
        mine.restart()
        alert = mine.send(ROAD, QUIET_B, HARMLESS)
        assert alert.level == Level.FAULT
        assert any("before: [0.0, 0.0, 0.0]" in fault and RADAR_A in fault for fault in alert.faults)
        assert not any("no longer reports" in fault for fault in alert.faults), "no rock starts at a place of that map"
    assert not any("map_origin" in fault for fault in mine.acknowledge().faults)
    mine.restart()
    assert not any("map_origin" in fault for fault in mine.send(ROAD, QUIET_B, QUIET).faults)


@pytest.mark.parametrize("mine", [site_with(5)], indirect=True)
def test_a_harmless_message_of_a_scan_that_is_not_complete_ends_no_danger_from_before(mine):
    reports_danger(mine)
    end(mine, "clock went back")
    mine.send(ROAD, HARMLESS, HARMLESS)
    mine.changed = WITHOUT_A
    mine.restart()
    mine.send(ROAD, QUIET_B)
    assert lacks_a(mine.send(QUIET_B)), "the message may have been about another wall"


@pytest.mark.parametrize("mine", [site_with(5)], indirect=True)
def test_a_harmless_message_after_a_pause_of_a_scan_ends_no_danger(mine):
    reports_danger(mine)
    mine.stay_quiet(20.0, [RADAR_B])
    mine.send(HARMLESS)
    mine.changed = WITHOUT_A
    mine.restart()
    mine.send(ROAD, QUIET_B)
    assert lacks_a(mine.send(QUIET_B))


@EACH_SITE
def test_an_empty_message_of_a_whole_scan_ends_the_danger_from_before_a_restart(mine):
    reports_danger(mine)
    mine.restart()
    mine.send(ROAD, QUIET_B, QUIET)
    mine.stay_quiet(6.0)
    mine.changed = WITHOUT_A
    mine.restart()
    assert not lacks_a(mine.send(ROAD, QUIET_B, QUIET_B))


def test_where_the_site_demands_two_persons_a_person_who_saw_nothing_is_not_counted():
    before = {RADAR_A: "danger was possible"}
    topics = TopicsBefore(lambda *_: None, AcknowledgeSpec(persons=2, within_s=100.0), before)
    assert topics.acknowledged("A. Shift", ()) == ()
    assert topics.acknowledged("B. Survey", ["danger was possible"]) == ()
    assert topics.acknowledged("C. Mine", ["danger was possible"]) == (RADAR_A,), "A has not voted, so B and C are two"


def test_where_the_site_demands_two_persons_two_who_saw_it_end_the_fault_of_a_removed_radar():
    reported = {}
    before = {RADAR_A: "danger was possible"}
    topics = TopicsBefore(reported.__setitem__, AcknowledgeSpec(persons=2, within_s=100.0), before)
    topics.repeat()
    assert topics.acknowledged("A. Shift", ()) == (), "A has not seen the fault"
    assert topics.acknowledged("B. Survey", ["danger was possible"]) == ()
    assert topics.acknowledged("b survey", ["danger was possible"]) == (), "the same name counts once"
    assert topics.reasons == before
    assert topics.acknowledged("A. Shift", ["danger was possible"]) == (RADAR_A,)
    assert topics.reasons == {} and list(reported.values()) == [""]


@pytest.mark.parametrize(
    ("memory", "topics"),
    [
        ({}, {}),
        ({"map_origin": [1.0, 2.0, 3.0]}, {}),
        ({"dangers": ["a"], "map_origin": [0.0, 0.0, 0.0]}, {}),
        ({"dangers": [], "places": {"z": [[0.0] * 7]}, "map_origin": [0.0, 0.0, 0.0]}, {}),  # harmless
        ({"dangers": ["a", "z"], "map_origin": [0.0, 0.0, 1.0]}, {"a": "before: [0.0, 0.0, 1.0]", "z": "without this"}),
        ({"places": {"a": [[0.0] * 7]}}, {"a": "whose older version did not save map_origin"}),
        ({"places": {"": ["z"]}}, {"z": "without this topic"}),
        ({"missed": {"z": 7}, "refused": {"y": "NaN", "a": "NaN"}}, {"y": "without this", "z": "without this"}),
        ({"unjudged": {"a": "for a reason"}, "map_origin": [0.0] * 3}, {"a": "for a reason"}),
        ({"unjudged": {"a": "for a reason"}, "dangers": ["a"], "map_origin": [1.0] * 3}, {"a": "for a reason; danger"}),
    ],
)  # fmt: skip
def test_which_sources_from_before_the_start_cannot_be_judged(memory, topics):
    found = unjudged_topics(memory, ("a", "b"), (0.0, 0.0, 0.0))
    assert set(found) == set(topics)
    for topic, words in topics.items():
        assert words in found[topic]
    again = unjudged_topics({**memory, "unjudged": found}, ("a", "b"), (0.0, 0.0, 0.0))
    assert again == found, "the sentence does not grow with each start"


def test_an_acknowledgement_that_ends_a_refusal_lowers_no_level(mine):
    """The person has seen a fault, not the level that follows the fault."""
    assert mine.send(ROAD, DANGER, QUIET, MACHINE._replace(frame="drone")).held == Level.RESTRICT
    assert "was refused" in mine.stay_quiet(MAX_AGE + 0.5).faults[0]
    alert = mine.acknowledge()
    assert (alert.level, alert.held, alert.faults) == (Level.RESTRICT, Level.RESTRICT, ())
    assert mine.acknowledge().level == Level.NORMAL
    assert audit_log(mine.folder).sound


def test_one_acknowledgement_does_not_end_a_refusal_and_an_unknown_level(mine):
    mine.send(ROAD, DANGER)
    mine.run.node.station.close()
    gone(mine)
    mine.restart()
    mine.send(ROAD, QUIET, MACHINE._replace(frame="drone"))
    assert len(mine.stay_quiet(MAX_AGE + 0.5).faults) == 2
    (fault,) = mine.acknowledge().faults
    assert ADVICE in fault
    assert mine.acknowledge().faults == ()


def test_one_sensor_is_not_enough_to_acknowledge_what_another_had_seen_before_a_restart(mine):
    mine.send(ROAD, QUIET)
    assert mine.send(DANGER._replace(topic=RADAR_B)).held == Level.RESTRICT
    for _ in range(2):
        mine.restart()
        alert = mine.send(ROAD, QUIET)
        assert alert.level == Level.FAULT and RADAR_B in alert.faults[0]
    assert mine.acknowledge().held == Level.RESTRICT
    mine.send(QUIET._replace(topic=RADAR_B))
    assert mine.acknowledge().level == Level.NORMAL


def test_where_the_site_demands_two_persons_two_end_the_fault_of_an_unknown_level():
    unknown = UnknownBefore("the log is gone", AcknowledgeSpec(persons=2, within_s=100.0))
    assert "another person" in unknown.acknowledged("A. Shift", 0, ())
    assert "another person" in unknown.acknowledged("a shift", 1, ()), "the same name counts once"
    assert "the other faults must end first" in unknown.acknowledged("B. Survey", 2, ("sources are stale",))
    assert "another person" in unknown.acknowledged("B. Survey", 3, ()), "A has not seen what came after the fault"
    assert "another person" in unknown.acknowledged("A. Shift", 102 * SECOND, ()), "too late"
    assert unknown.sentences
    assert unknown.acknowledged("B. Survey", 103 * SECOND, ()) == ""
    assert unknown.sentences == ()


def test_an_older_survey_is_refused_after_a_pause_and_after_a_restart(mine):
    """The state that the log keeps has the stamp of the last survey in use."""
    assert mine.send(WHOLE, ROAD, QUIET).faults == ()
    mine.run.node.station.deactivate()
    mine.run.node.station.activate()
    other = WHOLE._replace(places=np.add(WHOLE.places, 3.0))
    for starts in (False, True):
        if starts:
            mine.restart(has_survey=False)
        mine.run.deliver(other._replace(sent=mine.at + 0.05, at=mine.at + 0.05, offset=-mine.at))
        assert any("older than" in fault for fault in mine.send(ROAD, QUIET).faults), mine.alert.faults
