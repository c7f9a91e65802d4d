"""Start a node without a network over the pit of the never-green campaign, and read the levels that the node shows."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from never_green import combination
from never_green.combination import Run, configuration_of
from never_green.plan import Plan


def start_with(monkeypatch: pytest.MonkeyPatch, plan: Plan, **parameters: Any) -> Run:
    """Start a node for a plan and return the run; parameters : parameters of the node to change."""

    def configured(plan: Plan) -> Any:
        before = configuration_of(plan)
        return replace(before, parameters=replace(before.parameters, **parameters))

    monkeypatch.setattr(combination, "configuration_of", configured)
    return Run(plan)


def shown_at(run: Run, at: float) -> str:
    """Call the node's timer every 0.25 s until a time `at` (s), and return the level shown then, as a word."""
    for tick in np.arange(run.at + 0.25, at + 0.01, 0.25).tolist():
        run.at = tick
        run.node.tick()
    return run.watcher.shown(run.at)
