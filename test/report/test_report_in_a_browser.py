"""A report opened in Chromium: it draws its view without a request, and the view turns."""

import io
from pathlib import Path

import numpy as np
import pytest
from browsers import browser
from matplotlib.image import imread


def picture(canvas) -> np.ndarray:
    return imread(io.BytesIO(canvas.screenshot()), format="png")[..., :3]


def test_a_report_names_no_other_file_or_address_in_its_markup(report: tuple[Path, Path]) -> None:
    head = report[0].read_text(encoding="utf-8").partition("<script>")[0]
    assert "http:" not in head and "https:" not in head and "<link" not in head


@pytest.mark.long
def test_a_report_draws_its_view_without_a_request_and_turns_it(report: tuple[Path, Path]) -> None:
    with browser() as running:
        page = running.new_page(viewport={"width": 1200, "height": 900})
        requests, faults = [], []
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("console", lambda line: faults.append(line.text) if line.type == "error" else None)
        page.goto(report[0].as_uri())
        view = page.locator(".view")
        page.wait_for_selector(".view canvas", timeout=60_000)
        page.wait_for_timeout(3000)
        view.scroll_into_view_if_needed()
        page.wait_for_timeout(1000)
        before = picture(view)
        box = view.bounding_box()
        middle = box["x"] + 0.5 * box["width"], box["y"] + 0.6 * box["height"]
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 200, middle[1] + 20, steps=8)
        page.mouse.up()
        page.wait_for_timeout(2000)
        after = picture(view)
    assert [url for url in requests if not url.startswith(("data:", "blob:"))] == [report[0].as_uri()]
    assert faults == []
    colours = len(np.unique((before.reshape(-1, 3) * 255).astype(np.uint8), axis=0))
    assert colours > 200, "terrain, paths and map have many colours; an empty view has few"
    assert (np.abs(before - after).max(axis=2) > 0.1).mean() > 0.05, "the view turned"
