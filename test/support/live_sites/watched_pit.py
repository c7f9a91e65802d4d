"""Start a node without a network over the pit of the never-green campaign, and read the levels that the node shows."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from never_green import combination
from never_green.combination import Run, configuration_of
from never_green.plan import Plan, Send, Speaker, Truth
from never_green.stories import RADAR_A, survey

from rpf3d_ros.alerts.place_checks import PlaceChecks


def start_with(monkeypatch: pytest.MonkeyPatch, plan: Plan, **parameters: Any) -> Run:
    """Start a node for a plan and return the run; parameters : parameters of the node to change."""

    def configured(plan: Plan) -> Any:
        before = configuration_of(plan)
        return replace(before, parameters=replace(before.parameters, **parameters))

    monkeypatch.setattr(combination, "configuration_of", configured)
    return Run(plan)


def start_over_the_pit(monkeypatch: pytest.MonkeyPatch, truth: Truth, topics: Sequence[str]) -> Run:
    """Start a node that keeps the sources of four walls (regions), deliver the survey of the pit, and return the run.

    The check of unreported places is off. Otherwise not only the guard under test, but also this check could notice a
    wall that is not answered again.

    truth : true state of the pit; topics : all topics with a publisher
    """
    plan = Plan(
        truth=truth, sends=(), speakers=tuple(Speaker(topic=topic, number=0) for topic in topics), sensors=(RADAR_A,),
        limits="restrict", expects=True,
    )  # fmt: skip
    monkeypatch.setattr(PlaceChecks, "submitted", lambda self, trigger: [trigger])
    run = start_with(monkeypatch, plan, waiting_sources=1, region_size=5.0)
    run.deliver(Send(sent=0.1, at=0.1, topic="terrain/points", kind="grid", places=survey(truth, 0.1)))
    return run


def shown_at(run: Run, at: float) -> str:
    """Call the node's timer every 0.25 s until a time `at` (s), and return the level shown then, as a word."""
    for tick in np.arange(run.at + 0.25, at + 0.01, 0.25).tolist():
        run.at = tick
        run.node.tick()
    return run.watcher.shown(run.at)
