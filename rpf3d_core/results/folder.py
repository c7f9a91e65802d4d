"""Write the result folder of a run: either all files, or none if an error occurs."""

import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rpf3d_core.ensemble.flights import Flights, IntArray
from rpf3d_core.ensemble.paths import PathSamples, displayed_rows, sample_paths
from rpf3d_core.errors import InputError
from rpf3d_core.formats.words import scene_name
from rpf3d_core.results import tables
from rpf3d_core.results import trace_map as vtp
from rpf3d_core.results.calibration_folder import is_calibration
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_folder import write_hazard
from rpf3d_core.results.inputs import INPUTS, write_inputs
from rpf3d_core.results.orientations import blocks_of, moments_of
from rpf3d_core.results.painting import Painting
from rpf3d_core.results.shown import RunPictures
from rpf3d_core.results.summary import summary

Record = Callable[[Path, dict[str, Any]], None]
"""A function that writes a recording, given its path and the summary of the run."""

SUMMARY = "summary.json"
CRITICAL = "critical_rock.parquet"
"""File with the path of the rock that stopped farthest from its release; written if the kept paths lack this path."""
MEGABYTE = 1_000_000
LEAST_ROOM = 20 * MEGABYTE
"""Free space (bytes) that the disk must have before a run: the size of a small result with pictures."""

PRICE_LIST = ("cost.json", "cost.png", "cost.rrd")
"""Names of the files that `rpf3d cost` writes; a run that replaces a result in the same folder keeps these files."""
RESULT_NAMES = {
    SUMMARY, INPUTS, "deposits.csv", "impacts.parquet", "trajectories.parquet", "terrain.vtp", "trajectories.vtp",
    CRITICAL, "profiles", "map.png", "hazard", "convergence.png", "run.rrd", "parameter_sets.parquet", *PRICE_LIST,
}  # fmt: skip
"""Names of the files and folders in a result folder; a folder that contains anything else is never replaced."""


@contextmanager
def result_folder(folder: str | Path) -> Iterator[Path]:
    """Yield a hidden folder to write a result into; then rename it to `folder`, or delete it after an error.

    So an incomplete folder never looks like a result, and an earlier result in `folder` survives an error. The files
    PRICE_LIST of an earlier result are copied into the new folder.

    Raises
    ------
    InputError
        `folder` cannot be used (see `check_folder`), or the disk is full before or during the writing.
    """
    target = check_folder(folder)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        part.mkdir(parents=True)
        _check_room(folder, part)
        yield part
        for name in PRICE_LIST:
            if (target / name).is_file():
                shutil.copy2(target / name, part / name)
        _replace(target, part)
    except OSError as fault:
        raise InputError(f"{folder}: could not be written ({fault.strerror or fault})") from fault
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _check_room(folder: str | Path, part: Path) -> None:
    """Raise an InputError if the disk has fewer than LEAST_ROOM bytes free, before a run starts.

    folder : the result folder, for the message; part : an existing folder on the same disk
    """
    if (free := shutil.disk_usage(part).free) < LEAST_ROOM:
        needed = f"{free / MEGABYTE:.1f} MB are free, and at least {LEAST_ROOM // MEGABYTE} MB are needed"
        raise InputError(f"{folder}: the disk has no room: {needed}")


def check_folder(folder: str | Path) -> Path:
    """Check that results may be written to a folder, and return its absolute path; call this before a long run.

    Raises
    ------
    InputError
        The path is a file or a folder with content other than an earlier result, or no folder can be written there.
    """
    target = Path(folder).resolve()
    if target.is_dir():
        _refuse_foreign_content(target)
    elif target.exists():
        raise InputError(f"{folder}: is a file; the results need the path of a folder")
    above = next(parent for parent in target.parents if parent.exists())
    if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: cannot be written, because {above} is not a folder that may be written to")
    return target


def _refuse_foreign_content(target: Path) -> None:
    names = {entry.name for entry in target.iterdir()}
    if not names:
        return
    if is_calibration(target):
        raise InputError(f"{target}: is the folder of a calibration, where no other result is written; give the path "
                         f"of a new or empty folder, such as {target.with_name(target.name + '_run')}")  # fmt: skip
    if not _is_result(target):
        raise InputError(f"{target}: holds {min(names)!r}, but no result of rpf3d; give the path of a new or empty "
                         "folder")  # fmt: skip
    if foreign := sorted(names - RESULT_NAMES):
        raise InputError(f"{target}: holds {foreign[0]!r} next to a result; move this file away or give another folder")


def _is_result(target: Path) -> bool:
    return any(_is_ours(target / name) for name in (SUMMARY, PRICE_LIST[0]))


def _is_ours(path: Path) -> bool:
    try:
        return bool(json.loads(path.read_text(encoding="utf-8"))["program"] == "rpf3d")
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _replace(target: Path, part: Path) -> None:
    """Put a new result folder in the place of an old one; if that fails, the old folder stays.

    target : path of the old folder, which need not exist; part : path of the new folder
    """
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


def write_all_tables(folder: Path, findings: Run) -> None:
    """Write deposits.csv of a run that kept all rocks in memory, and impacts.parquet if the scene asks for it."""
    scene, sources = findings.scene, [source.name for source in findings.scene.sources]
    place = (folder, sources, findings.terrain, scene.rock.density)
    with tables.open_tables(*place, scene.outputs.impacts, findings.obstacles, findings.maps.spins) as sink:
        sink(findings.flights.deposits, findings.flights.impacts)


def write_findings(folder: Path, findings: Run, record: Record | None = None, painting: Painting | None = None) -> None:
    """Write all files of a result into an existing folder, except deposits.csv and impacts.parquet.

    Pictures are written only if the scene asks for them. They are drawn first, because a second process may draw them
    while this process writes the other files. The summary is written last, because it states how long the other files
    took.

    Parameters
    ----------
    record : function of (path, summary), optional
        Writes `run.rrd`; see `recordings.log.write_recording`. Without it there is no `run.rrd`.
    painting : Painting, optional
        Draws the pictures; its `begin` has already been called. Without `painting`, this process draws them.

    Raises
    ------
    InputError
        A file of the scene that the summary needs is damaged, such as the observed end points.
    """
    start = time.perf_counter()
    paths, scene = findings.flights.paths, findings.scene
    samples = _samples(findings, findings.flights, displayed_rows(paths, scene.outputs.trajectories))
    painting = painting or Painting()
    (folder / "hazard").mkdir()
    if scene.outputs.pictures:
        _write_pictures(folder, findings, samples, painting)
    facts = summary(findings)
    _write_paths(folder, findings, samples)
    write_hazard(folder / "hazard", findings.terrain, findings.maps, scene.hazard, scene.terrain.crs)
    if findings.maps.sets is not None:
        _write_sets(folder, findings.maps.sets)
    write_inputs(folder, findings)
    if record is not None:
        record(folder / "run.rrd", facts)
    painting.wait()
    facts["write_s"] = time.perf_counter() - start
    facts["total_s"] = findings.wall_s + facts["write_s"]
    (folder / SUMMARY).write_text(json.dumps(facts, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _samples(findings: Run, flights: Flights, rows: IntArray | None = None) -> PathSamples:
    """Return points along the paths of some rocks of a run, to draw or write the paths, with orientations of bodies.

    rows : (N,) rows of the rocks in `flights.deposits`; None for all rocks with a path
    """
    scene, deposits = findings.scene, flights.deposits
    moments = moments_of(blocks_of(scene, deposits), deposits)
    return sample_paths(flights.paths, rows, gravity=scene.gravity, moments=moments)


def _write_sets(folder: Path, figures: Any) -> None:
    """Write parameter_sets.parquet: the parameter sets of a run, and the number of rocks that flew with each set.

    figures : `hazard.by_set.sets.SetFigures`
    """
    from rpf3d_core.unknowns.parameter_sets import write_parameter_sets  # imported only if the scene has unknowns

    write_parameter_sets(folder / "parameter_sets.parquet", figures.sets, {"rocks": figures.rocks})


def _write_paths(folder: Path, findings: Run, samples: PathSamples) -> None:
    sources, terrain, flights = [s.name for s in findings.scene.sources], findings.terrain, findings.flights
    tables.write_trajectories(folder / "trajectories.parquet", sources, terrain, flights.deposits, samples)
    if (critical := findings.critical) is not None:
        tables.write_trajectories(folder / CRITICAL, sources, terrain, critical.deposits, _samples(findings, critical))
    vtp.write_terrain(folder / "terrain.vtp", terrain, flights.impacts, findings.maps)
    vtp.write_trajectories(folder / "trajectories.vtp", sources, terrain, flights.deposits, samples)


def _write_pictures(folder: Path, findings: Run, samples: PathSamples, painting: Painting) -> None:
    """Draw the pictures of a run; they are complete after `painting.wait`."""
    scene = findings.scene
    shown = RunPictures(
        name=scene_name(scene.path), areas=dict(findings.prepared.outlines), flown=findings.flown, maps=findings.maps,
        flights=findings.flights, samples=samples, sources=[source.name for source in scene.sources],
        gravity=scene.gravity, obstacles=findings.obstacles, steps=findings.steps,
        target=scene.target if findings.steps else None,
    )  # fmt: skip
    painting.draw(folder, shown, findings.terrain)
