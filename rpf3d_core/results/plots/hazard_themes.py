"""Choose what each hazard picture of a run shows: the values of the cells, the title, the unit and the scale."""

from dataclasses import dataclass

import numpy as np

from rpf3d_core.hazard.maps import HazardMaps, reach_probability
from rpf3d_core.hazard.passages import passage_per_metre
from rpf3d_core.hazard.scales import Scale, Values, reach_scale, scale_of_energy, scale_of_height, scale_of_passages

JOULE_PER_KJ = 1000.0


@dataclass(frozen=True, eq=False)
class Theme:
    """The quantity that one hazard picture shows: values, title, unit and colour scale.

    title : part of the picture's title between the scene and the number of rocks; unit : label of the colour bar
    values : (C,) of all cells of the raster, in SI units, NaN where unknown; scale : colour scale of `values`
    per_unit : number of SI units in one unit of the colour bar, such as 1000 for kJ
    """

    title: str
    unit: str
    values: Values
    scale: Scale
    per_unit: float = 1.0


def themes(maps: HazardMaps) -> dict[str, Theme]:
    """Return a `Theme` for each hazard picture of a run, by the name of the picture's file without extension."""
    cells, wide = maps.cells, f"in cells of {maps.raster.cell:g} m"
    share = reach_probability(cells, maps.flown)
    p95 = "95th percentile of the rocks' largest"
    return {
        "reach_probability": Theme(
            "reach probability", f"share of all rocks that come to a cell\nof {maps.raster.cell:g} m (%)",
            cells.everywhere(share, np.nan), reach_scale(maps.flown, share), 0.01,
        ),
        **_upper_end(maps),
        **_per_metre(maps),
        "energy_p95": Theme(
            f"{p95} energy", f"{maps.energy_kind} kinetic energy, p95 (kJ),\n{wide}",
            cells.everywhere(cells.energy.p95, np.nan), scale_of_energy(cells.energy.p95), JOULE_PER_KJ,
        ),
        "height_p95": Theme(
            f"{p95} height", f"height above the ground, p95 (m),\n{wide}", cells.everywhere(cells.height.p95, np.nan),
            scale_of_height(cells.height.p95),
        ),
        **_of_worst(maps),
    }  # fmt: skip


def _upper_end(maps: HazardMaps) -> dict[str, Theme]:
    """Return the picture of the upper end of the predictive interval of reach probability, as an entry of `themes`.

    Without parameter sets there is no predictive interval, and the result is empty.
    """
    if maps.reach_band is None:
        return {}
    band, cell = maps.reach_band, maps.raster.cell
    high = np.full(maps.cells.count, np.nan)
    high[band.cell] = np.where(band.high > 0.0, band.high, np.nan)
    return {
        "reach_probability_high": Theme(
            "reach probability, predictive upper end (95 %)",
            f"share of all rocks that come to a cell of {cell:g} m (%),\n"
            f"upper end over {maps.sets.flown} parameter sets",
            high, reach_scale(maps.flown, band.high), 0.01,
        )
    }  # fmt: skip


def _per_metre(maps: HazardMaps) -> dict[str, Theme]:
    """Return the picture of passages per metre as an entry of `themes`; empty if the maps do not have this quantity."""
    if not maps.cells.has_ways:
        return {}
    value = passage_per_metre(maps).value
    unit = "share of all rocks that pass a metre\nacross their way (%/m), whatever the cell"
    known = np.where(value > 0.0, value, np.nan)
    scale = scale_of_passages(known)
    return {"passage_per_metre": Theme("passages per metre", unit, maps.cells.everywhere(known, np.nan), scale, 0.01)}


def _of_worst(maps: HazardMaps) -> dict[str, Theme]:
    """Return the pictures of the worst source of each cell as entries of `themes`.

    The result is empty for a scene with one source, and if the counts of the sources needed too much memory.
    """
    cells, worst, wide = maps.cells, maps.worst_cells, f"in cells of {maps.raster.cell:g} m"
    if worst is None:
        return {}
    return {
        "reach_probability_worst_source": Theme(
            "reach probability, worst source", f"largest share of the rocks of a source that\ncome to a cell of "
            f"{maps.raster.cell:g} m (%)", cells.everywhere(worst.reach, np.nan),
            reach_scale(int(maps.sources.flown.max()), worst.reach), 0.01,
        ),
        "energy_p95_worst_source": Theme(
            "95th percentile of the rocks' largest energy, worst source",
            f"{maps.energy_kind} kinetic energy, p95 (kJ),\n{wide}", cells.everywhere(worst.energy, np.nan),
            scale_of_energy(worst.energy), JOULE_PER_KJ,
        ),
    }  # fmt: skip
