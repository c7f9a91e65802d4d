"""A scene file as text, with a comment beside every number that somebody should look at."""

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

WIDTH = 116
"""Columns of a comment."""

HOLDS_DEG, ANY_SPEED = 89.0, 1000.0
"""Friction angle (degrees) and stop speed (m/s) of ground that rocks stop in: on any slope of a grid, at any speed."""

NOT_CARRIED = "Not carried over:"


class MaterialZone(NamedTuple):
    """The ground of a zone, and where it lies: the lines of its material (YAML, without indentation), and its polygons.

    polygons : path of a GeoJSON file, relative to the scene; None for the zone that the rest of the terrain belongs to
    """

    name: str
    material: Sequence[str]
    polygons: str | None


class SceneText(NamedTuple):
    """What an imported scene says; `head`, `left` and the lines of the parts may hold comments.

    head : sentences about where it comes from ; left : sentences about what is not carried over
    rock, sources, models : lines of YAML
    """

    head: Sequence[str]
    left: Sequence[str]
    terrain: str
    zones: Sequence[MaterialZone]
    rock: Sequence[str]
    sources: Sequence[str]
    models: Sequence[str]

    def __str__(self) -> str:
        """The file."""
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
    """Sentences as lines of comment, each beginning on a line of its own."""
    return [f"# {line}" for sentence in sentences for line in textwrap.wrap(sentence, WIDTH)]


def item(sentence: str) -> list[str]:
    """A sentence as an item of a list in a comment."""
    first, *more = textwrap.wrap(sentence, WIDTH - 2, break_long_words=False)
    return [f"# - {first}", *(f"#   {line}" for line in more)]


def number(value: float) -> str:
    """A number with at most six digits, as YAML reads it."""
    return f"{value:.6g}"


def normal(mean: float, sd: float, low: float, high: float) -> str:
    """A truncated normal distribution, or its mean where the bounds enclose nothing."""
    if number(low) == number(high):
        return number(mean)
    return f"{{mean: {number(mean)}, sd: {number(sd)}, min: {number(low)}, max: {number(high)}}}"


def uniform(low: float, high: float) -> str:
    """A uniform distribution, or the number where there is but one."""
    return number(low) if number(low) == number(high) else f"{{uniform: [{number(low)}, {number(high)}]}}"


def names_of(words: Sequence[str]) -> list[str]:
    """The words, with a number behind those that came before: names must differ."""
    seen: dict[str, int] = {}
    names = []
    for word in words:
        seen[word] = seen.get(word, 0) + 1
        names.append(word if seen[word] == 1 else f"{word}_no{seen[word]}")
    return names


def stopping(why: str) -> list[str]:
    """The lines of a material that stops every rock which meets it."""
    return [
        *comment(why), "normal_restitution: 0", "tangential_restitution: 0", f"friction_angle_deg: {HOLDS_DEG:g}",
        f"stop_speed: {ANY_SPEED:g}",
    ]  # fmt: skip


def counted(count: int, noun: str) -> str:
    """So many of something, or one."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def span(values: Sequence[float] | np.ndarray, unit: str) -> str:
    """From the least to the largest of some numbers with their unit, or the one that there is."""
    low, high = number(min(values)), number(max(values))
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"
