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

AXES = "[xyz]|east|north|up"
UNITS = "m|cm|mm|dm|km|ft|inch|in|m3|kg|t|tonnes?|ms|ms1|mps|kmh|kph|si"
OWNERS = "rock|block|boulder|source|object|target"
SPEEDS = "vel|velocity|speed|geschwindigkeit"
LOOKS_LIKE_VELOCITY = re.compile(
    f"(?:{OWNERS})?(?:v(?:{AXES}|[enu])|(?:linear|radial)?(?:{SPEEDS})(?:{AXES}|[012])?|[xyz](?:{SPEEDS}|dot)|doppler)"
    f"(?:{UNITS})?"
)
LOOKS_LIKE_SIZE = re.compile(
    f"(?:{OWNERS}|equivalent|mean|max)?(?:size|diameters?|diam|dia|radius|d[0-9][0-9]|dmax|dmean|volume|vol|mass|weight"
    f"|durchmesser|masse)(?:{UNITS})?"
)


def check_names(names: Collection[str]) -> None:
    """Raise MessageRefused if a velocity or size of the sources seems to be in a field that is not read.

    Case, units at the end of a name, and all characters other than letters and digits do not matter. A field that looks
    like a velocity does no harm if a field `vx`, `vy` or `vz` is there, nor does a size next to a field `diameter`.

    names : of the fields of the cloud
    """
    plain = {name: re.sub("[^a-z0-9]", "", name.lower()) for name in names}
    if not any(name in VELOCITY for name in names):
        for name in (name for name, word in plain.items() if LOOKS_LIKE_VELOCITY.fullmatch(word)):
            raise MessageRefused(
                f"field '{name}' looks like a velocity, which must be in the fields 'vx', 'vy' and 'vz' (m/s, lower "
                "case): rename or convert the field; if it is something else, give it another name or leave it out"
            )
    if DIAMETER not in names:
        for name in (name for name, word in plain.items() if LOOKS_LIKE_SIZE.fullmatch(word)):
            raise MessageRefused(
                f"field '{name}' looks like the size of a rock, which must be in the field 'diameter' (m, lower case): "
                "rename or convert the field; if it is something else, give it another name or leave it out"
            )
