"""Tests that the critical section names axes and units, and draws heights and lengths to one scale if possible."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from rpf3d_core.results.plots.section import SectionDrawing, section_figure
from rpf3d_core.results.plots.style import scale_in_words


def drawing(length: float, relief: float) -> SectionDrawing:
    distance = np.linspace(0.0, length, 50)
    at = np.linspace(0.0, length, 20)
    return SectionDrawing(
        distance=distance, ground=np.linspace(relief, 0.0, 50), paths=[], held=None, at=at, passed=np.zeros(20),
        sampling=np.zeros((2, 20)), predictive=None, origin="the toe of the first face",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("length", "relief", "scale"),
    [
        (100.0, 60.0, "heights and lengths have the same scale"), (300.0, 300.0, "the same scale"),
        (500.0, 20.0, "times as large as lengths"), (100.0, 200.0, "times as large as lengths"),
    ],
)  # fmt: skip
def test_both_panels_name_their_axes_and_the_scale_is_stated_and_true(length: float, relief: float, scale: str) -> None:
    figure = section_figure(drawing(length, relief))
    upper, lower = figure.axes
    assert upper.get_xlabel() == lower.get_xlabel() == "horizontal distance beyond the toe of the first face (m)"
    assert (upper.get_ylabel(), lower.get_ylabel()) == ("elevation (m)", "rocks that pass (%)")
    assert scale in upper.get_title(loc="left")
    (wide, high), box = figure.get_size_inches(), upper.get_position()
    (left, right), (low, top) = upper.get_xlim(), upper.get_ylim()
    drawn = (box.height * high / (top - low)) / (box.width * wide / (right - left))
    stated = 1.0 if "same" in scale else float(upper.get_title(loc="left").split()[3])
    assert drawn == pytest.approx(stated, rel=0.05)
    assert high < 8.2, "letters are readable on a page"


@pytest.mark.parametrize(("length", "relief"), [(300.0, 100.0), (100.0, 200.0)])
@pytest.mark.parametrize("predictive", [None, np.array([np.zeros(20), np.ones(20)])])
@pytest.mark.parametrize("source", ["", "the crest above the northern ramp"])
def test_the_legend_of_the_shares_covers_neither_the_curve_nor_a_label(
    length: float, relief: float, predictive: np.ndarray | None, source: str
) -> None:
    """All rocks may pass all distances, so the curve may be anywhere in the panel."""
    figure = section_figure(drawing(length, relief)._replace(predictive=predictive, source=source))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    upper, lower = figure.axes
    legend = lower.get_legend().get_window_extent(renderer)
    assert legend.y0 >= lower.bbox.y1 - 1.0
    assert legend.y1 <= upper.xaxis.label.get_window_extent(renderer).y0
    label = lower.xaxis.label.get_window_extent(renderer)
    assert label.x0 >= 0.0 and label.x1 <= figure.bbox.x1
    assert legend.x0 >= 0.0 and legend.x1 <= figure.bbox.x1


@pytest.mark.parametrize(("factor", "told"), [(2.56, "2.6"), (9.5, "9.5"), (12.4, "12"), (1234.0, "1,234")])
def test_a_large_exaggeration_is_written_without_an_exponent(factor: float, told: str) -> None:
    assert scale_in_words(factor) == f"heights are drawn {told} times as large as lengths"
