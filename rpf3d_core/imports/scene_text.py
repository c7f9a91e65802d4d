"""Write an imported scene file as text, with a comment next to every number that the user should check."""

import textwrap
from collections.abc import Sequence
from itertools import count
from typing import NamedTuple

import numpy as np

WIDTH = 116
"""Largest number of characters in a comment line of the scene file."""

HOLDS_DEG, ANY_SPEED = 89.0, 1000.0
"""Friction angle (degrees) and stop speed (m/s) of ground that stops every rock, on any slope and at any speed."""

NOT_CARRIED = "Not carried over:"


class MaterialZone(NamedTuple):
    """A zone of the scene with its material.

    material : lines of YAML, without indentation
    polygons : path of a GeoJSON file, relative to the scene; None for the zone of all terrain outside other zones
    """

    name: str
    material: Sequence[str]
    polygons: str | None


class SceneText(NamedTuple):
    """The content from which the text of an imported scene file is made.

    head : sentences on the origin of the scene; left : sentences on input that is not imported
    terrain : path of the elevation grid, relative to the scene; zones : exactly one zone has no polygons
    rock, sources, models : lines of YAML, with comments
    """

    head: Sequence[str]
    left: Sequence[str]
    terrain: str
    zones: Sequence[MaterialZone]
    rock: Sequence[str]
    sources: Sequence[str]
    models: Sequence[str]

    def __str__(self) -> str:
        """Return the text of the scene file (YAML)."""
        rest = next(zone for zone in self.zones if zone.polygons is None)
        drawn = [zone for zone in self.zones if zone.polygons is not None]
        lines = [*comment(*self.head), "#", f"# {NOT_CARRIED}", *(line for text in self.left for line in item(text))]
        lines += ["terrain:", "  files:", f"    - {{path: {self.terrain}, zone: {rest.name}}}"]
        lines += ["zones:"] if drawn else []
        lines += [f"  - {{zone: {zone.name}, polygons: {zone.polygons}}}" for zone in drawn]
        lines += ["materials:"]
        for zone in self.zones:
            lines += [f"  {zone.name}:", *(f"    {line}" for line in zone.material)]
        return "\n".join([*lines, *self.rock, *self.sources, *self.models]) + "\n"


def comment(*sentences: str) -> list[str]:
    """Return sentences as comment lines of the scene file; each sentence starts a new line."""
    return [f"# {line}" for sentence in sentences for line in textwrap.wrap(sentence, WIDTH)]


def item(sentence: str) -> list[str]:
    """Return a sentence as a list item ("- ...") in the comment lines of the scene file."""
    first, *more = textwrap.wrap(sentence, WIDTH - 2, break_long_words=False)
    return [f"# - {first}", *(f"#   {line}" for line in more)]


def number(value: float) -> str:
    """Return a number as text for the scene file, with at most six significant digits."""
    return f"{value:.6g}"


def normal(mean: float, sd: float, low: float, high: float) -> str:
    """Return a truncated normal distribution as text for the scene file; the mean if the bounds round to one number."""
    if number(low) == number(high):
        return number(mean)
    return f"{{mean: {number(mean)}, sd: {number(sd)}, min: {number(low)}, max: {number(high)}}}"


def uniform(low: float, high: float) -> str:
    """Return a uniform distribution as text for the scene file; one number if both bounds round to the same number."""
    return number(low) if number(low) == number(high) else f"{{uniform: [{number(low)}, {number(high)}]}}"


def names_of(words: Sequence[str]) -> list[str]:
    """Return distinct names for zones: a repeated word gets a suffix with a number."""
    taken, names = set(words), list[str]()
    for word in words:
        if word in names:
            free = (f"{word}_no{n}" for n in count(2))
            word = next(each for each in free if each not in taken)
            taken.add(word)
        names.append(word)
    return names


def stopping(why: str) -> list[str]:
    """Return the lines of a material that stops every rock on contact; why : a sentence for the comment."""
    return [
        *comment(why), "normal_restitution: 0", "tangential_restitution: 0", f"friction_angle_deg: {HOLDS_DEG:g}",
        f"stop_speed: {ANY_SPEED:g}",
    ]  # fmt: skip


def counted(count: int, noun: str) -> str:
    """Return a count with its noun for messages, in the plural unless the count is 1."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def span(values: Sequence[float] | np.ndarray, unit: str) -> str:
    """Return the range of values as text with unit, such as "1 to 5 m3"; one number if all are equal.

    values : (N,) in `unit`
    """
    low, high = number(min(values)), number(max(values))
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"
