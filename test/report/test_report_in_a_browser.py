"""Tests of a report in Chromium: it draws its view without a request, and the view can be turned."""

from pathlib import Path

import pytest
from programs.browsers import LONGEST, browser, changed, picture_that, settled

COLOURS = 200
"""Number of colours that a view of terrain, paths and map exceeds, but not an empty view."""


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
        page.wait_for_selector(".view canvas", timeout=LONGEST)
        view.scroll_into_view_if_needed()
        before = settled(view, COLOURS)
        box = view.bounding_box()
        middle = box["x"] + 0.5 * box["width"], box["y"] + 0.6 * box["height"]
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 200, middle[1] + 20, steps=8)
        page.mouse.up()
        picture_that(view, lambda seen: changed(seen, before) > 0.05)
    assert [url for url in requests if not url.startswith(("data:", "blob:"))] == [report[0].as_uri()]
    assert faults == []
