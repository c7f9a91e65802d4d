"""What a track is walked over."""

from typing import NamedTuple

from rpf3d_core.detection.bucket_locator import BucketLocator
from rpf3d_core.detection.bucket_patch import Block
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.sheet import Sheet, sheet_after, unknown_sheet
from rpf3d_core.terrain.facets import Facets, plain


class WalkedTerrain(NamedTuple):
    """The terrain with its buckets, how its facets hang together in plan, and the raster of the maps."""

    facets: Facets
    locator: BucketLocator
    sheet: Sheet
    raster: Raster


def ground_over(facets: Facets, locator: BucketLocator, raster: Raster) -> WalkedTerrain:
    """A ground that no track has been walked over yet."""
    return WalkedTerrain(facets, locator, unknown_sheet(facets, locator), raster)


def ground_after(before: WalkedTerrain, facets: Facets, locator: BucketLocator, changed: Block) -> WalkedTerrain:
    """The ground after facets in some buckets have changed; `before`, in whose memory it lies, is not to be used."""
    return WalkedTerrain(facets, locator, sheet_after(before.sheet, facets, locator, changed), before.raster)


def plain_ground(ground: WalkedTerrain) -> WalkedTerrain:
    """The same for plain Python, which reads single numbers faster from memoryviews than from arrays."""
    return ground._replace(facets=plain(ground.facets), sheet=plain(ground.sheet))
