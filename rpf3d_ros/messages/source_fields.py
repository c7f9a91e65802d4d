"""Find fields of a cloud of sources that look like the velocity or the size of a rock, but are not read.

A velocity or size that is silently ignored lets a fast rock start at rest, or makes a large rock small.
"""

import re
from collections.abc import Collection

from rpf3d_ros.messages.refusals import MessageRefused

VELOCITY = ("vx", "vy", "vz")
"""Fields with the velocity (m/s) of a source."""
DIAMETER = "diameter"
"""Field with the diameter (m) of a source, NaN where it is unknown."""

UNCERTAINTY = frozenset(
    ["std", "stdev", "sd", "var", "cov", "sigma", "err", "error", "uncertainty", "accuracy", "quality"]
)
"""Words in the name of a field that states the uncertainty of a value; such a field may stay unread."""
VELOCITY_ANYWHERE = re.compile(
    "(?<!le)vel|speed|doppler|rangerate|geschwindigkeit|vitesse"  # a level is no velocity
)
VELOCITY_WHOLE = re.compile(
    "v|v[xyzenudr]|d[xyz]|v(?:east|north|up|down|radial)|[xyz]dot|linear[xyz]|v[xyz](?:ms1?|mps|k[mp]h|si)"
)
"""Patterns of field names for a velocity: for a part of a name, and for a whole name.

The names are compared in lower case, with letters and digits only.
"""
SIZE_ANYWHERE = re.compile("size|diam|radius|volume|mass|weight|durchmesser")
SIZE_WHOLE = re.compile(
    "d|dm|dcm|dmm|dia|vol|deq|length|width|m3|kg|tons?|tonnes?|d(?:[0-9]{2,3}|max|mean)|"
    "(?:rock|block)(?:d|dia|vol)(?:m|cm|mm|m3)?"
)
"""Patterns of field names for the size of a rock: for a part of a name, and for a whole name."""


def check_names(names: Collection[str]) -> None:
    """Raise MessageRefused if a velocity or size of the sources seems to be in a field that is not read.

    In the names, only letters and digits are compared, without regard to case. A field that looks like a velocity is
    allowed if the cloud has a field `vx`, `vy` or `vz`. A field that looks like a size is allowed if the cloud has a
    field `diameter`. A field `v` is allowed next to a field `u` without `w`: both are coordinates in an image. A field
    with a word of UNCERTAINTY in its name is always allowed.

    names : names of the fields of the cloud
    """
    values = [name for name in names if UNCERTAINTY.isdisjoint(re.findall("[a-z]+", name.lower()))]
    plain = {name: re.sub("[^a-z0-9]", "", name.lower()) for name in values}
    if not any(name in VELOCITY for name in names):
        pixel = "u" in plain.values() and "w" not in plain.values()  # then `v` is a row of an image
        for name in (
            name for name, word in plain.items()
            if _is_like(word, VELOCITY_ANYWHERE, VELOCITY_WHOLE) and not (pixel and word == "v")
        ):  # fmt: skip
            raise MessageRefused(
                f"field '{name}' looks like a velocity, which must be in the fields 'vx', 'vy' and 'vz' (m/s, lower "
                "case): rename or convert the field; if it is something else, give it another name or leave it out"
            )
    if DIAMETER not in names:
        for name in (name for name, word in plain.items() if _is_like(word, SIZE_ANYWHERE, SIZE_WHOLE)):
            raise MessageRefused(
                f"field '{name}' looks like the size of a rock, which must be in the field 'diameter' (m, lower case): "
                "rename or convert the field; if it is something else, give it another name or leave it out"
            )


def _is_like(word: str, anywhere: "re.Pattern[str]", whole: "re.Pattern[str]") -> bool:
    """Return True if a part of a name (lower case) matches `anywhere`, or if the whole name matches `whole`."""
    return bool(anywhere.search(word) or whole.fullmatch(word))
