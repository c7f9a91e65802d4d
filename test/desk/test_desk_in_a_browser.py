"""Tests of the desk in Chromium: draw, edit, run, stop, save, report; no request leaves the machine."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from programs.browsers import LONGEST, browser, changed, picture_that, settled
from programs.served_desk import served_desk

from rpf3d_core.scene.reading import read_scene

SCENES = Path(__file__).parents[2] / "config" / "scenes"
COLOURS = 50
"""Number of colours that a view of shaded terrain exceeds, but not a view that is not drawn yet."""
SLOW_ARRAYS = """\
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (message) {
  const bytes = message instanceof ArrayBuffer || ArrayBuffer.isView(message) ? message : new ArrayBuffer(0);
  const asked = new TextDecoder('latin1').decode(bytes).includes('viewport.geometry.array.get');
  setTimeout(() => send.call(this, message), asked ? 1500 : 0);
};
"""
"""Script for a page: each request for an array of the view is sent 1.5 s later."""
SCENE = """\
# A pit that is small enough for a test.
terrain:
  pit: {triangles: 6000, waste_benches: 6, ore_benches: 0, floor_radius: 120, crest_altitude: 72, spills: 0}
materials:
  default: {normal_restitution: 0.45, tangential_restitution: 0.8, friction_angle_deg: 32}   # of no site
sources:
  - {name: top, zone: bench_1, above_ground: 8, rocks: 200, velocity_spread: [9, 9, 0]}
engine: reference
"""
TWO_MATERIALS = """\
terrain:
  pit: {triangles: 6000, waste_benches: 6, ore_benches: 0, floor_radius: 120, crest_altitude: 72, spills: 2}
materials:
  default: {library: bedrock}
  spill: {library: talus, normal_restitution: 0.3}
sources:
  - {name: top, zone: bench_1, above_ground: 8, rocks: 20000, velocity_spread: [9, 9, 0]}
engine: reference
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "pit.yaml").write_text(SCENE)
    return tmp_path / "pit.yaml"


@contextmanager
def page_of(*words: object, cwd: Path | None = None, script: str = "") -> Iterator[Any]:
    """Yield the desk's page in a browser; at the end assert that no request went elsewhere and no script failed.

    script : JavaScript that the browser runs before the page
    """
    with served_desk(*words, cwd=cwd) as desk, browser() as running:
        page = running.new_page(viewport={"width": 1400, "height": 900})
        sent, faults = [], []
        page.on("request", lambda request: sent.append(request.url))
        page.on("websocket", lambda socket: sent.append(socket.url))
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("console", lambda line: faults.append(line.text) if "Content Security" in line.text else None)
        page.set_default_timeout(LONGEST)
        page.add_init_script(script)
        page.goto(desk.address)
        page.wait_for_selector("#busy", state="attached")
        yield page
        here = (desk.base, desk.base.replace("http", "ws", 1), "data:", "blob:")
        assert [url for url in sent if not url.startswith(here)] == []
        assert any(url.startswith("ws:") for url in sent)
        assert faults == []


def view(page: Any) -> Any:
    return page.locator("#view")


def ready(page: Any, colours: int = COLOURS) -> None:
    """Wait until rocks can fly and the view is drawn with more than `colours` colours."""
    page.wait_for_selector("#view canvas")
    page.wait_for_selector("#run:enabled")
    settled(view(page), colours)


def click_terrain(page: Any, *places: tuple[float, float]) -> None:
    """Click in the view, at shares of its width and height, and wait until each place is counted."""
    page.wait_for_selector("#finish")
    page.wait_for_function("document.querySelector('#finish').innerText.includes('(0 points)')")
    box = page.locator("#view").bounding_box()
    for number, (x, y) in enumerate(places, start=1):
        page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])
        page.wait_for_function(f"document.querySelector('#finish').innerText.includes('({number} point')")


def run_to_the_end(page: Any) -> str:
    page.click("#run")
    page.wait_for_selector("#stop:enabled")  # otherwise the previous results could be taken for these
    page.wait_for_selector("#progress")
    page.wait_for_selector("#report:enabled")
    return str(page.inner_text("#progress"))


def test_the_page_has_its_buttons_and_names_no_address_elsewhere() -> None:
    for library in ("trame", "trame_vtk", "ruamel.yaml"):
        pytest.importorskip(library, reason="the extra `desk` is not installed")
    from rpf3d_core.desk.app import Desk

    desk = Desk()
    desk.close()
    page = desk.state.trame__template_main
    assert [name for name in ("run", "stop", "save", "report", "finish", "open") if f'id="{name}"' not in page] == []
    assert "http:" not in page and "https:" not in page and "url(" not in page


@pytest.mark.long
def test_a_user_draws_edits_runs_saves_and_writes_a_report(scene: Path) -> None:
    pytest.importorskip("plotly", reason="the extra `report` is not installed")
    with page_of(scene) as page:
        ready(page)
        page.click("#look_all")
        page.wait_for_timeout(1000)
        before = settled(view(page), COLOURS)

        page.click("#tool_line")
        page.wait_for_selector("#finish")
        box = page.locator("#view").bounding_box()
        page.mouse.click(box["x"] + 0.01 * box["width"], box["y"] + 0.5 * box["height"])
        page.wait_for_selector("text=the click missed the terrain")
        assert page.get_attribute("#run", "title") == "first add or cancel the drawing"
        click_terrain(page, (0.40, 0.41), (0.46, 0.395))
        page.fill("#new_name", "crest")
        page.fill("#new_rocks", "30")
        page.click("#finish")
        page.wait_for_selector("text=30 rocks, line")
        page.click("#tool_area")
        click_terrain(page, (0.45, 0.5), (0.6, 0.5), (0.6, 0.6), (0.45, 0.6))
        page.click("#finish")
        page.wait_for_selector("text=area_1")

        field = page.locator('input[data-key="default.friction_angle_deg"]')
        field.fill("28 to 36")
        field.press("Enter")
        page.wait_for_selector("#run:enabled")
        page.wait_for_timeout(500)
        assert page.inner_text("#messages") == ""
        assert run_to_the_end(page).startswith("230 rocks, ")
        rows = page.locator("#benches tbody tr").all_inner_texts()
        assert any(row.startswith("area_1 (area)") for row in rows)
        assert "; " in " ".join(rows), "both intervals, the wider one first"
        picture_that(view(page), lambda seen: changed(seen, before) > 0.01)
        page.click("#layer_energy")
        page.wait_for_selector("text=p95 energy, worst source, cells")

        page.click("#report")
        page.wait_for_selector("text=save the scene first")
        page.click("#save")
        page.wait_for_selector(f"text=scene saved in {scene.with_name('pit_desk.yaml')}")
        run_to_the_end(page)
        page.click("#report")
        page.wait_for_selector("text=report saved in ")
    made = read_scene(scene.with_name("pit_desk.yaml"))
    assert [(source.name, source.rocks) for source in made.sources] == [("top", 200), ("crest", 30)]
    assert made.sources[1].line is not None and made.has_unknowns and len(made.areas_of_interest) == 1
    text = scene.with_name("pit_desk.yaml").read_text()
    assert "# A pit that is small enough for a test." in text and "# of no site" in text
    assert scene.read_text() == SCENE
    assert "crest" in scene.with_name("pit_desk_report.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_what_is_refused_is_said_as_on_the_command_line_and_changes_nothing(scene: Path) -> None:
    with page_of(scene) as page:
        ready(page)
        field = page.locator('input[data-key="default.normal_restitution"]')
        field.fill("3")
        field.press("Enter")
        page.wait_for_selector("text=`materials.default.normal_restitution` is 3")
        page.wait_for_function("document.querySelector('[data-key=\"default.normal_restitution\"]').value === '0.45'")
        page.click("#tool_points")
        page.click("#finish")
        page.wait_for_selector("text=click at least 1 point on the terrain")
        page.click("text=Cancel")
        page.click("text=remove")
        page.wait_for_selector("text='top' is the only source")
        assert page.locator("#undo").is_disabled()


@pytest.mark.long
def test_each_material_has_its_own_fields(tmp_path: Path) -> None:
    """Vue must not reuse the rows of one material for another material that has the same keys."""
    (tmp_path / "two.yaml").write_text(TWO_MATERIALS)
    with page_of(tmp_path / "two.yaml") as page:
        ready(page)
        assert fields_of(page, 0)["default.library"] == "bedrock"
        assert fields_of(page, 1)["spill.library"] == "talus"
        assert fields_of(page, 1)["spill.normal_restitution"] == "0.3"
        assert all(name.startswith("spill.") for name in fields_of(page, 1))

        field = page.locator('input[data-key="spill.normal_restitution"]')
        field.fill("0.31")
        field.press("Enter")
        page.wait_for_selector("text=(changed, not saved)")
        assert fields_of(page, 1)["spill.normal_restitution"] == "0.31"
        assert fields_of(page, 0)["default.normal_restitution"] == ""
        page.wait_for_selector("#run:enabled")

        page.click("#run")
        page.wait_for_selector("#stop:enabled")
        assert page.locator(".material input:enabled").count() == 0
        page.click("#stop")
        page.wait_for_selector("#report:enabled")
        assert page.locator(".material input:disabled").count() == 0

        page.click("#save")
        page.wait_for_selector("text=scene saved in ")
        field.fill("0.3")  # not entered
        page.locator("#layer_energy").dispatch_event("click")  # a change of the page that leaves the field focused
        page.wait_for_selector("#layer_energy.on")
        assert field.input_value() == "0.3"
    made = read_scene(tmp_path / "two_desk.yaml")
    assert made.materials["spill"].normal_restitution == 0.31
    text = (tmp_path / "two_desk.yaml").read_text()
    assert "default: {library: bedrock}" in text and "spill: {library: talus, normal_restitution: 0.31}" in text


def fields_of(page: Any, number: int) -> dict[str, str]:
    """Return the text of each field of a material, by its key on the page; number : of the material, from 0."""
    fields = page.locator(".material").nth(number).locator("input").all()
    return {field.get_attribute("data-key"): field.input_value() for field in fields}


@pytest.mark.long
def test_a_drag_turns_the_view_and_places_nothing(scene: Path) -> None:
    with page_of(scene) as page:
        ready(page)
        page.click("#tool_points")
        before, box = settled(view(page), COLOURS), view(page).bounding_box()
        page.mouse.move(box["x"] + 300, box["y"] + 300)
        page.mouse.down()
        page.mouse.move(box["x"] + 500, box["y"] + 330, steps=6)
        page.mouse.up()
        picture_that(view(page), lambda seen: changed(seen, before) > 0.02)
        assert page.inner_text("#finish") == "Add (0 points)"


@pytest.mark.long
def test_a_run_is_stopped_and_says_how_many_rocks_have_flown(scene: Path) -> None:
    scene.write_text(SCENE.replace("rocks: 200", "rocks: 20000"))
    with page_of(scene) as page:
        ready(page)
        page.click("#run")
        page.wait_for_selector("text=of 20,000 rocks")
        page.click("#stop")
        page.wait_for_selector("#report:enabled")
        assert " of 20,000 rocks" in page.inner_text("#progress")


@pytest.mark.long
def test_without_a_scene_one_is_opened_or_written_for_a_terrain_file(tmp_path: Path) -> None:
    (tmp_path / "lab.obj").write_bytes((SCENES / "bench_15m_face.obj").read_bytes())
    with page_of(cwd=tmp_path) as page:
        page.wait_for_selector("#open_path")
        assert page.inner_text("#busy") == ""
        page.fill("#open_path", "nothing.yaml")
        page.click("#open")
        page.wait_for_selector("text=there is no such scene file")
        assert page.inner_text("#busy") == ""
        page.fill("#new_terrain", "lab.obj")
        page.fill("#new_folder", "site")
        page.click("#create")
        page.wait_for_selector("#run")
        ready(page, colours=1)  # a single face
    assert (tmp_path / "site" / "scene.yaml").is_file()


@pytest.mark.long
def test_a_wrong_token_opens_nothing() -> None:
    with served_desk() as desk, browser() as running:
        page = running.new_page()
        answer = page.goto(f"{desk.base}/wrong/")
        assert answer is not None and answer.status == 403
        assert "open the whole address" in page.inner_text("body") and page.locator("canvas").count() == 0


@pytest.mark.long
def test_the_same_run_is_the_same_picture_again(scene: Path) -> None:
    """Each run replaces triangles and colours many times; the browser must not mix old ones with new ones."""
    with page_of(scene) as page:
        ready(page)
        seen = []
        for _ in range(3):
            run_to_the_end(page)
            page.click("#layer_energy")
            page.click("#layer_reach")
            page.wait_for_selector("#legend:has-text('reach probability')")
            page.wait_for_timeout(3000)
            seen.append(settled(view(page), COLOURS))
            picture_that(view(page), lambda now: changed(now, seen[0]) < 0.002)


@pytest.mark.long
def test_the_map_of_the_last_click_stays_where_the_browser_is_slow(scene: Path) -> None:
    """The browser has the first map already and must fetch the second one; it must not draw the second one last."""
    with page_of(scene, script=SLOW_ARRAYS) as page:
        ready(page)
        run_to_the_end(page)
        page.wait_for_timeout(8000)
        reach = settled(view(page), COLOURS)
        page.click("#layer_energy")
        page.click("#layer_reach")
        page.wait_for_timeout(8000)
        assert changed(settled(view(page), COLOURS), reach) < 0.002
        page.click("#layer_energy")
        picture_that(view(page), lambda now: changed(now, reach) > 0.01)
