"""Make evidence, thresholds and a decision log of a small site, for tests of alerts."""

from pathlib import Path
from typing import Any

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.evidence import AreaEvidence, Evidence, untouched
from rpf3d_core.alerts.levels import Acknowledgement, Alert, acknowledgement
from rpf3d_core.alerts.lines import Decision
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.origins import Origin
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.ensemble.statistics import wilson_interval

S = 1_000_000_000
"""One second in nanoseconds."""
NOW = 1_800_000_000 * S
EXAMPLE = Path(__file__).parents[3] / "config" / "site_example.yaml"
FLOWN = 10_000

EVIDENCE_TERMS = {
    "sources_max_age_s": 30,
    "terrain_max_age_s": 3600,
    "clock_tolerance_s": 0.5,
    "fewest_rocks": 1000,
    "most_unfinished": 0.1,
    "moved_area_s": 1,
}
RAMP = {
    "watch": {"reach_probability": 0.01},
    "restrict": {"reach_probability": 0.05, "p95_energy_j": 1e5},
    "evacuate": {"reach_probability": 0.2, "first_arrival_s": {"evacuation": 8, "margin": 2}},
}


def site(areas: dict[str, Any] | None = None, **terms: Any) -> Thresholds:
    """Return the thresholds of the small site.

    areas : limits of each area, by name; None for the area `ramp` with the limits RAMP
    terms : values that differ from EVIDENCE_TERMS
    """
    return Thresholds.model_validate(
        {
            "site": "test pit",
            "valid_s": 10,
            "alarm_from": "restrict",
            "evidence": {**EVIDENCE_TERMS, **terms},
            "areas": areas or {"ramp": RAMP},
        }
    )


def area(reached: int = 0, name: str = "ramp", flown: int = FLOWN, **facts: Any) -> AreaEvidence:
    """Return the evidence of an area; by default, rocks that reach the area have low energies and arrive late.

    reached, flown : numbers of rocks; facts : other fields of `AreaEvidence`
    """
    came = reached > 0
    measured = {
        "p95_energy": 1e3 if came else None,
        "largest_energy": 2e3 if came else None,
        "first_arrival_s": 60.0 if came else None,
    }
    low, high = wilson_interval(reached, max(flown, 1))
    told = {"name": name, "flown": flown, "reached": reached, "low": low, "high": high}
    return AreaEvidence(**{**told, **measured, **facts})


def evidence(*areas: AreaEvidence, now: int = NOW, **facts: Any) -> Evidence:
    """Return the evidence of an answer; by default the answer is one second old at the time `now` (ns).

    By default, the only area is the ramp, which none of 10,000 rocks reached. facts : fields of `Evidence` to change
    """
    made = Evidence(
        result=7, stage=3, at_ns=now - S, trigger_stamp_ns=now - 2 * S, terrain_stamp_ns=now - 60 * S,
        terrain_digest="7e" * 32, sources_digest="5c" * 32, sources=20, seed=1, version="0.1.0",
        areas=areas or (area(),),
    )  # fmt: skip
    return made._replace(**facts)


def origin(topic: str = "radar", **facts: Any) -> Origin:
    """Return the origin of a figure: a cluster of three sources, with the terrain and sources of `evidence`.

    facts : fields of `Origin` to change
    """
    made = Origin(
        topic=topic, place=(1.5, -2.25, 30.0), sources=3, sources_digest="5c" * 32, terrain_digest="7e" * 32,
        terrain_stamp_ns=NOW - 60 * S,
    )  # fmt: skip
    return made._replace(**facts)


def nothing_seen(now: int = NOW, **facts: Any) -> Evidence:
    """Return the evidence of a message without sources; by default, the answer is one second old at `now` (ns)."""
    return evidence(*untouched(["ramp"]), now=now, sources=0, **facts)


NORMAL, WATCH, RESTRICT, EVACUATE = (evidence(area(reached)) for reached in (0, 120, 700, 3000))
"""Evidence of the time NOW that leads to each level with the limits RAMP, from `normal` to `evacuate`."""


def later(answer: Evidence, seconds: int) -> Evidence:
    """Return the evidence with the times of answer, sources and terrain later by `seconds`."""
    shift = seconds * S
    return answer._replace(
        at_ns=answer.at_ns + shift,
        trigger_stamp_ns=answer.trigger_stamp_ns + shift,
        terrain_stamp_ns=answer.terrain_stamp_ns + shift,
    )


def decided(*answers: Evidence | None, thresholds: Thresholds | None = None) -> Alert:
    """Decide on several pieces of evidence, one second apart from NOW on, and return the last alert.

    answers : evidence of the time NOW, which is shifted to the time of its decision; None for no evidence
    thresholds : None for those of `site()`
    """
    alert = None
    for step, answer in enumerate(answers):
        told = None if answer is None else later(answer, step)
        alert = decide(alert, told, thresholds or site(), NOW + step * S)
    assert alert is not None
    return alert


def seen_by(at_ns: int) -> Acknowledgement:
    """Return an acknowledgement with a name and a reason, at a time (ns)."""
    return acknowledgement("A. Shift", "inspected from the other side", at_ns)


SHIFT = (NORMAL, WATCH, EVACUATE, None, NORMAL, "acknowledged", NORMAL)
"""One entry for each second: the level rises, then there is no evidence, then a person acknowledges.

An entry is evidence of the time NOW, None for no evidence, or "acknowledged" for NORMAL with an acknowledgement.
"""


def logged_shift(folder: Path, thresholds: Thresholds | None = None, **options: Any) -> list[Alert]:
    """Decide on each entry of SHIFT, log the decisions in a folder, and return the alerts.

    thresholds : None for those of `site()`; options : further arguments of `DecisionLog`
    """
    alerts: list[Alert] = []
    thresholds = thresholds or site()
    with DecisionLog(folder, "0.1.0", **options) as log:
        previous = log.last_alert
        for step, answer in enumerate(SHIFT):
            now, given = NOW + step * S, None
            if isinstance(answer, str):
                answer, given = NORMAL, seen_by(now)
            told = None if answer is None else later(answer, step)
            alert = decide(previous, told, thresholds, now, given)
            log.decided(Decision(previous, told, given, now, alert), thresholds)
            previous = alert
            alerts.append(alert)
    return alerts
