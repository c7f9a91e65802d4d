"""Keep flown parameter sets on disk, so that a calibration that was interrupted continues where it stopped."""

import hashlib
import json
import os
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.density import Stops
from rpf3d_core.calibration.flying import Flown
from rpf3d_core.errors import InputError
from rpf3d_core.results.calibration_folder import CALIBRATED, FOUND, PLAN, REPORT, STATE
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import scene_digest

FloatArray = NDArray[np.float64]

RESULTS = (FOUND, CALIBRATED, "posterior.parquet", REPORT, "posterior.png", "predicted.png", "coverage.png")
"""Names of the files with the result of a calibration."""
VERSION = 3
"""Version of the files with flown sets; the version changes whenever the sampler or the densities change."""


class KeptSets(NamedTuple):
    """The S flown sets of one round: their U unknowns z (S, U), as in `normal_space`, and the result of each set."""

    z: FloatArray
    flown: list[Flown]


def digest_of(scene: Scene) -> str:
    """Return a digest of everything that affects a calibration, except the time budget and the engine."""
    spec = "" if scene.calibration is None else scene.calibration.model_dump_json()
    whole = scene_digest(scene.model_copy(update={"engine": "auto"}))  # both engines give the same bits
    return hashlib.sha256(f"{VERSION} {whole} {spec}".encode()).hexdigest()


def check_folder(out: Path, scene: Scene) -> None:
    """Refuse a folder that cannot be used for a calibration of a scene.

    Raises
    ------
    InputError
        The folder contains files that are not part of a calibration; results without plan.json (the file that
        identifies a calibration); a damaged plan.json; or the calibration of another scene, of other data or of an
        earlier version.
    """
    state = out / STATE
    names = {entry.name for entry in out.iterdir()} if out.is_dir() else set()
    if foreign := sorted(names - {STATE, *RESULTS}):
        raise InputError(
            f"{out}: contains {foreign[0]!r}, which is not part of a calibration; give a new or empty folder"
        )
    if names and not (state / PLAN).is_file():
        raise InputError(f"{out}: contains no calibration to continue; give a new or empty folder")
    if not names:
        return
    if _read_plan(state / PLAN)["digest"] != digest_of(scene):
        raise InputError(f"{out}: contains the calibration of another scene, of other data, or of an earlier version "
                         "of rpf3d; give another folder")  # fmt: skip


def _read_plan(path: Path) -> dict[str, Any]:
    """Return the content of plan.json, the file that identifies a calibration.

    Raises
    ------
    InputError
        The file cannot be read, or is damaged.
    """
    try:
        plan = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as fault:
        raise InputError(f"{path}: is damaged ({fault}); give another --out, or delete its folder {path.parent.parent}"
                         ) from fault  # fmt: skip
    if not isinstance(plan, dict) or not isinstance(plan.get("digest"), str):
        raise InputError(f"{path}: is damaged (no digest); give another --out, or delete its folder "
                         f"{path.parent.parent}")  # fmt: skip
    return plan


def open_state(out: Path, scene: Scene) -> Path:
    """Return the folder of flown sets within `out`, the folder of a calibration; both are created if missing.

    Raises
    ------
    InputError
        As `check_folder`, or the folder cannot be written to.
    """
    check_folder(out, scene)
    state = out / STATE
    try:
        state.mkdir(parents=True, exist_ok=True)
        plan = json.dumps({"program": "rpf3d", "digest": digest_of(scene)})
        (state / PLAN).write_text(plan + "\n", encoding="utf-8")
    except OSError as fault:
        raise InputError(f"{out}: could not be written ({fault.strerror or fault})") from fault
    return state


def save_part(state: Path, number: int, part: int, kept: KeptSets) -> None:
    """Write some flown sets of a round as one file: complete, or not at all.

    state : folder of the flown sets; number : of the round; part : of the file within the round; both from 0
    """
    path, unfinished = _path(state, number, part), state / "unfinished.npz"
    with unfinished.open("wb") as file:
        np.savez(
            file, z=kept.z, place=np.stack([one.stops.place for one in kept.flown]),
            deposited=np.stack([one.stops.deposited for one in kept.flown]),
            densities=np.stack([one.densities for one in kept.flown]),
            energy=np.stack([one.energy for one in kept.flown]),
        )  # fmt: skip
        file.flush()
        os.fsync(file.fileno())
    unfinished.replace(path)


def read_round(state: Path, number: int, unknowns: int) -> tuple[KeptSets, int]:
    """Return the flown sets of a round, and the number of files that contain them.

    state : folder of the flown sets; number : of the round, from 0; unknowns : number of unknowns

    Raises
    ------
    InputError
        A file is damaged; the message names it.
    """
    kept, part = KeptSets(np.empty((0, unknowns)), []), 0
    while (path := _path(state, number, part)).is_file():
        try:
            one = _read_part(path)
            kept = KeptSets(np.concatenate([kept.z, one.z]), [*kept.flown, *one.flown])
        except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as fault:
            raise InputError(f"{path}: is damaged ({fault or type(fault).__name__}); delete this file, and the same "
                             "command flies its parameter sets again") from fault  # fmt: skip
        part += 1
    return kept, part


def drop_parts(state: Path, number: int, part: int) -> None:
    """Delete the files of a round from number `part` on, because the sets in these files will fly again.

    Such files exist only if a user deleted the file before them.
    """
    for path in state.glob(f"round_{number:02d}_*.npz"):
        if path.name >= _path(state, number, part).name:
            path.unlink()


def _read_part(path: Path) -> KeptSets:
    """Return the flown sets in one file."""
    with np.load(path) as file:
        z, columns = file["z"], [file[name] for name in ("place", "deposited", "densities", "energy")]
    flown = [Flown(Stops(place, deposited), *rest) for place, deposited, *rest in zip(*columns, strict=True)]
    if len(flown) != len(z):
        raise ValueError(f"{len(z)} parameter sets, {len(flown)} results")
    return KeptSets(z, flown)


def _path(state: Path, number: int, part: int) -> Path:
    return state / f"round_{number:02d}_{part:03d}.npz"
