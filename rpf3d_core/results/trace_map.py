"""Write terrain.vtp (the trace map: impacts on each facet) and trajectories.vtp, to be opened in ParaView.

Points are float64 in the input's own coordinates, because survey coordinates do not fit float32.
The trace map is the thesis' record of impacts on the terrain (Peik, chapter 3.3 and figure 3-3 a).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import Deposits, Impacts
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.formats.vtp import Array, PolyData, Scattered, write_poly_data
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.quantities import STATISTICS, Quantity, counts_of, shares_of, spreads_of, statistics_of
from rpf3d_core.results.columns import lower_names
from rpf3d_core.results.orientations import orientations_to_input
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import Mode, Outcome


def write_terrain(path: Path, terrain: Terrain, impacts: Impacts, maps: HazardMaps | None = None) -> None:
    """Write terrain.vtp: every facet with its id, zone, number of impacts, and whether a rock hit it.

    The file also contains the names of the zones, as field data of VTK.

    Parameters
    ----------
    maps : HazardMaps, optional
        Adds the layers of the facets, named as the rasters in hazard/ (`facet_layers`). The number of impacts then
        comes from the maps, which count every rock; `impacts` may contain fewer rocks.

    Raises
    ------
    OSError
        The file could not be written.
    """
    facets = len(terrain.triangles)
    layers = {} if maps is None else facet_layers(maps)
    count = layers.pop("impacts", None)
    if count is None:
        struck, number = np.unique(impacts.facet[impacts.facet >= 0], return_counts=True)
        count = Scattered(cells=facets, cell=struck, values=number.astype(np.int32), elsewhere=0)
    cell_data: dict[str, Array] = {
        "impacts": count,
        "hit": count._replace(values=(count.values > 0).astype(np.uint8)),
        "facet": np.arange(facets, dtype=np.int32),
        "zone": terrain.zone,
        **layers,
    }
    points, ends = terrain.frame.points_to_input(terrain.vertices), np.arange(3, 3 * facets + 1, 3, dtype=np.int32)
    mesh = PolyData(
        points=points,
        kind="Polys",
        ends=ends,
        corners=terrain.triangles.ravel(),
        point_data={},
        cell_data=cell_data,
        names={"zone_names": terrain.zones},
    )
    write_poly_data(path, mesh)


def facet_layers(maps: HazardMaps) -> dict[str, Scattered]:
    """Return the hazard values of the facets as arrays for terrain.vtp, by name.

    Counts are whole numbers, other values are in single precision. A quantity with a spread has one array for each
    statistic, such as `energy_j_p95` (J), `speed_m_s_max` (m/s), `height_m_mean` (m). A statistic is NaN for a facet
    that no rock reached, a percentile also for a facet that fewer than 20 rocks reached. In double precision the file
    would be twice as large.
    """
    facets = maps.facets

    def layer(quantity: Quantity, values: NDArray[Any]) -> Scattered:
        return Scattered(cells=facets.count, cell=facets.cell, values=values, elsewhere=quantity.elsewhere)

    layers = {what.name: layer(what, values.astype(np.float32)) for what, values in shares_of(maps, facets)}
    layers |= {what.name: layer(what, counts) for what, counts in counts_of(facets)}
    for what, spread in spreads_of(facets):
        for name, values in zip(STATISTICS, statistics_of(spread), strict=True):
            layers[f"{what.name}_{name}"] = layer(what, values.astype(np.float32))
    return layers


def write_trajectories(
    path: Path, sources: Sequence[str], terrain: Terrain, deposits: Deposits, samples: PathSamples
) -> None:
    """Write trajectories.vtp: the path of each rock as one line.

    Points have speed (m/s), time (s), rock, row and mode; polylines have source, rock, row and outcome. `row` counts
    rocks over all sources, `rock` within one source. The names of sources, modes and outcomes are field data of VTK.

    Points of rocks with a shape also have `orientation`: the quaternion w, x, y, z from the body's principal axes to
    the input's axes, in the order in which ParaView's glyphs read it.

    Raises
    ------
    OSError
        The file could not be written.
    """
    count = len(samples.row)
    rows, ends = samples.row[samples.starts], np.append(samples.starts, count)[1:].astype(np.int32)
    point_data: dict[str, Array] = {
        "speed": samples.speed,
        "time": samples.t,
        "mode": samples.mode,
        **_rock_ids(deposits, samples.row),
    }
    if samples.q is not None:
        point_data["orientation"] = orientations_to_input(terrain.frame, samples.q)
    cell_data = {"source": deposits.source[rows], "outcome": deposits.outcome[rows], **_rock_ids(deposits, rows)}
    names = {"source_names": sources, "mode_names": lower_names(Mode), "outcome_names": lower_names(Outcome)}
    points, corners = terrain.frame.points_to_input(samples.x), np.arange(count, dtype=np.int32)
    write_poly_data(
        path,
        PolyData(
            points=points,
            kind="Lines",
            ends=ends,
            corners=corners,
            point_data=point_data,
            cell_data=cell_data,
            names=names,
        ),
    )


def _rock_ids(deposits: Deposits, rows: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    return {"rock": deposits.rock[rows], "row": rows}
