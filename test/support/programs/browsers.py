"""Start the installed Chromium for tests of pages, and take pictures of pages; without Chromium a test is skipped."""

import io
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
OPTIONS = ["--enable-unsafe-swiftshader", "--no-sandbox", "--disable-dev-shm-usage"]
"""Options of Chromium: WebGL without a graphics card, and no sandbox, because root in a container cannot use one."""
LONGEST, LOOK = 180_000, 500
"""Longest wait (ms) for an action that takes some seconds on an idle machine; time (ms) between two pictures."""


@contextmanager
def browser() -> Iterator[Any]:
    """Yield a running browser of playwright; skip the test if there is no Chromium or no playwright."""
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip("no Chromium is installed (Debian: apt-get install chromium)")
    sync = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with sync.sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=path, args=OPTIONS)
        try:
            yield running
        finally:
            running.close()


def picture(view: Any) -> np.ndarray:
    """Return the picture of an element of a page: colours (H, W, 3) from 0 to 1; view : locator of playwright."""
    return imread(io.BytesIO(view.screenshot()), format="png")[..., :3]


def picture_that(view: Any, fits: Callable[[np.ndarray], bool]) -> np.ndarray:
    """Take pictures of an element of a page until a picture is as expected, and return this picture.

    The test fails after LONGEST (180 s).

    view : locator of playwright; fits : returns True for an expected picture
    """
    until = time.monotonic() + LONGEST / 1000
    while not fits(seen := picture(view)):
        assert time.monotonic() < until, "the picture does not come to what is expected"
        view.page.wait_for_timeout(LOOK)
    return seen


def settled(view: Any, colours: int) -> np.ndarray:
    """Return the picture of an element as soon as it has more than `colours` colours and stays the same.

    The last three pictures must be equal.
    """
    last: list[np.ndarray] = []

    def fits(seen: np.ndarray) -> bool:
        last.append(seen)
        is_drawn = len(np.unique((seen.reshape(-1, 3) * 255).astype(np.uint8), axis=0)) > colours
        return is_drawn and len(last) > 2 and changed(*last[-3:-1]) == changed(*last[-2:]) == 0.0

    return picture_that(view, fits)


def changed(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share (-) of the pixels that differ by more than 0.1 in a colour; excess rows of one are ignored."""
    rows = min(len(one), len(other))
    return float((np.abs(one[:rows] - other[:rows]).max(axis=2) > 0.1).mean())
