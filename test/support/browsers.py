"""A Chromium of the system for tests of pages; tests skip with a reason where there is none."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
OPTIONS = ["--enable-unsafe-swiftshader", "--no-sandbox", "--disable-dev-shm-usage"]
"""WebGL without a graphics card; no sandbox, because root in a container has none."""


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
