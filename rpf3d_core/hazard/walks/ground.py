"""The terrain over which tracks are walked, with its search index and the raster of the maps."""

from typing import NamedTuple

from rpf3d_core.detection.bucket_grid import Block
from rpf3d_core.detection.bucket_locator import BucketLocator
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.sheet import Sheet, sheet_after, unknown_sheet
from rpf3d_core.terrain.facets import Facets, plain


class WalkedTerrain(NamedTuple):
    """The facets with their buckets, the neighbours of facets in plan, and the raster of the maps."""

    facets: Facets
    locator: BucketLocator
    sheet: Sheet
    raster: Raster


def ground_over(facets: Facets, locator: BucketLocator, raster: Raster) -> WalkedTerrain:
    """Return the terrain for walks; the neighbours of all facets are still unknown."""
    return WalkedTerrain(facets=facets, locator=locator, sheet=unknown_sheet(facets, locator), raster=raster)


def ground_after(before: WalkedTerrain, facets: Facets, locator: BucketLocator, changed: Block) -> WalkedTerrain:
    """Return the terrain for walks after facets in some buckets have changed; do not use `before` afterwards.

    The result reuses the memory of `before`.
    """
    return WalkedTerrain(
        facets=facets, locator=locator, sheet=sheet_after(before.sheet, facets, locator, changed), raster=before.raster
    )


def plain_ground(ground: WalkedTerrain) -> WalkedTerrain:
    """Return the terrain for walks in plain Python, which reads single numbers faster from memoryviews than arrays."""
    return ground._replace(facets=plain(ground.facets), sheet=plain(ground.sheet))
