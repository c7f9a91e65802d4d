"""Triggers: the sources that one message of the monitoring reports, to which the simulator gives an answer."""

import hashlib
from dataclasses import dataclass

import numpy as np

from rpf3d_core.terrain.frame import FloatArray


@dataclass(frozen=True, eq=False)
class Trigger:
    """The S sources of one message; S = 0 means that the walls were watched and no source was seen.

    positions : (S, 3) m, map frame; velocities : (S, 3) m/s
    diameters : (S,) m, NaN where unknown; None if the message has no diameters
    stamp_ns : stamp (ns) of the message
    digest : SHA-256 (hex) of the values above, as from `digest_of`; topic : the topic of the message
    is_unreported : True if the sources are places that the topic no longer reports; their answer can only be a fault
    """

    positions: FloatArray
    velocities: FloatArray
    diameters: FloatArray | None
    stamp_ns: int
    digest: str
    topic: str = ""
    is_unreported: bool = False


def trigger_of(
    positions: FloatArray, velocities: FloatArray, diameters: FloatArray | None, stamp_ns: int, topic: str = ""
) -> Trigger:
    """Return the sources of one message as a trigger, with a digest that identifies them in logs.

    positions : (S, 3) m, map frame; velocities : (S, 3) m/s
    diameters : (S,) m, NaN where unknown; None if the message has no diameters
    stamp_ns : stamp (ns) of the message; topic : topic of the message
    """
    digest = digest_of(positions, velocities, diameters, stamp_ns)
    return Trigger(positions, velocities, diameters, stamp_ns, digest, topic)


def digest_of(positions: FloatArray, velocities: FloatArray, diameters: FloatArray | None, stamp_ns: int) -> str:
    """Return a digest (SHA-256, hex) that identifies sources; it depends on the numbers, not on their data type.

    positions : (S, 3) m; velocities : (S, 3) m/s; diameters : (S,) m or None; stamp_ns : stamp of the message, ns
    """
    found = hashlib.sha256(f"sources {len(positions)} {stamp_ns}".encode())
    for column in (positions, velocities, diameters):
        found.update(b"-" if column is None else np.ascontiguousarray(column, dtype="<f8").tobytes())
    return found.hexdigest()
