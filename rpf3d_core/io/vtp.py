"""terrain.vtp (the trace map) and trajectories.vtp, to be opened together in ParaView.

Points are float64 in the input's own coordinates: survey coordinates do not fit float32.
The trace map is the thesis' record of impacts on the terrain (Peik, chapter 3.3 and figure 3-3 a).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from rpf3d_core.ensemble.flights import Deposits, Impacts
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.quantities import STATISTICS, counts_of, shares_of, spreads_of, statistics_of
from rpf3d_core.io.tables import lower_names
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Mode, Outcome


def write_terrain(path: Path, terrain: Terrain, impacts: Impacts, maps: HazardMaps | None = None) -> None:
    """Write the trace map: every facet with its id, zone, number of impacts and hit flag; zone names as field data.

    Parameters
    ----------
    maps : HazardMaps, optional
        Their facets' layers come on top, named as the rasters in hazard/ (`facet_layers`); impacts are theirs, too,
        for a tally counts every rock, and `impacts` may hold fewer.

    Raises
    ------
    OSError
        The file could not be written.
    """
    layers = {} if maps is None else facet_layers(maps)
    count = layers.pop("impacts", None)
    if count is None:
        count = np.bincount(impacts.facet[impacts.facet >= 0], minlength=len(terrain.triangles)).astype(np.int32)
    data = triangle_mesh(terrain.frame.points_to_input(terrain.vertices), terrain.triangles)
    _attach(
        data.GetCellData(),
        {
            "facet": np.arange(len(count), dtype=np.int32),
            "zone": terrain.zone,
            "impacts": count,
            "hit": (count > 0).astype(np.uint8),
            **layers,
        },
    )
    data.GetCellData().SetActiveScalars("impacts")
    _attach_names(data, "zone_names", terrain.zones)
    _write(path, data)


def facet_layers(maps: HazardMaps) -> dict[str, NDArray[Any]]:
    """The layers of the facets, arrays (F,) by name; counts as whole numbers, everything else in single precision.

    A spread is an array a statistic, such as `energy_j_p95` (J), `speed_m_s_max` (m/s), `height_m_mean` (m); NaN where
    no rock came, and in percentiles where fewer than 20 did. Double precision would double the file.
    """
    layers: dict[str, NDArray[Any]] = {
        quantity.name: values.astype(np.float32, copy=False) for quantity, values in shares_of(maps, maps.facets)
    }
    layers |= {quantity.name: counts for quantity, counts in counts_of(maps.facets)}
    for quantity, spread in spreads_of(maps.facets):
        for name, values in zip(STATISTICS, statistics_of(spread), strict=True):
            layers[f"{quantity.name}_{name}"] = values.astype(np.float32, copy=False)
    return layers


def write_trajectories(
    path: Path, sources: Sequence[str], terrain: Terrain, deposits: Deposits, samples: PathSamples
) -> None:
    """Write one polyline a rock.

    Points carry speed (m/s), time (s), rock, row and mode; lines carry source, rock, row and outcome. `row` counts
    rocks over all sources, `rock` within one; the names of sources, modes and outcomes are field data.

    Raises
    ------
    OSError
        The file could not be written.
    """
    starts = samples.starts
    data = vtkPolyData()
    data.SetPoints(_points(terrain.frame.points_to_input(samples.x)))
    data.SetLines(_cells(np.append(starts, len(samples.row)), np.arange(len(samples.row))))
    _attach(
        data.GetPointData(),
        {"speed": samples.speed, "time": samples.t, "mode": samples.mode, **_rock_ids(deposits, samples.row)},
    )
    data.GetPointData().SetActiveScalars("speed")
    rows = samples.row[starts]
    _attach(
        data.GetCellData(),
        {"source": deposits.source[rows], "outcome": deposits.outcome[rows], **_rock_ids(deposits, rows)},
    )
    for name, names in (("source", sources), ("mode", lower_names(Mode)), ("outcome", lower_names(Outcome))):
        _attach_names(data, f"{name}_names", names)
    _write(path, data)


def triangle_mesh(vertices: FloatArray, triangles: NDArray[np.integer]) -> vtkPolyData:
    """Vertices (V, 3) m and triangles (F, 3) as VTK poly data in double precision."""
    data = vtkPolyData()
    data.SetPoints(_points(vertices))
    data.SetPolys(_cells(np.arange(0, 3 * len(triangles) + 1, 3, dtype=np.int32), triangles.ravel()))
    return data


def _rock_ids(deposits: Deposits, rows: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    return {"rock": deposits.rock[rows], "row": rows}


def _points(xyz: FloatArray) -> Any:
    """Points (N, 3) as vtkPoints in double precision."""
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(xyz)))
    return points


def _cells(offsets: NDArray[np.integer], connectivity: NDArray[np.integer]) -> Any:
    """Cells of which number i joins connectivity[offsets[i]:offsets[i + 1]]; 32 bit, for no terrain needs more."""
    cells = vtkCellArray()
    cells.SetData(*(numpy_to_vtk(numbers.astype(np.int32, copy=False)) for numbers in (offsets, connectivity)))
    return cells


def _attach(attributes: Any, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Attach named arrays (N,); whole numbers as 32 bit, for ParaView's colour maps need no more.

    VTK looks into the arrays, and keeps them alive: copies would take as much memory as the terrain.
    """
    for name, values in arrays.items():
        narrow = values.astype(np.int32) if values.dtype == np.int64 else values
        array = numpy_to_vtk(np.ascontiguousarray(narrow))
        array.SetName(name)
        attributes.AddArray(array)


def _attach_names(data: Any, name: str, values: Sequence[str]) -> None:
    """Field data: the name of each index."""
    array = vtkStringArray()
    array.SetName(name)
    for value in values:
        array.InsertNextValue(value)
    data.GetFieldData().AddArray(array)


def _write(path: Path, data: Any) -> None:
    """Appended raw binary, LZ4: the 2.33 million facets of the thesis' mesh take 2 s with zlib, less than 1 s so."""
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetHeaderTypeToUInt64()
    writer.SetCompressorTypeToLZ4()
    writer.SetInputData(data)
    if not writer.Write() or writer.GetErrorCode():
        raise OSError(f"{path}: could not be written")
