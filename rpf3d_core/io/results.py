"""The folder that a run leaves behind, written whole or not at all."""

import json
import os
import shutil
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.paths import PathSamples, displayed_rows, sample_paths
from rpf3d_core.errors import InputError
from rpf3d_core.io import tables, vtp
from rpf3d_core.io.areas import local_outlines, read_areas
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.io.summary import summary
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.faults import FaultReport

Record = Callable[[Path, dict[str, Any]], None]
"""Writes a recording to a path, given the summary."""

SUMMARY = "summary.json"

RESULT_NAMES = {
    SUMMARY, "deposits.csv", "impacts.parquet", "trajectories.parquet", "terrain.vtp", "trajectories.vtp",
    "profiles", "map.png", "hazard", "run.rrd",
}  # fmt: skip
"""All that a result folder may hold; a folder with anything else in it is never replaced."""


def write_results(
    folder: str | Path,
    scene: Scene,
    terrain: Terrain,
    faults: FaultReport,
    flights: Flights,
    timings: Mapping[str, float],
    record: Record | None = None,
) -> Path:
    """Write everything that a run leaves behind, and return the folder.

    All is written into a hidden folder beside it, which takes the place of `folder` at the end, so that nothing
    half-written ever looks like a result. An earlier result there is replaced.

    Parameters
    ----------
    timings : name -> s
        Wall times so far, copied into summary.json; `write_s` and `total_s` = `wall_s` + `write_s` are added.
    record : function of (path, summary), optional
        Writes `run.rrd`; see `recordings.log.write_recording`. Not written if not given.

    Raises
    ------
    InputError
        As `check_folder`, or if a file that the scene names for the summary is damaged.
    """
    target = check_folder(folder)
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        part.mkdir()
        _write_all(part, scene, terrain, faults, flights, timings, record)
        _replace(target, part)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return target


def check_folder(folder: str | Path) -> Path:
    """The absolute path of a folder that results may be written to; call it before a long run.

    Raises
    ------
    InputError
        If it is a file, or a folder with content other than an earlier result.
    """
    target = Path(folder).resolve()
    if target.is_dir():
        _refuse_foreign_content(target)
    elif target.exists():
        raise InputError(f"{folder}: is a file; the results need the path of a folder")
    above = next(parent for parent in target.parents if parent.exists())
    if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: cannot be written, for {above} is not a folder that may be written to")
    return target


def _refuse_foreign_content(target: Path) -> None:
    names = {entry.name for entry in target.iterdir()}
    if not names:
        return
    if not _is_result(target):
        raise InputError(f"{target}: holds files that are not rpf3d's; give the path of a new or empty folder")
    if foreign := sorted(names - RESULT_NAMES):
        raise InputError(f"{target}: holds {foreign[0]!r} beside a result; move it away or give another folder")


def _is_result(target: Path) -> bool:
    try:
        return bool(json.loads((target / SUMMARY).read_text(encoding="utf-8"))["program"] == "rpf3d")
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _replace(target: Path, part: Path) -> None:
    """Let `part` take the place of `target`; if that fails, what was there stays."""
    old = target.with_name(f".{target.name}.{os.getpid()}.old")
    if target.exists():
        target.rename(old)
    try:
        part.rename(target)
    except OSError:
        if old.exists():
            old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _write_all(
    folder: Path,
    scene: Scene,
    terrain: Terrain,
    faults: FaultReport,
    flights: Flights,
    timings: Mapping[str, float],
    record: Record | None,
) -> None:
    """The summary is written last, for it says how long the rest took."""
    start = time.perf_counter()
    facts = summary(scene, terrain, faults, flights, timings)
    samples = sample_paths(
        flights.paths, displayed_rows(flights.paths, scene.outputs.trajectories), gravity=scene.gravity
    )
    _write_tables(folder, scene, terrain, flights, samples)
    _write_pictures(folder, scene, terrain, flights, samples)
    if record is not None:
        record(folder / "run.rrd", facts)
    facts["write_s"] = time.perf_counter() - start
    facts["total_s"] = timings.get("wall_s", 0.0) + facts["write_s"]
    (folder / SUMMARY).write_text(json.dumps(facts, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _write_tables(folder: Path, scene: Scene, terrain: Terrain, flights: Flights, samples: PathSamples) -> None:
    sources, deposits = [source.name for source in scene.sources], flights.deposits
    tables.write_deposits(folder / "deposits.csv", sources, terrain, deposits)
    tables.write_impacts(folder / "impacts.parquet", sources, terrain, flights)
    tables.write_trajectories(folder / "trajectories.parquet", sources, terrain, deposits, samples)
    vtp.write_terrain(folder / "terrain.vtp", terrain, flights.impacts)
    vtp.write_trajectories(folder / "trajectories.vtp", sources, terrain, deposits, samples)


def _write_pictures(folder: Path, scene: Scene, terrain: Terrain, flights: Flights, samples: PathSamples) -> None:
    # matplotlib takes most of a second to import: only a run that draws pays for it.
    from rpf3d_core.io.plots_map import write_map
    from rpf3d_core.io.plots_profiles import write_profile_plots

    sources = [source.name for source in scene.sources]
    profiles = folder / "profiles"
    profiles.mkdir()
    write_profile_plots(profiles, sources, terrain, flights, samples, scene.gravity)
    areas = {name: local_outlines(terrain.frame, area) for name, area in read_areas(scene).items()}
    title = f"{scene.path.stem}: {len(flights.deposits.rock)} rocks"
    write_map(folder / "map.png", title, terrain, flights.deposits, samples, areas)
