"""The part of a report with the 3D view, the map of the rocks and the hazard maps."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rpf3d_core.hazard.filled_cells import ReachedCells, filling_cell, rocks_that_fill, share_of_cells
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.report.draped_map import FEW, caption_of
from rpf3d_core.report.elements import Element, Heading, Picture, Text, View
from rpf3d_core.report.run_files import HazardGrid, RunFiles, read_hazard
from rpf3d_core.report.section import CriticalSection
from rpf3d_core.report.toe import directions
from rpf3d_core.report.view import MOST_TRIANGLES, maps_seen, terrain_seen, view_html
from rpf3d_core.report.warnings_part import as_sentence

ENERGY = "hazard/energy_p95.png"
WORST_REACH = "hazard/reach_probability_worst_source.png"
WORST_REACH_WORDS = "Largest share of the rocks of one source that reached the cell."
PICTURES = (
    (("map.png", "Map: paths, releases and ends of rocks."),),
    (
        ("hazard/reach_probability_high.png",
         "Reach probability of the cells: upper end of its 95 % predictive interval."),
        (WORST_REACH, WORST_REACH_WORDS),
        ("hazard/reach_probability.png", "Reach probability of the cells."),
    ),
    ((WORST_REACH, WORST_REACH_WORDS),),
    (("hazard/energy_p95_worst_source.png", "Largest p95 energy of all rocks together and of all sources with "
      f"{FEWEST_ROCKS} rocks in the cell."),),
    ((ENERGY, "95th percentile of the energy in each cell. It may be larger than the p95 energy of the cell's zone, "
      "because it counts only the rocks that reached the cell, often few."),),
)  # fmt: skip
"""Pictures of the run that a report shows: for each picture, possible files with captions.

The first existing file is shown, unless an earlier picture shows the same file.
"""


def pictures_part(run: RunFiles, section: CriticalSection | None) -> Iterator[Element]:
    """Yield the part with the 3D view, the map of the rocks and the hazard maps; pictures without a file are left out.

    section : the critical section, None if there is none
    """
    seen, along = terrain_seen(run), directions(run.ends).mean(axis=0)
    looking = along / max(float(np.linalg.norm(along)), 1e-9)
    small = f", reduced from {seen.of:,} triangles to {len(seen.triangles):,}" if seen.of > MOST_TRIANGLES else ""
    maps = maps_seen(run, seen)
    about = caption_of([(each.corners, each.cell) for each in maps], any((each.values == FEW).any() for each in maps))
    caption = (f"Terrain around the rocks{small}. Drag to turn, scroll to zoom; a click on the legend shows or hides "
               f"maps and paths. {about}")  # fmt: skip
    yield Heading("Terrain, paths and hazard")
    view = view_html(run, seen, looking, None if section is None else section.key, maps)
    yield View(view, caption, "The rotatable 3D view is in the HTML file of this report.")
    done: set[str] = set()
    for choices in PICTURES:
        shown = next(((name, words) for name, words in choices if (run.folder / name).is_file()), None)
        if shown is not None and shown[0] not in done:
            name, words = shown
            done.add(name)
            more = _cells_without_energy(run) if name == ENERGY else ""
            yield Picture(_trimmed(run.folder / name), f"{words}{more}", 0.9)
    if notes := run.inputs.get("notes", ()):
        yield Text(" ".join(as_sentence(note) for note in notes), quiet=True)
    if not (run.folder / "map.png").is_file():
        yield Text("The run wrote no maps (`outputs.pictures` is false).", quiet=True)


def _cells_without_energy(run: RunFiles) -> str:
    """Return a sentence on the reached cells without an energy: too few rocks reached them; "" without such cells."""
    reached, energy = read_hazard(run, "reach_probability"), read_hazard(run, "energy_j", "p95")
    if reached is None:
        return ""
    cells = np.isfinite(reached.values)
    without = int(cells.sum()) if energy is None else int((cells & ~np.isfinite(energy.values)).sum())
    if not without:
        return ""
    of = int(cells.sum())
    return (f" A cell needs {FEWEST_ROCKS} rocks: {without:,} of the {of:,} cells that rocks reached have no value. "
            "That does not mean that they are safe; fly more rocks to fill them."
            f"{_filling(run, reached) if 2 * without > of else ''}")  # fmt: skip


def _filling(run: RunFiles, reached: HazardGrid) -> str:
    """Return a sentence with a number of rocks, and a cell size, that would give half of the reached cells an energy.

    The number of rocks is a lower bound, because more rocks also reach more cells.

    reached : the map of the reach probability
    """
    flown = int(run.summary["rocks"])
    row, column = np.nonzero(np.isfinite(reached.values))
    rocks = np.rint(reached.values[row, column] * flown).astype(np.int64)
    cells = ReachedCells(column, row, rocks, cell=reached.cell, widest=reached.cell * max(reached.values.shape))
    size = filling_cell(cells, share_of_cells)
    larger = "no larger cell fills half of them" if size is None else f"`hazard.cell: {size:g}` fills half of them"
    return (f" More than {rocks_that_fill(cells, flown):,} rocks are needed to fill half of them, because more rocks "
            f"also reach more cells; {larger}.")  # fmt: skip


def _trimmed(path: Path) -> bytes:
    """Return a picture of the run as PNG without its white margin."""
    from rpf3d_core.results.plots.trimmed import trimmed  # imported late, because it imports matplotlib

    return trimmed(path)
