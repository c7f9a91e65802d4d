"""Tests that every alert is valid by the JSON Schema for subscribers, and a damaged alert is not."""

import json
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from jsonschema import Draft202012Validator
from live_sites.alert_evidence import NOW, area, decided, evidence, origin
from std_msgs.msg import Header

from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.origins import all_from
from rpf3d_ros.messages.alert_messages import Publication, alerts_message
from rpf3d_ros.messages.diagnostic_messages import of_unit

ROOT = Path(__file__).resolve().parents[3]
SCHEMA = json.loads((ROOT / "config" / "alert.schema.json").read_text(encoding="utf-8"))
VALIDATOR = Draft202012Validator(SCHEMA)
ANSWERS = {
    "normal": evidence(),
    "restrict": evidence(area(150)),
    "evacuate": evidence(area(900, origins=all_from(origin("radar_b/sources")))),
    "no evidence": None,
}


def as_json(alert, namespace="/"):
    """Return the message of an alert as JSON content, as rosbridge sends it."""
    message = of_unit(alerts_message(Header(), alert, 7, Publication(sequence=3, at_ns=NOW)), namespace)
    status = [
        {"level": each.level[0], "name": each.name, "message": each.message, "hardware_id": each.hardware_id,
         "values": [{"key": pair.key, "value": pair.value} for pair in each.values]}
        for each in message.status
    ]  # fmt: skip
    return {"header": {"frame_id": message.header.frame_id}, "status": status}


def is_valid(content):
    return VALIDATOR.is_valid(content)


def test_the_schema_is_one():
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("name", ANSWERS)
@pytest.mark.parametrize("namespace", ["/", "/pit_a"])
def test_every_alert_agrees_with_it(name, namespace):
    VALIDATOR.validate(as_json(decided(ANSWERS[name]), namespace))


def test_the_answers_have_different_levels():
    assert len({decided(answer).level for answer in ANSWERS.values()}) > 2


def test_the_numbers_of_levels_are_those_of_the_page():
    assert [level.word for level in sorted(Level)] == SCHEMA["$defs"]["shown"]["enum"]
    page = (ROOT / "docs" / "reference" / "topics.md").read_text(encoding="utf-8")
    assert ", ".join(f"{int(level)} `{level.word}`" for level in Level) in page


@pytest.mark.parametrize("status", [0, 1])
def test_an_alert_that_lacks_any_value_does_not_agree(status):
    keys = [pair["key"] for pair in as_json(decided(ANSWERS["restrict"]))["status"][status]["values"]]
    assert len(keys) > 8
    for key in keys:
        content = as_json(decided(ANSWERS["restrict"]))
        values = content["status"][status]["values"]
        content["status"][status]["values"] = [pair for pair in values if pair["key"] != key]
        assert is_valid(content) == key.startswith("reason.1"), key


@pytest.mark.parametrize(("key", "value"), [
    ("level", "green"), ("level_number", "5"), ("held", "fault"), ("evident", ""), ("valid_until_ns", "soon"),
    ("sequence", "0"), ("stamp", "12"), ("cause", "radar"), ("cause_place", "1.5 2.5"), ("terrain_digest", "t" * 64),
    ("level_since_ns", "yesterday"),
])  # fmt: skip
def test_a_value_that_none_has_does_not_agree(key, value):
    content = as_json(decided(ANSWERS["restrict"]))
    for pair in content["status"][0]["values"]:
        if pair["key"] == key:
            pair["value"] = value
    assert not is_valid(content)


def test_the_causes_of_the_answers_differ():
    told = [pair["value"] for answer in ANSWERS.values() for pair in as_json(decided(answer))["status"][1]["values"]
            if pair["key"] == "cause"]  # fmt: skip
    assert told == ["nothing", "unknown", "sources", "fault"]


def test_a_message_without_the_site_does_not_agree():
    content = as_json(decided(ANSWERS["restrict"]))
    assert not is_valid({**content, "status": content["status"][1:]})
    assert not is_valid({**content, "status": []})
