"""Read the forest of a Rockyfor3D folder from its rasters, and find its files of single trees and nets.

A scene has one forest of one density, so the rasters become means over the wooded cells.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rpf3d_core.imports.grids import Cells, Grids, refuse_where, require
from rpf3d_core.imports.scene_text import comment, number
from rpf3d_core.scene.models.keys import EffectsSpec

STEMS, MEAN, SD, CONIFERS = "nrtrees", "dbhmean", "dbhstd", "conif_percent"
FOREST = (STEMS, MEAN, SD, CONIFERS)
NETS = ("net_number", "net_energy", "net_height")
"""File names of the rasters of nets. The names are unconfirmed."""
TREES = ("treefile.txt", "treefile.csv", "trees.txt", "trees.csv")
"""Names of files of single trees. The names are unconfirmed."""
WOODED = "forest.geojson"
PERCENT = 100.0


class ImportedForest(NamedTuple):
    """The forest that the import writes into the scene, as means over the wooded cells.

    cells : (H, W) True where there are trees; stems : per hectare
    dbh_mean, dbh_sd : mean and standard deviation of the diameter at breast height (cm); conifers : share (-)
    """

    cells: Cells
    stems: float
    dbh_mean: float
    dbh_sd: float
    conifers: float


def forest_of(folder: Path, grids: Grids) -> ImportedForest | None:
    """Return the forest of a Rockyfor3D folder; None if there are no forest rasters, or no trees in them.

    Raises
    ------
    InputError
        One of the four rasters is missing or has a value out of range; the message names the file, and the cell of the
        value.
    """
    given = [name for name in FOREST if name in grids.files]
    if not given:
        return None
    require(folder, grids.files, FOREST, f"a forest ({given[0]}.asc is there)")
    stems, mean, sd, conifers = (grids.values[name] for name in FOREST)
    cells = grids.ground & (stems > 0.0)
    refuse_where(grids, STEMS, grids.ground & (stems < 0.0), "must be a number of stems a hectare, 0 for none")
    refuse_where(grids, MEAN, cells & ~(mean > 0.0), "must be a diameter above 0 cm where there are trees")
    refuse_where(grids, SD, cells & ~(sd >= 0.0), "must be a standard deviation of at least 0 cm where there are trees")
    share = (conifers >= 0.0) & (conifers <= PERCENT)
    refuse_where(grids, CONIFERS, cells & ~share, "must be from 0 to 100 percent where there are trees")
    return _means(grids, cells) if cells.any() else None


def _means(grids: Grids, cells: Cells) -> ImportedForest:
    """Return the mean forest over the wooded cells, because a scene has one forest of one density.

    Diameters and conifers are means over trees (weighted by the stems of a cell); the number of stems is a mean over
    cells.
    """
    stems, mean, sd, conifers = (grids.values[name][cells] for name in FOREST)
    all_mean = float(np.average(mean, weights=stems))
    variance = np.average(sd**2 + (mean - all_mean) ** 2, weights=stems)
    share = float(np.average(conifers, weights=stems)) / PERCENT
    return ImportedForest(
        cells=cells, stems=float(stems.mean()), dbh_mean=all_mean, dbh_sd=float(np.sqrt(variance)), conifers=share
    )


def has_forest() -> bool:
    """Return True if this version of rpf3d has the effect `forest`, so that the import can use it."""
    return "forest" in EffectsSpec.model_fields


def forest_lines(forest: ImportedForest | None) -> list[str]:
    """Return the lines of the effect `forest` in the scene file; [] without forest.

    The lines are comments if this version of rpf3d does not have the effect.
    """
    if forest is None:
        return []
    lines = [
        "effects:", "  forest:", f"    stems_per_ha: {number(forest.stems)}", f"    within: {WOODED}",
        f"    dbh_mean_cm: {number(forest.dbh_mean)}", f"    dbh_sd_cm: {number(forest.dbh_sd)}",
        f"    conifer_share: {number(forest.conifers)}",
    ]  # fmt: skip
    return lines if has_forest() else ["# This version has no forest.", *(f"# {line}" for line in lines)]


def without_effect(folder: Path, files: Mapping[str, Path]) -> list[Path]:
    """Return the files of single trees and nets in a folder, which the import copies but does not read.

    files : grids of the folder, by name
    """
    trees = sorted(path for path in folder.iterdir() if path.name.lower() in TREES)
    return trees + [files[name] for name in NETS if name in files]


def without_effect_lines(extra: list[Path]) -> list[str]:
    """Return comment lines for the scene file that name the files that are copied but not read; [] if none."""
    names = ", ".join(path.name.lower() for path in extra)
    return comment(f"Copied next to this file, but without effect: {names}.") if extra else []
