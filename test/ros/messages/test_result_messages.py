"""Tests of results and alerts as messages."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from live_sites.alert_evidence import NOW, S, origin

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header

from rpf3d_core.alerts.levels import AreaAlert, Level, Since, acknowledgement
from rpf3d_ros.messages.alert_messages import LEVELS, alarm_message, alerts_message
from rpf3d_ros.messages.alert_reading import alerts_of
from rpf3d_ros.messages.health import OK, WARN, healths_of
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.result_messages import ResultFacts, facts_of, results_message

HEADER = Header(frame_id="map", stamp=Time(sec=12, nanosec=34))
FACTS = ResultFacts(7, 1, False, 400, 20, 1, 0.25, "0" * 64, "1" * 64, {"stopped": 390, "left_terrain": 10})
LEVEL_WORDS = ["normal", "watch", "restrict", "evacuate", "fault"]


def sent(message):
    return deserialize_message(serialize_message(message), type(message))


@pytest.mark.parametrize("facts", [FACTS, replace(FACTS, complete=True, outcomes={}, warning="2 rocks failed")])
def test_the_facts_of_a_result_survive_its_message(facts):
    assert facts_of(sent(results_message(HEADER, facts))) == facts


def test_a_result_is_stamped_as_what_caused_it_and_warns_where_it_has_to():
    message = results_message(HEADER, FACTS)
    assert message.header == HEADER
    assert healths_of(message)[0].level == OK
    assert healths_of(message)[0].message == "result 7: 400 rocks from 20 sources, to be refined"
    assert healths_of(results_message(HEADER, replace(FACTS, warning="2 rocks failed")))[0].level == WARN


def test_a_message_without_a_result_is_refused():
    with pytest.raises(MessageRefused, match="holds no status 'rpf3d: result'"):
        facts_of(DiagnosticArray())


@pytest.mark.parametrize("key", ["result", "complete", "seconds", "terrain_digest", "outcome.stopped"])
def test_a_damaged_result_is_refused(key):
    message = results_message(HEADER, FACTS)
    for pair in message.status[0].values:
        if pair.key == key:
            pair.key, pair.value = ("gone", "") if key == "terrain_digest" else (key, "many")
    with pytest.raises(MessageRefused, match="is damaged"):
        facts_of(message)


def alert(word, alarm=False):
    level = Level[word.upper()]
    reasons = ("ramp: 12 % of rocks reach it", "held since 08:15")
    faults = ("there is no answer",) if word == "fault" else ()
    return SimpleNamespace(
        level=level, held=level, evident=level, reasons=reasons, faults=faults, areas=(), alarm=alarm, at_ns=5,
        valid_until_ns=2**62, since=Since(level_ns=3, not_normal_ns=None), terrain_digest="7e" * 32, terrain_stamp_ns=2,
        waiting=(), waiting_until_ns=None,
    )  # fmt: skip


def area(name, *words, why):
    level, held, evident = (Level[word.upper()] for word in words)
    return AreaAlert(name=name, level=level, held=held, evident=evident, why=why, since=Since(3, 1), origin=origin())


@pytest.mark.parametrize("word", LEVEL_WORDS)
def test_an_alert_says_its_level_its_reasons_and_until_when_they_hold(word):
    (health,) = healths_of(sent(alerts_message(HEADER, alert(word, alarm=True), 7)))
    assert health.name == "rpf3d: alert"
    assert health.message == f"{word}: ramp: 12 % of rocks reach it; held since 08:15"
    assert {key: health.values[key] for key in ("level", "alarm", "result", "valid_until_ns", "reason.1")} == {
        "level": word, "alarm": "true", "result": "7", "valid_until_ns": str(2**62), "reason.1": "held since 08:15",
    }  # fmt: skip


def test_each_area_has_a_status_of_its_own_behind_that_of_the_site():
    decided = alert("restrict")
    decided.areas = (
        area("ramp", "restrict", "restrict", "normal", why="no limit is reached; there is no source, so no rock flew"),
        area("crusher", "watch", "watch", "watch", why="watch because 12 of 900 rocks reached the area"),
    )
    site, ramp, crusher = alerts_of(sent(alerts_message(HEADER, decided, 7)))
    assert [one.area for one in (site, ramp, crusher)] == [None, "ramp", "crusher"]
    assert (ramp.state, ramp.health.level) == ("restrict", LEVELS["restrict"])
    assert ramp.health.message == (
        "restrict is held and falls only after an acknowledgement; "
        "no limit is reached; there is no source, so no rock flew"
    )
    assert ramp.health.values == {
        "level": "restrict", "level_number": "2", "held": "restrict", "evident": "normal",
        "result": "7", "decided_at_ns": "5", "valid_until_ns": str(2**62),
        "cause": "sources", "cause_area": "ramp", "cause_fault": "", "cause_topic": "radar",
        "cause_place": "1.500 -2.250 30.000", "cause_sources": "3", "cause_sources_digest": "5c" * 32,
        "terrain_digest": "7e" * 32, "terrain_stamp_ns": str(NOW - 60 * S), "level_since_ns": "3",
        "not_normal_since_ns": "1", "waiting_by": "", "waiting_why": "", "waiting_until_ns": "",
    }  # fmt: skip
    assert set(ramp.health.values) <= set(site.health.values), "a machine reads the site and an area alike"
    assert crusher.health.message == "watch because 12 of 900 rocks reached the area"


def test_an_area_tells_of_the_fault_as_well():
    decided = alert("fault")
    decided.areas = (area("ramp", "fault", "normal", "normal", why="the answer does not contain this area"),)
    _, ramp = alerts_of(sent(alerts_message(HEADER, decided, None)))
    assert (ramp.state, ramp.health.level) == ("fault", LEVELS["fault"])
    assert ramp.health.message == "fault: there is no answer; the answer does not contain this area"
    why = "evacuate because 7 of 9 rocks reached the area"
    decided.areas = (area("ramp", "evacuate", "evacuate", "evacuate", why=why),)
    _, ramp = alerts_of(sent(alerts_message(HEADER, decided, None)))
    assert ramp.health.message == "evacuate because 7 of 9 rocks reached the area; there is no answer"


CAUSES = {
    "normal": (
        area("ramp", "normal", "normal", "normal", why="no limit")._replace(origin=None),
        "nothing",
        "",
        "",
        "2",
    ),
    "watch": (area("ramp", "watch", "watch", "normal", why="no limit"), "sources", "ramp", "", str(NOW - 60 * S)),
    "evacuate": (area("ramp", *["evacuate"] * 3, why="rocks")._replace(origin=None), "unknown", "ramp", "", ""),
    "fault": (area("ramp", "fault", "watch", "normal", why="no limit"), "fault", "", "there is no answer", "2"),
}


@pytest.mark.parametrize("word", CAUSES)
def test_the_site_and_its_area_say_what_gave_their_level_and_on_which_survey(word):
    ramp, *expected = CAUSES[word]
    decided = alert(word)
    decided.held, decided.areas = ramp.held, (ramp,)
    for one in alerts_of(sent(alerts_message(HEADER, decided, 7))):
        assert [
            one.health.values[key] for key in ("cause", "cause_area", "cause_fault", "terrain_stamp_ns")
        ] == expected


def test_an_acknowledgement_that_waits_for_another_person_is_shown_of_the_site_and_its_areas():
    decided = alert("evacuate")
    decided.areas, decided.waiting_until_ns = (area("ramp", *["evacuate"] * 3, why="rocks"),), 9
    decided.waiting = (acknowledgement("A. Shift", "looked", 5),)
    for one in alerts_of(sent(alerts_message(HEADER, decided, 7))):
        told = [one.health.values[key] for key in ("waiting_by", "waiting_why", "waiting_until_ns")]
        assert told == ["A. Shift", "looked", "9"]


def test_an_area_names_the_fault_that_names_it_and_the_site_the_first():
    decided = alert("fault")
    decided.faults = ("the sources are stale", "ramp: 9 % of the area has no terrain")
    decided.areas = tuple(area(name, "fault", "normal", "normal", why="no limit") for name in ("ramp", "crusher"))
    told = [one.health.values["cause_fault"] for one in alerts_of(sent(alerts_message(HEADER, decided, 7)))]
    assert told == [decided.faults[0], decided.faults[1], decided.faults[0]]


def test_a_fault_is_above_every_error_and_the_levels_rise():
    levels = [LEVELS[word] for word in LEVEL_WORDS]
    assert levels == sorted(levels)
    assert levels[0] == OK
    assert levels[-1] > DiagnosticStatus.ERROR[0]


def test_every_level_of_the_alerts_has_one_of_the_message():
    levels = pytest.importorskip("rpf3d_core.alerts.levels", reason="alerts are not there")
    assert set(LEVELS) == {level.word for level in levels.Level}


def test_the_alarm_is_what_the_alert_says():
    assert alarm_message(alert("watch")).data is False
    assert alarm_message(alert("evacuate", alarm=True)).data is True


def test_an_alert_without_an_answer_names_none():
    assert healths_of(alerts_message(HEADER, alert("fault"), None))[0].values["result"] == ""
