"""Recognise the folder of a calibration where the folder of a run is needed, and say in words what to do."""

from pathlib import Path

FOUND, REPORT, CALIBRATED, PLAN = "calibration.json", "report.md", "calibrated.yaml", Path("state", "plan.json")
"""Files in the folder of a calibration; a refused calibration has no CALIBRATED, an interrupted one only PLAN."""


def is_calibration(folder: Path) -> bool:
    """Return True if a folder is that of a calibration, finished or interrupted."""
    return (folder / FOUND).is_file() or (folder / PLAN).is_file()


def words_on_calibration(folder: Path) -> str:
    """Return what the folder of a calibration has, and which command makes a run of it, as the end of a sentence."""
    if (folder / CALIBRATED).is_file():
        return (f"is the folder of a calibration, not of a run; its report is {folder / REPORT}; fly the "
                f"calibrated scene with `rpf3d run {folder / CALIBRATED} --out RESULT`, and give the folder "
                "RESULT")  # fmt: skip
    if (folder / FOUND).is_file():
        return (f"is the folder of a refused calibration, not of a run; {folder / REPORT} says what would help; there "
                f"is no {CALIBRATED} to fly")  # fmt: skip
    return "is the folder of an unfinished calibration, not of a run; the same `rpf3d calibrate` command continues it"
