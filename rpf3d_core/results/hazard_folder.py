"""Write the folder hazard/ of a run, without its pictures: rasters, zones, bench table and barrier table."""

from pathlib import Path

from rpf3d_core.hazard.benches import bench_table
from rpf3d_core.hazard.by_source.each_source import benches_of_sources
from rpf3d_core.hazard.by_source.worst_barriers import has_source_barriers
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.results.hazard_files.benches_csv import write_benches, write_sources
from rpf3d_core.results.hazard_files.geotiffs import write_hazard_rasters
from rpf3d_core.results.hazard_files.zones_geojson import write_hazard_zones
from rpf3d_core.scene.hazard import HazardSpec
from rpf3d_core.terrain.facets import Terrain


def write_hazard(folder: Path, terrain: Terrain, maps: HazardMaps, spec: HazardSpec, crs: str | None) -> None:
    """Write the files of the hazard maps into the existing folder hazard/ of a result, without the pictures.

    Parameters
    ----------
    spec, crs : the scene's `hazard` and `terrain.crs`

    Raises
    ------
    InputError
        The coordinate reference system is unknown, or its unit is degrees.
    OSError
        A file could not be written.
    """
    write_hazard_rasters(folder, terrain, maps, crs)
    write_hazard_zones(folder / "zones.geojson", terrain, maps, spec, crs)
    write_benches(folder / "benches.csv", bench_table(terrain, maps))
    if maps.sources is not None:
        write_sources(folder / "sources.csv", benches_of_sources(terrain, maps))
    if maps.barriers:
        from rpf3d_core.results.hazard_files.barriers_report import write_barriers, write_source_barriers

        write_barriers(folder / "barriers.csv", maps)
        if has_source_barriers(maps):
            write_source_barriers(folder / "source_barriers.csv", maps)
