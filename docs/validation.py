"""Write docs/explanation/validation.md and its pictures: simulated rocks compared with rocks that fell.

python docs/validation.py            (or make validation; takes some minutes)
python docs/validation.py --as-is    only the page, from the last measurement
"""

import json
import sys
from pathlib import Path
from typing import Any

from field_cases.measuring import measured
from field_cases.page import document
from field_cases.pictures import draw_all

DOCS = Path(__file__).parent
RESULTS = DOCS / "field_cases" / "results.json"
PAGE = DOCS / "explanation" / "validation.md"


def main(arguments: list[str]) -> int:
    """Measure, draw the pictures and write the page; return the exit code."""
    if "--as-is" not in arguments:
        found = measured(lambda line: print(line, file=sys.stderr, flush=True))
        RESULTS.write_text(json.dumps(found.results, indent=1) + "\n", encoding="utf-8")
        draw_all(found, DOCS / "pictures")
    results: dict[str, Any] = json.loads(RESULTS.read_text(encoding="utf-8"))
    PAGE.write_text(document(results), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
