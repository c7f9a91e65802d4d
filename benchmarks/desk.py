"""Measure how long `rpf3d desk` takes to show its page and its results, in Chromium without a window.

    python benchmarks/desk.py [--scene FILE] [--picture FILE]

The program prints the seconds from opening the address to the first canvas, and from pressing Run to the first and to
the last results. The second run is in the same process, so its code is already compiled. With --picture the page is
written as PNG. The benchmark needs the extra `desk`, playwright and an installed Chromium, but no graphics card.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "test" / "support")]

from programs.browsers import browser  # noqa: E402  (the path above is for it)

DEMO = ROOT / "config" / "scenes" / "demo.yaml"
LONGEST = 300_000
FIRST_SHOWN = "#progress:has-text(' of '), #report:enabled"
"""Selector that matches as soon as the page shows some of the rocks; a quick run shows all rocks at once."""


def seconds_to(page: Any, action: Any, *selectors: str) -> list[float]:
    """Do an action on a page; return the seconds from its start until each of the selectors matches, in order."""
    began, found = time.perf_counter(), []
    action()
    for selector in selectors:
        page.wait_for_selector(selector, timeout=LONGEST)
        found.append(time.perf_counter() - began)
    return found


def main() -> None:
    """Measure, and print a line for each time."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scene", type=Path, default=DEMO)
    parser.add_argument("--picture", type=Path, help="PNG file of the page after the second run")
    options = parser.parse_args()
    command = [sys.executable, "-m", "rpf3d_core.cli", "desk", str(options.scene), "--no-open"]
    desk = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert desk.stdout is not None
    address = re.findall(r"http://\S+", desk.stdout.readline())[0]
    with browser() as chromium:
        page = chromium.new_page(viewport={"width": 1400, "height": 900})
        (canvas, ready) = seconds_to(page, lambda: page.goto(address), "#view canvas", "#run:enabled")
        print(f"first canvas {canvas:.1f} s, ready to fly {ready:.1f} s after opening the address")
        page.wait_for_timeout(30_000)  # in this time the desk compiles its loops or loads them from the cache
        for run in ("first run", "second run"):
            _, first, last = seconds_to(
                page, lambda: page.click("#run"), "#stop:enabled", FIRST_SHOWN, "#report:enabled"
            )
            print(f"{run}: first rocks {first:.1f} s, all rocks {last:.1f} s after pressing Run; "
                  f"{page.inner_text('#progress')}")  # fmt: skip
        if options.picture:
            page.wait_for_timeout(5000)
            page.screenshot(path=options.picture)
    print(f"load of the machine (1 minute): {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    desk.terminate()
    desk.wait()


if __name__ == "__main__":
    main()
