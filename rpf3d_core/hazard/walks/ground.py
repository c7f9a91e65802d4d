"""The terrain below the paths, with its search structure and the raster of the maps."""

from typing import NamedTuple

from rpf3d_core.detection.bucket_grid import CellRectangle
from rpf3d_core.detection.bucket_locator import BucketLocator
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.walks.sheet import Sheet, sheet_after, unknown_sheet
from rpf3d_core.terrain.facets import Facets, plain


class WalkedTerrain(NamedTuple):
    """The terrain below the paths of rocks, and the raster of the hazard maps, as the loops that count rocks read them.

    facets, locator : the terrain and its search structure; sheet : known neighbours of facets
    """

    facets: Facets
    locator: BucketLocator
    sheet: Sheet
    raster: Raster


def ground_over(facets: Facets, locator: BucketLocator, raster: Raster) -> WalkedTerrain:
    """Return terrain, search structure and raster for the counting loops, with all neighbours of facets still unknown.

    The loops find neighbours when they need them.
    """
    return WalkedTerrain(facets=facets, locator=locator, sheet=unknown_sheet(facets, locator), raster=raster)


def ground_after(
    before: WalkedTerrain, facets: Facets, locator: BucketLocator, changed: CellRectangle
) -> WalkedTerrain:
    """Return the terrain below the paths after some facets have changed; `before` must not be used afterwards.

    changed : the buckets (search squares) with changed facets. The result reuses the memory of `before`.
    """
    return WalkedTerrain(
        facets=facets, locator=locator, sheet=sheet_after(before.sheet, facets, locator, changed), raster=before.raster
    )


def plain_ground(ground: WalkedTerrain) -> WalkedTerrain:
    """Return the terrain with memoryviews in place of the arrays of `facets` and `sheet`.

    Plain Python reads single numbers from memoryviews faster than from arrays.
    """
    return ground._replace(facets=plain(ground.facets), sheet=plain(ground.sheet))
