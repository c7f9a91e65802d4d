"""Tests that a simulator with wrong parameters does not start, and prints the reason."""

from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import CONFIGURE, PATIENCE, SITE

DEMO = Path(__file__).resolve().parents[3] / "config" / "scenes" / "demo.yaml"
REFUSED = {
    "a_parameter_out_of_its_range": ({"first_rocks": -3}, "first_rocks"),
    "a_scene_value_out_of_its_range": ({"materials.default.normal_restitution": 1.5}, "normal_restitution"),
    "a_scene_file_and_scene_values": ({"scene": DEMO, "gravity": 1.6}, "`gravity`"),
    "a_scene_file_that_is_not_there": ({"scene": "nowhere.yaml"}, "nowhere.yaml"),
    "an_origin_that_is_no_place": ({"map_origin": "[1.0, 2.0]"}, "map_origin"),
}
"""Case -> (parameters, text that the printed reason must contain)."""


@pytest.fixture(scope="module")
def started(shared_stage):
    """Start a simulator for each case, all at the same time; return case -> process."""
    return {case: shared_stage.named_node(case, "simulator_node", **given) for case, (given, _) in REFUSED.items()}


@pytest.mark.parametrize("case", REFUSED)
def test_it_is_refused_with_a_sentence_and_exit_code_2(started, shared_stage, case):
    assert started[case].wait(PATIENCE) == 2
    output = shared_stage.output(f"{case}/simulator_node")
    assert "Traceback" not in output
    (sentence,) = [line for line in output.splitlines() if line.startswith("rpf3d: ")]
    assert REFUSED[case][1] in sentence


def test_a_bad_site_file_leaves_the_simulator_unconfigured_with_the_reason_in_diagnostics_until_it_is_mended(stage):
    site = stage.folder / "site.yaml"
    site.write_text(SITE.format(oldest=-1))
    process = stage.node("simulator_node", site_file=site)
    peer = stage.live_peer()
    said = peer.wait_for_sentence("not configured")
    assert "sources_max_age_s" in said.message
    assert str(site) in said.message
    assert peer.state() == "unconfigured"
    site.write_text(SITE.format(oldest=60))
    assert peer.change(CONFIGURE)
    assert peer.state() == "inactive"
    assert process.poll() is None


@pytest.mark.long
def test_a_site_that_watches_an_area_which_no_outline_can_come_of_is_refused(stage):
    site = stage.folder / "site.yaml"
    site.write_text(SITE.format(oldest=60).replace("live_area*:", "hual_ramp:"))
    stage.node("simulator_node", site_file=site)
    said = stage.live_peer().wait_for_sentence("not configured")
    assert "watches hual_ramp, which has no outline" in said.message
