"""Write the folder hazard/ of a run: rasters, zones, bench table, barrier table and pictures of the hazard maps."""

from pathlib import Path

from rpf3d_core.hazard.benches import bench_table
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.results.findings import MapContent
from rpf3d_core.results.hazard_files.benches_csv import write_benches
from rpf3d_core.results.hazard_files.geotiffs import write_hazard_rasters
from rpf3d_core.results.hazard_files.zones_geojson import write_hazard_zones
from rpf3d_core.scene.hazard import HazardSpec
from rpf3d_core.terrain.frame import FloatArray


def write_hazard(
    folder: Path,
    content: MapContent,
    maps: HazardMaps,
    spec: HazardSpec,
    crs: str | None,
    releases: FloatArray,
    pictures: bool = True,
) -> None:
    """Create the folder hazard/ of a result, and write all files of the hazard maps into it.

    Parameters
    ----------
    spec, crs : the scene's `hazard` and `terrain.crs`
    releases : (N, 2 or 3) m
        Release points of the rocks, local frame.
    pictures : True to write pictures as well

    Raises
    ------
    InputError
        The reference system is unknown, or is in degrees.
    OSError
        A file could not be written.
    """
    terrain = content.terrain
    folder.mkdir()
    write_hazard_rasters(folder, terrain, maps, crs)
    write_hazard_zones(folder / "zones.geojson", terrain, maps, spec, crs)
    write_benches(folder / "benches.csv", bench_table(terrain, maps))
    if maps.barriers:
        from rpf3d_core.results.hazard_files.barriers_report import write_barriers

        write_barriers(folder / "barriers.csv", maps.barriers)
    if pictures:
        # Imported here, because the import of matplotlib takes most of a second, and only a run with pictures needs it.
        from rpf3d_core.results.plots.hazard import write_hazard_pictures

        write_hazard_pictures(folder, content, maps, releases)
