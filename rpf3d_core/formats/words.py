"""Join words for messages, add units to numbers, and name scenes in titles."""

from collections.abc import Sequence
from pathlib import Path

USUAL = "scene"
"""Name, without suffix, that `rpf3d new` gives to every scene file."""


def either(words: Sequence[str]) -> str:
    """Return one or more words as a choice, such as "mm, cm or ft"."""
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last


def whole_degrees(angle: float) -> str:
    """Return an angle (degrees) as text without decimals, such as "1 degree"."""
    figure = f"{angle:.0f}"
    return f"{figure} {'degree' if figure == '1' else 'degrees'}"


def scene_name(path: Path) -> str:
    """Return the name of a scene for titles: the name of its file without suffix, or of the folder of a scene.yaml."""
    return path.resolve().parent.name or path.stem if path.stem == USUAL else path.stem
