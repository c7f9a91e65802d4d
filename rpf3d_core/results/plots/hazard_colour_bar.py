"""Draw the colour bar of a hazard picture, and give values the colours of the bar."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from rpf3d_core.hazard.scales import Scale, Values, colours_at, round_steps
from rpf3d_core.results.plots.hazard_themes import Theme

BAR_HEIGHT = 0.17
"""Height of the colour bar (inches)."""


def colour_map() -> Colormap:
    """Return the hazard colours as a matplotlib colour map of 256 steps."""
    return ListedColormap(colours_at(np.linspace(0.0, 1.0, 256)) / 255.0)


def norm_of(scale: Scale) -> Normalize:
    """Return the matplotlib norm, linear or logarithmic, that maps values of a colour scale to 0 to 1."""
    kind = LogNorm if scale.logarithmic else Normalize
    return kind(scale.low, scale.high)


def draw_colour_bar(figure: Figure, side: Axes, theme: Theme) -> Axes:
    """Draw the colour bar next to the map, with round numbers in the unit of the picture; return its axes."""
    box = side.get_position()
    height = BAR_HEIGHT / figure.get_size_inches()[1]
    bar = figure.add_axes((box.x0 + 0.02 * box.width, box.y0 + 0.87 * box.height, 0.93 * box.width, height))
    scale = Scale(
        low=theme.scale.low / theme.per_unit,
        high=theme.scale.high / theme.per_unit,
        logarithmic=theme.scale.logarithmic,
    )
    colours = figure.colorbar(
        ScalarMappable(norm_of(scale), colour_map()),
        cax=bar,
        orientation="horizontal",
        extend=arrow_ends(scale, theme.values[np.isfinite(theme.values)] / theme.per_unit),
    )
    colours.set_label(theme.unit, fontsize=9)
    colours.ax.tick_params(labelsize=9)
    if scale.logarithmic:
        colours.locator = LogLocator(10, round_steps(scale.low, scale.high), numticks=20)
        colours.formatter = FuncFormatter(lambda value, _: f"{value:,.6g}")
        colours.minorlocator = NullLocator()
        colours.update_ticks()
    return bar


def arrow_ends(scale: Scale, known: Values) -> str:
    """Return the ends of the colour bar to draw as arrows, because values lie beyond the ends of the scale.

    The result is a value of matplotlib's `extend`: "neither", "min", "max" or "both".

    known : (N,) all known values, in the unit of the scale
    """
    below, above = bool((known < scale.low).any()), bool((known > scale.high).any())
    return {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[below, above]
