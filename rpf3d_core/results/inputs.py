"""Write inputs.json of a result: the scene as it was run, the sources of its values, and the run's warnings.

`rpf3d report` reads this file, so that a report needs the result folder only. The key `scene` has the names of the
scene's files, without folders; the key `files` has their full paths and digests.
"""

import json
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rpf3d_core.results.findings import Run
from rpf3d_core.results.input_files import input_files
from rpf3d_core.results.notes import doubts_of_run, notes_of_run
from rpf3d_core.results.overconfidence import SOME_ELSEWHERE, share_calibrated_elsewhere, surer_than_it_may_be
from rpf3d_core.scene.key_paths import given_keys
from rpf3d_core.scene.measured import MeasuredList
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.releases import SIZES
from rpf3d_core.scene.zone_materials import unused_materials
from rpf3d_core.setup.areas import plan_rings
from rpf3d_core.terrain.zones import zones_with_facets

if TYPE_CHECKING:
    from rpf3d_core.scene.library_entries import Range

INPUTS = "inputs.json"
ASSUMED, RANGES, PARTLY, CALIBRATED = "assumed", "ranges", "partly_calibrated", "calibrated"
ELSEWHERE = "calibrated_elsewhere"
"""Values of the key `ground` of inputs.json: the origin of the coefficients of the ground.

ASSUMED : single values; RANGES : ranges from books or estimates; CALIBRATED : only the sample of a calibration
PARTLY : the sample of a calibration, and further ranges from books or estimates
ELSEWHERE : the sample of a calibration on another slope
"""


def write_inputs(folder: Path, run: Run) -> None:
    """Write inputs.json, the content of `inputs_section`, into the result folder of a run."""
    text = json.dumps(inputs_section(run), indent=2, allow_nan=False)
    (folder / INPUTS).write_text(text + "\n", encoding="utf-8")


def inputs_section(run: Run) -> dict[str, Any]:
    """Return the content of inputs.json: the scene as it was run, the origin of its values, and the run's warnings.

    All values are of types that JSON supports. The key `date` has the current local time, with its offset from UTC.
    The key `outlines` has the outline of each area of interest as closed rings of points (x, y) m in the input's
    coordinates, because the key `scene` does not have these points if the scene names a file of the outline.
    """
    return {
        "date": datetime.now().astimezone().isoformat(timespec="minutes"),
        "scene": _names_of_files(run.scene.model_dump(exclude={"path", "data_hint"})),
        "files": input_files(run.scene),
        "given": sorted(given_keys(run.scene)),
        "ground": _ground(run),
        "sampled": _sampled(run.scene),
        "library": _library(run.scene),
        "unused_materials": list(unused_materials(run.scene, zones_with_facets(run.terrain))),
        "warnings": doubts_of_run(run),
        "notes": notes_of_run(run),
        "outlines": {
            name: [ring.tolist() for ring in plan_rings(area)] for name, area in run.prepared.polygons.items()
        },
        "surer_than_it_may_be": surer_than_it_may_be(run),
        **_measured(run.scene),
    }


def _measured(scene: Scene) -> dict[str, Any]:
    """Return the key `measured` of inputs.json: the number and the range of the sizes in each list of measured sizes.

    The lists are given by key path, such as `rock.diameter`; ranges are in m, kg or m3. The result is {} if the scene
    has no list of sizes. The numbers are written here because the key `scene` does not have them if the scene names a
    file of sizes.
    """
    sections = {"rock": scene.rock, **{f"sources.{number}": source for number, source in enumerate(scene.sources)}}
    lists = {(path, measure): size for path, section in sections.items() for measure in SIZES
             if isinstance(size := getattr(section, measure), MeasuredList)}  # fmt: skip
    found = {}
    for (path, measure), size in lists.items():
        values = size.sizes(measure).values
        found[f"{path}.{measure}"] = {"number": len(values), "min": float(values[0]), "max": float(values[-1])}
    return {"measured": found} if found else {}


def _ground(run: Run) -> str:
    elsewhere = share_calibrated_elsewhere(run) >= SOME_ELSEWHERE
    return ELSEWHERE if elsewhere else ground_known_by(run.scene)


def ground_known_by(scene: Scene) -> str:
    """Return the origin of the coefficients of a scene's ground, as one of four constants.

    ASSUMED : single values; RANGES : ranges from books or estimates; CALIBRATED : the sample of a calibration only
    PARTLY : the sample of a calibration, and further ranges

    Whether the calibration was made at another place is not checked, so the result is never ELSEWHERE.

    Raises
    ------
    InputError
        The file of the sample cannot be used.
    """
    if not scene.has_unknowns or scene.unknowns is None:
        return ASSUMED
    if scene.unknowns.sample is None:
        return RANGES
    from rpf3d_core.setup.unknowns import outside_sample  # imported only if the scene has a sample

    return PARTLY if outside_sample(scene) else CALIBRATED


def _sampled(scene: Scene) -> list[str]:
    """Return the key paths of the coefficients whose values a scene draws from the sample of a calibration."""
    if scene.unknowns is None or scene.unknowns.sample is None:
        return []
    from rpf3d_core.setup.unknowns import sampled  # imported only if the scene has a sample

    return list(sampled(scene))


def _library(scene: Scene) -> dict[str, dict[str, Any]]:
    """Return the library entries that a scene names, by name: published source, confirmation and coefficients.

    The key `numbers` has the coefficients with a single value, `ranges` the coefficients with a range, and `assumed`
    the ranges of coefficients for which the source has no figure.
    """
    names = {material.library for material in scene.materials.values() if material.library is not None}
    if not names:
        return {}
    from rpf3d_core.scene.library_entries import ENTRIES  # imported only if a scene names an entry

    found = {name: ENTRIES[name] for name in sorted(names)}
    return {
        name: {
            "ground": entry.ground, "source": entry.source, "confirmed": entry.confirmed, "note": entry.note,
            "numbers": {key: value for key, value in entry.ranges.items() if isinstance(value, float)},
            "ranges": {key: _plain(span) for key, span in entry.ranges.items() if not isinstance(span, float)},
            "assumed": {key: _plain(span) for key, span in entry.assumed.items()},
        }
        for name, entry in found.items()
    }  # fmt: skip


def _plain(span: "Range") -> dict[str, float | None]:
    """Return a range of the library with the keys of a prior: min, max, mean and sd, each None if not stated."""
    return {"min": span.low, "max": span.high, "mean": span.mean, "sd": span.sd}


def _names_of_files(value: Any) -> Any:
    """Return a value of a scene for JSON: file names in place of paths, and lists in place of tuples."""
    if isinstance(value, Path):
        return value.name
    if isinstance(value, Mapping):
        return {str(key): _names_of_files(item) for key, item in value.items()}
    return [_names_of_files(item) for item in value] if isinstance(value, list | tuple) else value
