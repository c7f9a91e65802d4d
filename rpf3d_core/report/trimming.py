"""Cut the white margin off a picture."""

import io

from PIL import Image, ImageChops

MARGIN = 12
"""Pixels of white that stay around a picture."""


def trimmed(png: bytes) -> bytes:
    """Return a PNG picture without its white margin."""
    image = Image.open(io.BytesIO(png)).convert("RGB")
    box = ImageChops.difference(image, Image.new("RGB", image.size, "white")).getbbox()
    if box is None:
        return png
    left, top, right, bottom = box
    width, height = image.size
    part = (max(left - MARGIN, 0), max(top - MARGIN, 0), min(right + MARGIN, width), min(bottom + MARGIN, height))
    content = io.BytesIO()
    image.crop(part).save(content, format="PNG", optimize=True)
    return content.getvalue()
