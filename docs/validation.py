"""Write docs/explanation/validation.md and its pictures: simulated rocks compared with rocks of field tests.

python docs/validation.py            (or make validation; an hour, half of it calibrations)
python docs/validation.py --blocks   only the section on rocks with a shape; the other figures stay (some minutes)
python docs/validation.py --as-is    only the page, from the last measurement
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from field_cases.blocks import measuring as blocks_measuring
from field_cases.blocks.picture import draw
from field_cases.measuring import measured, rounded
from field_cases.models import AUTHUME
from field_cases.page import document
from field_cases.pictures import draw_all

DOCS = Path(__file__).parent
RESULTS = DOCS / "field_cases" / "results.json"
PAGE = DOCS / "explanation" / "validation.md"
CALIBRATIONS = DOCS.parent / "out" / "calibrations"
"""Folder for the results of `rpf3d calibrate`; a calibration with a result in the folder is not repeated."""


def main(arguments: list[str]) -> int:
    """Measure, draw the pictures and write the page; return the exit code."""
    asked = _parser().parse_args(arguments)
    if asked.blocks:
        _write({**json.loads(RESULTS.read_text(encoding="utf-8")), "blocks": _blocks()})
    elif not asked.as_is:
        found = measured(CALIBRATIONS, _say)
        draw_all(found, DOCS / "pictures")
        draw(found.ends[AUTHUME], DOCS / "pictures" / "validation_blocks.png")
        _write({**found.results, "blocks": _blocks()})
    results: dict[str, Any] = json.loads(RESULTS.read_text(encoding="utf-8"))
    PAGE.write_text(document(results), encoding="utf-8")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    some = parser.add_mutually_exclusive_group()
    some.add_argument("--blocks", action="store_true")
    some.add_argument("--as-is", action="store_true")
    return parser


def _blocks() -> Any:
    """Measure rocks with a shape, and return their figures, rounded."""
    return rounded(blocks_measuring.measured(_say))


def _write(results: dict[str, Any]) -> None:
    RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
