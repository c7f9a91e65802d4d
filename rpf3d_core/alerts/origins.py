"""Origins: which cluster of sources gave a figure of the evidence, and over which terrain its rocks flew."""

from typing import NamedTuple


class Origin(NamedTuple):
    """A cluster of sources, and the terrain that its rocks flew over.

    topic : topic of the message with the sources; sources_digest : digest of all sources of this message
    place : (x, y, z) m, middle of the cluster's sources, map frame; sources : number of the cluster's sources
    terrain_digest : digest of the terrain; terrain_stamp_ns : stamp of its whole survey
    """

    topic: str
    place: tuple[float, float, float]
    sources: int
    sources_digest: str
    terrain_digest: str
    terrain_stamp_ns: int


class Origins(NamedTuple):
    """The cluster that gave each figure of an area that is compared with a limit; None if unknown.

    reached : the cluster that gave the share of rocks and its sampling interval
    predictive : the cluster that gave the upper end of the predictive interval
    energy : the cluster that gave the p95 or largest energy; first_arrival : the cluster that gave the first arrival
    energy_high, first_arrival_low : the clusters that gave the upper end of the energy and the lower end of the first
        arrival over the parameter sets; None if the cluster is that of `energy` or `first_arrival`
    """

    reached: Origin | None
    predictive: Origin | None
    energy: Origin | None
    first_arrival: Origin | None
    energy_high: Origin | None = None
    first_arrival_low: Origin | None = None


NOT_KNOWN = Origins(reached=None, predictive=None, energy=None, first_arrival=None)
"""The origins of figures whose clusters are not known."""


def all_from(origin: Origin) -> Origins:
    """Return the origins of figures that all come from one cluster."""
    return Origins(reached=origin, predictive=origin, energy=origin, first_arrival=origin)
