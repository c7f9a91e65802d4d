"""Recognise the folder of a calibration that was given in place of the folder of a run, for an error message."""

from pathlib import Path

FOUND, REPORT, CALIBRATED = "calibration.json", "report.md", "calibrated.yaml"
"""Names of files in the folder of a calibration: result, report and calibrated scene.

FOUND is written last; a refused calibration has no CALIBRATED.
"""
STATE, PLAN = "state", "plan.json"
"""Names in the folder of a calibration: the subfolder with the flown sets, and its file with the scene's digest."""


def is_calibration(folder: Path) -> bool:
    """Return True if a folder is the folder of a calibration, finished or interrupted."""
    return (folder / FOUND).is_file() or (folder / STATE / PLAN).is_file()


def words_on_calibration(folder: Path) -> str:
    """Return the second part of an error message, "is the folder of ...", which follows the path of this folder.

    The text states whether the calibration is finished, refused or unfinished, and what the user can do instead.

    folder : the folder of a calibration (`is_calibration`)
    """
    if (folder / CALIBRATED).is_file():
        return (f"is the folder of a calibration, not of a run; its report is {folder / REPORT}; fly the "
                f"calibrated scene with `rpf3d run {folder / CALIBRATED} --out RESULT`, and give the folder "
                "RESULT")  # fmt: skip
    if (folder / FOUND).is_file():
        return (f"is the folder of a refused calibration, not of a run; {folder / REPORT} says what would help; there "
                f"is no {CALIBRATED} to fly")  # fmt: skip
    return "is the folder of an unfinished calibration, not of a run; the same `rpf3d calibrate` command continues it"
