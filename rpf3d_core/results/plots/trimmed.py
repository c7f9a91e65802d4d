"""Cut the white margin off a picture of a run, for a report."""

import io
from pathlib import Path

import numpy as np
from matplotlib.image import imread, imsave

MARGIN = 12
"""Width (pixels) of the white margin that is left around a picture."""
WHITE = 0.999
"""A pixel counts as white if its red, green and blue are at least this (-)."""


def trimmed(path: Path) -> bytes:
    """Return a PNG file's content after its white margin has been cut down to about MARGIN pixels.

    A picture that is all white is returned unchanged.
    """
    image = np.asarray(imread(path))
    inked = np.any(image[..., :3] < WHITE, axis=2)
    if not np.any(inked):
        return path.read_bytes()
    rows, columns = np.flatnonzero(np.any(inked, axis=1)), np.flatnonzero(np.any(inked, axis=0))
    top, left = max(rows[0] - MARGIN, 0), max(columns[0] - MARGIN, 0)
    content = io.BytesIO()
    imsave(content, np.ascontiguousarray(image[top : rows[-1] + MARGIN, left : columns[-1] + MARGIN]), format="png")
    return content.getvalue()
