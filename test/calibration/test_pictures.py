"""Tests that the pictures of a calibration draw nothing over the observed stops."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rpf3d_core.results.plots import calibration
from rpf3d_core.results.plots.calibration import Predicted, write_predicted


def test_the_legend_of_the_plan_covers_no_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = list[Figure]()
    monkeypatch.setattr(calibration, "save", lambda figure, path: drawn.append(figure))
    corners = np.array([[0.0, 0.0], [0.0, 10.0], [20.0, 0.0], [20.0, 10.0]])  # stops in every corner
    predicted = Predicted(np.random.default_rng(1).uniform((0, 0), (20, 10), (500, 2)), np.full(500, 1 / 500))
    write_predicted(tmp_path / "predicted.png", corners, predicted, predicted)
    (figure,) = drawn
    FigureCanvasAgg(figure).draw()
    plan = figure.axes[2]
    legend = plan.get_legend()
    assert legend is not None
    assert not legend.get_window_extent().overlaps(plan.get_window_extent())
    assert [text.get_text() for text in legend.get_texts()] == ["predicted", "observed"]
