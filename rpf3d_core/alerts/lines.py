"""Lines of the decision log: one JSON object a line, with the hash of the previous line and its own hash.

Numbers are read back bit for bit: Python writes a float with enough digits to identify it. Values that JSON does not
have (NaN, infinities) are written as text.
"""

import hashlib
import json
from typing import Any, NamedTuple

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.evidence_lines import evidence_content, evidence_of, origin_content, origin_of
from rpf3d_core.alerts.levels import Acknowledgement, Alert, AreaAlert, Judged, Level, Since

FORMAT = 1
"""Version of the format of the lines; a reader of another version reports the difference."""

HASH_DIGITS = 64
BEGINNING = "0" * HASH_DIGITS
"""Value that the first line of a log has in place of the hash of a previous line."""

LEVELS = ("level", "held", "evident")
"""Fields of an alert and of an area with an alert level; the log contains the level as a word."""

OWN_HASH = b',"sha256":"'


class Unreadable(ValueError):
    """Raised for an undamaged log line with a part that this version of rpf3d does not understand.

    The message names the part.
    """


class Decision(NamedTuple):
    """A logged decision that can be repeated: the inputs of `decide` except the thresholds, and the resulting alert.

    previous, evidence, acknowledgement, now_ns, reported : as in `decide`; alert : the decision that was made
    """

    previous: Alert | None
    evidence: Evidence | None
    acknowledgement: Acknowledgement | None
    now_ns: int
    alert: Alert
    reported: tuple[str, ...] = ()


def line_of(number: int, before: str, kind: str, content: dict[str, Any]) -> tuple[bytes, str]:
    """Return a line for the log (bytes, with line end), and its hash (64 hex digits), which the next line repeats.

    The hash covers all bytes of the line before the hash itself.

    number : of the line, from 0; before : hash of the previous line
    kind : such as "decision"; content : plain values of the line
    """
    body = canonical({"kind": kind, "n": number, "before": before, **content}).encode()[:-1]
    own = hashlib.sha256(body).hexdigest()
    return body + OWN_HASH + own.encode() + b'"}\n', own


def content_of(raw: bytes) -> dict[str, Any] | None:
    """Return the content of a log line, with its hash as `sha256`; None if the line is damaged or was changed."""
    body, mark, rest = raw.rstrip(b"\n").rpartition(OWN_HASH)
    own = hashlib.sha256(body).hexdigest()
    if not mark or rest != own.encode() + b'"}':
        return None
    try:
        content = json.loads(body + b"}")
    except (ValueError, RecursionError):
        return None
    keys = {"kind": str, "n": int, "before": str}
    if not isinstance(content, dict) or not all(isinstance(content.get(key), kind) for key, kind in keys.items()):
        return None
    return {**content, "sha256": own}


def canonical(value: Any) -> str:
    """Return plain values as one line of JSON; equal values with keys in the same order give equal text.

    So hashes and values can be compared as text. Raise ValueError if a number is NaN or infinite.
    """
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def decision_content(decision: Decision) -> dict[str, Any]:
    """Return a decision as plain values, to be written into the log."""
    evidence, given = decision.evidence, decision.acknowledgement
    reported = {"reported": decision.reported} if decision.reported else {}
    return {
        "now_ns": decision.now_ns,
        "previous": None if decision.previous is None else alert_content(decision.previous),
        "evidence": None if evidence is None else evidence_content(evidence),
        "acknowledgement": None if given is None else _given_content(given),
        **reported,
        "alert": alert_content(decision.alert),
    }


def decision_of(content: dict[str, Any]) -> Decision:
    """Return the decision in a log line, from the values that `decision_content` wrote.

    Raises
    ------
    Unreadable
        A part of the decision is missing, or unknown to this version of rpf3d.
    """
    try:
        previous, evidence, given = content["previous"], content["evidence"], content["acknowledgement"]
        return Decision(
            previous=None if previous is None else _alert(previous),
            evidence=None if evidence is None else evidence_of(evidence),
            acknowledgement=None if given is None else Acknowledgement(**given),
            now_ns=content["now_ns"],
            alert=_alert(content["alert"]),
            reported=tuple(str(sentence) for sentence in content.get("reported", ())),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise Unreadable(f"this version does not understand the decision: {error}") from None


def alert_of(content: dict[str, Any]) -> Alert:
    """Return an alert from the values that `alert_content` wrote.

    Raises
    ------
    Unreadable
        A part of the alert is missing, or unknown to this version of rpf3d.
    """
    try:
        return _alert(content)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise Unreadable(f"this version does not understand the alert: {error}") from None


def alert_content(alert: Alert) -> dict[str, Any]:
    """Return an alert as plain values for the log or for JSON, with alert levels as words."""
    given = alert.acknowledgement
    content = {
        **_words(alert._asdict()),
        "acknowledgement": None if given is None else _given_content(given),
        "areas": [_area_content(area) for area in alert.areas],
        "since": None if alert.since is None else alert.since._asdict(),
        "waiting": [_given_content(each) for each in alert.waiting],
    }
    left_out = () if alert.waiting else ("waiting", "waiting_until_ns")
    return {name: value for name, value in content.items() if name not in left_out}


def _given_content(given: Acknowledgement) -> dict[str, Any]:
    """Return an acknowledgement as plain values; an empty `client` is left out, as in older logs."""
    return {name: value for name, value in given._asdict().items() if value or name != "client"}


def _area_content(area: AreaAlert) -> dict[str, Any]:
    return {
        **_words(area._asdict()),
        "since": None if area.since is None else area.since._asdict(),
        "origin": origin_content(area.origin),
        "judged": None if area.judged is None else area.judged._asdict(),
    }


def _alert(content: dict[str, Any]) -> Alert:
    sentences = {name: tuple(content[name]) for name in ("reasons", "faults", "held_by")}
    given = content["acknowledgement"]
    acknowledgement = None if given is None else Acknowledgement(**given)
    areas = tuple(_area(area) for area in content.get("areas", ()))
    records = {
        "acknowledgement": acknowledgement, "areas": areas, "since": _since(content.get("since")),
        "waiting": tuple(Acknowledgement(**each) for each in content.get("waiting", ())),
    }  # fmt: skip
    return Alert(**{**_levels(content), **sentences, **records})


def _area(content: dict[str, Any]) -> AreaAlert:
    judged = content.get("judged")
    records = {
        "since": _since(content.get("since")), "origin": origin_of(content.get("origin")),
        "judged": None if judged is None else Judged(**judged),
    }  # fmt: skip
    return AreaAlert(**{**_levels(content), **records})


def _since(content: dict[str, Any] | None) -> Since | None:
    return None if content is None else Since(**content)


def _words(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of an alert or an area, as plain values, with its alert levels replaced by words."""
    return {**content, **{name: content[name].word for name in LEVELS}}


def _levels(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of an alert or an area in a log line, with the words for its levels replaced by `Level`."""
    return {**content, **{name: Level[content[name].upper()] for name in LEVELS}}
