"""Tests that the picture of a sweep draws an interval as a band only if it includes the scene's unknowns."""

from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from rpf3d_core.results.plots.sweep import INTERVAL, _bands, _draw
from rpf3d_core.results.series import Curve, Panel


def panel(is_predictive: bool, points: int = 3) -> Panel:
    at = list(range(points))
    curve = Curve(name="", at=at, values=[2.0] * points, low=[1.0] * points, high=[3.0] * points,
                  is_predictive=is_predictive)  # fmt: skip
    return Panel(title="retained", axis="share (%)", curves=[curve])


def bands_and_bars(drawn: Panel) -> tuple[int, int]:
    """Return how many shaded areas with an extent, and how many ends of bars, a panel draws."""
    axes = Figure().subplots()
    _draw(axes, drawn, {str(at): float(at) for at in drawn.curves[0].at}, "key")
    shaded = [each for each in axes.collections if isinstance(each, PolyCollection)]
    return len(shaded), sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() == "_")


def test_predictive_intervals_are_shaded_and_sampling_intervals_are_bars_at_each_point() -> None:
    assert bands_and_bars(panel(True)) == (1, 0)
    assert bands_and_bars(panel(False)) == (0, 6)
    assert bands_and_bars(panel(True, points=1))[1] == 0, "the band of one point is no bar"


def test_a_point_without_an_interval_has_a_question_mark_and_the_others_keep_their_bands() -> None:
    """The three points have an interval, no interval, and an interval with an unknown upper end."""
    drawn = panel(True)
    drawn = drawn._replace(curves=[drawn.curves[0]._replace(low=[1.0, None, 1.0], high=[3.0, None, None])])
    axes = Figure().subplots()
    _draw(axes, drawn, {str(at): float(at) for at in range(3)}, "key")
    (broad,) = (each for each in axes.collections if isinstance(each, LineCollection))
    assert [segment.tolist() for segment in broad.get_segments()] == [[[0, 1], [0, 3]], [[2, 1], [2, 2]]]
    assert [(text.get_text(), *text.xy) for text in axes.texts] == [("?", 1.0, 2.0), ("?", 2.0, 2.0)]
    assert _bands([drawn]) == f"bands: {INTERVAL[True]}; ?: unknown interval or end"


def test_the_heading_names_what_is_drawn() -> None:
    assert _bands([panel(True)]) == f"bands: {INTERVAL[True]}"
    assert _bands([panel(False)]) == f"bars: {INTERVAL[False]}"
    assert _bands([panel(False), panel(True)]) == f"bands: {INTERVAL[True]}; bars: {INTERVAL[False]}"


def test_a_panel_without_values_says_why_and_has_no_numbers_at_its_axes() -> None:
    drawn = panel(False)
    nothing = drawn.curves[0]._replace(values=[None] * 3, low=[None] * 3, high=[None] * 3)
    axes = Figure().subplots()
    unknown = drawn._replace(curves=[nothing], unknown="beyond the terrain")
    _draw(axes, unknown, {str(at): float(at) for at in range(3)}, "key")
    assert [text.get_text() for text in axes.texts] == ["beyond the terrain"]
    assert len(axes.get_xticks()) == len(axes.get_yticks()) == 0
    assert (axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel()) == ("retained", "key", "share (%)")
