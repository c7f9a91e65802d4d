"""Read the results of earlier runs, to compare them: summary.json and deposits.csv."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_core.results.calibration_folder import is_calibration, words_on_calibration
from rpf3d_core.results.folder import SUMMARY
from rpf3d_core.values import DEPOSITED

DEPOSITS = "deposits.csv"
AT_REST = {outcome.name.lower() for outcome in DEPOSITED}
PARTS = ("scene", "rocks", "rocks_planned", "partial", "benches", "areas_of_interest", "hazard")
"""Keys that summary.json must have, so that the run can be compared with other runs."""


def _why_no_result(folder: Path) -> str:
    """Return the second part of an error message, which follows the path of a folder without summary.json.

    The text states the reason, and which folder to give instead.
    """
    if not folder.exists():
        return "does not exist; give a folder that `rpf3d run` wrote"
    if cells := sorted(each.parent.name for each in folder.glob(f"cells/*/{SUMMARY}")):
        return f"is a sweep: give one of its cells, such as {folder / 'cells' / cells[0]}; sweep.csv has their values"
    return f"has no {SUMMARY}; give a folder that `rpf3d run` wrote"


def read_summary(folder: str | Path) -> dict[str, Any]:
    """Return the content of summary.json in the result folder of a run, for example to compare two runs.

    Raises
    ------
    InputError
        The folder has no summary, or its summary is damaged, was not written by rpf3d, or does not have all keys of
        PARTS. For the folder of a calibration, the message names the command to use instead.
    """
    path = Path(folder) / SUMMARY
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        if is_calibration(Path(folder)):
            raise InputError(f"{folder}: {words_on_calibration(Path(folder))}") from None
        raise InputError(f"{folder}: {_why_no_result(Path(folder))}") from None
    except OSError as fault:
        raise InputError(f"{path}: cannot be read ({fault.strerror or fault})") from fault
    except ValueError as fault:
        raise InputError(f"{path}: is damaged ({fault})") from fault
    if not isinstance(facts, dict) or facts.get("program") != "rpf3d":
        raise InputError(f"{path}: is not the summary of a run of rpf3d")
    if missing := [name for name in PARTS if name not in facts]:
        raise InputError(f"{path}: has no `{missing[0]}`; another version wrote it, so run its scene again")
    return facts


def stops_by_zone(folder: str | Path) -> Iterator[tuple[str, float]]:
    """Yield, for each rock that stopped or was caught, the zone and the coordinate z (m) of the place.

    The coordinate is that of the input, so it is the height only if z points up in the input.

    Raises
    ------
    InputError
        The folder has no deposits.csv, or the file is damaged.
    """
    path = Path(folder) / DEPOSITS
    try:
        with path.open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                if row["outcome"] in AT_REST:
                    yield row["zone"], float(row["z"])
    except OSError as fault:
        raise InputError(f"{path}: cannot be read ({fault.strerror or fault})") from fault
    except (KeyError, TypeError, ValueError) as fault:
        raise InputError(f"{path}: is damaged ({fault})") from fault
