"""Sentences on hazard maps for the user: cell size, largest values, and which values depend on the cell size."""

import math

from rpf3d_core.ensemble.outward import interval_as, three_figures
from rpf3d_core.hazard.maps import FEWEST_ROCKS, HazardMaps, reach_probability
from rpf3d_core.hazard.passages import passage_per_metre
from rpf3d_core.hazard.raster import round_cells
from rpf3d_core.terrain.frame import FloatArray


def words_on_maps(maps: HazardMaps) -> str:
    """Return one line on the hazard maps, which is printed at the end of a run.

    The line states the cell size, the number of reached cells, the largest reach probability of a cell and, if mapped,
    the largest number of passages per metre with its interval.
    """
    cell, share = maps.raster.cell, reach_probability(maps.cells, maps.flown)
    cells = f"hazard maps: cells of {cell:g} m, of which {len(maps.cells.cell):,} were reached"
    if not len(share):
        return cells
    most = f"a cell by {_percent(share)} of the rocks{_of_a_source(maps)} at most (grows with the cell)"
    if not maps.cells.has_ways:
        return f"{cells}, {most}"
    passage = passage_per_metre(maps)
    place = int(passage.value.argmax())
    value, *ends = (100.0 * float(values[place]) for values in passage)
    in_text = f"{three_figures(value)} % ({interval_as(ends, three_figures)})"
    return f"{cells}, {most}; at most {in_text} pass a metre across their way, whatever the cell"


def _of_a_source(maps: HazardMaps) -> str:
    """Return text on the largest share of the rocks of a source that reached a cell; "" if it is not known."""
    worst = maps.worst_cells
    return "" if worst is None else f", or {_percent(worst.reach)} of the rocks of a source,"


def _percent(shares: FloatArray) -> str:
    return f"{three_figures(100.0 * float(shares.max()))} %"


def words_on_empty(maps: HazardMaps) -> str:
    """Return the text that a picture of percentiles shows if no cell has a value: the reason, and what would help.

    The text states a number of rocks and a cell size (m). With about this number of rocks, or with this cell size, at
    least one cell should have a value. If rocks reached no cell at all, the text states the reason only.
    """
    if not len(maps.cells.cell):
        return "No values: no rock came anywhere."
    most, cell = int(maps.cells.rocks.max()), maps.raster.cell
    rocks = math.ceil(FEWEST_ROCKS / most * maps.flown)
    wide = next(size for size in round_cells() if size >= FEWEST_ROCKS / most * cell)
    return (
        f"No values: no cell was reached by\n{FEWEST_ROCKS} rocks. More rocks, or a larger\n"
        f"hazard.cell in the scene, give some:\n{most} came to a cell of {cell:g} m at most,\n"
        f"so about {rocks:,} rocks, or\n`cell: {wide:g}`."
    )
