"""Tests of the process rpf3d_simulator with unknowns of the ground: its alerts use predictive intervals."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import polygon, with_alerts

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.unknowns.parameter_sets import parameter_sets, write_parameter_sets
from rpf3d_core.unknowns.places import Surroundings

SCENE = """\
terrain: {pit: {}}
sources: [{name: sources, points: [[0, 0, 0]]}]
materials:
  default:
    normal_restitution: {prior: {min: 0.2, max: 0.7}}
    tangential_restitution: 0.8
    friction_angle_deg: 30
ground: sliding
target: {most_rocks: 4000}
unknowns: {sets: 40}
"""
SITE = """\
site: test pit
valid_s: 1
alarm_from: restrict
evidence:
  sources_max_age_s: 3600
  terrain_max_age_s: 3600
  clock_tolerance_s: 1
  fewest_rocks: 100
  most_unfinished: 1
  most_left: 1
  interval: INTERVAL
areas:
  live_area: {evacuate: {reach_probability: 0.995}}
"""
FAR = ((54.0, 2.0), (59.0, 2.0), (59.0, 58.0), (54.0, 58.0))
"""Corners (m) of an area that all rocks reach on hard ground, but not all rocks on soft ground."""


@pytest.mark.parametrize(("interval", "level", "words"), [
    ("predictive", "evacuate", "predictive over 40 parameter sets"),
    ("sampling", "normal", "from the number of rocks only"),
])  # fmt: skip
def test_the_interval_that_the_site_chooses_decides_and_an_audit_agrees(stage, interval, level, words):
    parameters = with_alerts(stage.folder)
    (stage.folder / "site.yaml").write_text(SITE.replace("INTERVAL", interval))
    (stage.folder / "live.yaml").write_text(SCENE)
    kept = {name: value for name, value in parameters.items() if not name.startswith(("ground", "target"))}
    process = stage.node("simulator_node", scene=stage.folder / "live.yaml", **kept)
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    peer.stand_on_ramp()
    peer.send("areas/polygon", polygon(FAR, peer.now()))
    assert int(peer.answered()["rocks"]) >= 40
    assert words in peer.wait_for_alert(level, reason=words).message
    assert process.poll() is None
    assert stage.clear() == [0], "the log is audited when nothing is written to it"
    audit = audit_log(stage.folder / "decisions")
    assert audit.sound and audit.decisions > 0


EAST, NORTH = 5e5, 4.5e6
CALIBRATED_IN = Surroundings(west=EAST, south=NORTH, east=EAST + 60.0, north=NORTH + 60.0)
"""Where the sample was calibrated, in survey coordinates."""
AWAY = "away from the place where the sample was calibrated"


@pytest.mark.parametrize(("origin", "is_away"), [([EAST, NORTH, 0.0], False), ([0.0, 0.0, 0.0], True)])
def test_a_sample_of_another_slope_is_a_warning_and_a_reason_of_the_alert_but_no_fault(stage, origin, is_away):
    """Depending on the origin of the map, the sources are at the place of the calibration or 4,500 km from it."""
    parameters = with_alerts(stage.folder)
    (stage.folder / "site.yaml").write_text(SITE.replace("INTERVAL", "predictive"))
    known = SCENE.replace("{prior: {min: 0.2, max: 0.7}}", "0.4")
    (stage.folder / "live.yaml").write_text(known.replace("{sets: 40}", "{sets: 40, sample: posterior.parquet}"))
    column = np.linspace(0.4, 0.7, 40)[:, None]
    sample = replace(parameter_sets(["materials.default.normal_restitution"], column), place=CALIBRATED_IN)
    write_parameter_sets(stage.folder / "posterior.parquet", sample)
    kept = {name: value for name, value in parameters.items() if not name.startswith(("ground", "target"))}
    process = stage.node("simulator_node", scene=stage.folder / "live.yaml", map_origin=origin, **kept)
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    peer.stand_on_ramp()
    peer.send("areas/polygon", polygon(FAR, peer.now()))
    peer.answered()
    if is_away:
        peer.wait_for_sentence(AWAY)
    alert = peer.wait_for_alert("evacuate", reason="predictive over 40 parameter sets")
    assert (AWAY in alert.message) == is_away and "fault" not in alert.message
    assert any(AWAY in said.message for said in peer.said) == is_away
    assert process.poll() is None
