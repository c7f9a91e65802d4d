"""Define what all pictures share: resolution, colours, axis labels, and the writing of a PNG file.

This module imports little, so that the pictures of `rpf3d cost` and of sections do not load the modules of the map and
profile pictures.
"""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

RESOLUTION = 120
"""Resolution of the pictures (dots per inch)."""

EQUAL = 0.02
"""Scales of heights and lengths that differ by less than this share (-) count as equal."""

GROUND, PATH = "#8a7a5c", "#1f4e9c"
"""Colours of the terrain and of paths in profiles and sections."""


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG file; no display is needed."""
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=RESOLUTION, pil_kwargs={"compress_level": 3})


def label(axes: Axes, x: str, y: str) -> None:
    """Set axis labels and a light grid; tick labels show survey coordinates in full, without an offset."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(visible=True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.ticklabel_format(useOffset=False, style="plain")


def scale_in_words(exaggerated: float) -> str:
    """Return the vertical exaggeration of a section in words, for the label of its heights.

    exaggerated : factor (-) by which heights are drawn larger than lengths, 1 for equal scales
    """
    if abs(exaggerated - 1.0) < EQUAL:
        return "heights and lengths have the same scale"
    factor = f"{exaggerated:,.0f}" if exaggerated >= 10.0 else f"{exaggerated:.2g}"
    return f"heights are drawn {factor} times as large as lengths"


def hex_colour(rgb: tuple[int, int, int]) -> str:
    """Return an sRGB colour (0 to 255) as a hexadecimal string such as "#1f4e9c"."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)
