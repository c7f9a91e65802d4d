"""Join words for messages, and add units to numbers."""

from collections.abc import Sequence


def either(words: Sequence[str]) -> str:
    """Return one or more words as a choice, such as "mm, cm or ft"."""
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last


def whole_degrees(angle: float) -> str:
    """Return an angle (degrees) as text without decimals, such as "1 degree"."""
    figure = f"{angle:.0f}"
    return f"{figure} {'degree' if figure == '1' else 'degrees'}"
