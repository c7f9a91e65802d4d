"""Tests of the evidence that the simulating thread derives from an answer for a scene with unknowns."""

import itertools
from dataclasses import replace
from functools import partial

import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.live_ground import over_the_wall, pit_ground, pit_scene

from rpf3d_core.live.answers import EnsembleSize, answers
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.standing import stand_on
from rpf3d_ros.alerts.answer_evidence import EvidenceContext, evidence_of_answer
from rpf3d_ros.engine.flyer import Flyer
from rpf3d_ros.engine.waiting_sources import WaitingSources
from rpf3d_ros.messages.answer_content import warnings_of

PATIENCE = 120.0
wait = partial(wait_for, seconds=PATIENCE)
UNKNOWN = """\
target: {half_width: 1.0e-9, most_rocks: 2400}
unknowns: {sets: 40, priors: {materials.*.normal_restitution: {min: 0.2, max: 0.7}}}
"""


class Answers:
    """Keeps the answers and errors that a flyer reports."""

    def __init__(self):
        self.answers, self.errors = [], []

    def answered(self, answer):
        self.answers.append(answer)

    def unanswerable(self, trigger, why):
        self.errors.append(why)

    def groundless(self, trigger):
        self.errors.append("no ground")

    def failed(self, error, trigger=None):
        self.errors.append(error)


def test_sources_far_from_the_calibration_are_a_warning_and_a_note_of_the_evidence_and_no_fault(tmp_path):
    scene = pit_scene(tmp_path, "target: {most_rocks: 200}\n")
    standing = stand_on(pit_ground(scene), scene)
    size, spread = EnsembleSize(100), ReleaseSpread(above_ground=2.0)
    answer = next(answers(standing, over_the_wall(2), spread, {}, size, lambda stage: False, itertools.count(1)))
    context = EvidenceContext(standing=standing, at_ns=7, seed=scene.seed)
    assert evidence_of_answer(answer, context).notes == () and warnings_of(answer) == ()
    far = replace(answer, elsewhere="2 of 2 sources are away")
    found = evidence_of_answer(far, context)
    assert (found.notes, found.faults) == (("2 of 2 sources are away",), ())
    assert warnings_of(far) == ("2 of 2 sources are away",)


def test_each_stage_flies_the_parameter_sets_and_the_last_has_predictive_intervals(tmp_path):
    scene, kept = pit_scene(tmp_path, UNKNOWN), Answers()
    standing = stand_on(pit_ground(scene), scene)
    sources = WaitingSources(50.0, 10)
    flyer = Flyer(ReleaseSpread(above_ground=2.0), EnsembleSize(100), sources, itertools.count(1), kept)
    try:
        flyer.activate()
        flyer.hand_over(ready=standing)
        flyer.submit(over_the_wall(3, stamp_ns=5))
        wait(lambda: kept.errors or (kept.answers and kept.answers[-1].complete))
    finally:
        assert flyer.close(PATIENCE)
    assert kept.errors == []
    context = EvidenceContext(standing=standing, at_ns=7, seed=scene.seed)
    first, last = (evidence_of_answer(answer, context).areas[0] for answer in (kept.answers[0], kept.answers[-1]))
    assert (first.sets, first.predictive_high) == (40, None)
    assert last.sets == 40 and last.flown >= 2000
    assert last.predictive_low <= last.low <= last.high <= last.predictive_high
