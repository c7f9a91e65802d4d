"""Tests that a report is complete, states its weaknesses first, and consists of one file."""

import io
import json
import re
import shutil
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread, imsave
from scenes.benches_fallen_from import bench
from typer.testing import CliRunner

from rpf3d_core.cli import app
from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.errors import InputError
from rpf3d_core.report import view
from rpf3d_core.report.content import FIELDS, LIMITS, report_elements
from rpf3d_core.report.elements import Heading, Picture, Table, Text, View, Warnings
from rpf3d_core.report.html import html_document
from rpf3d_core.report.pdf import PNG, quoted, write_pdf, write_source
from rpf3d_core.report.report import write_report
from rpf3d_core.report.run_files import read_hazard, read_impacts, read_run
from rpf3d_core.report.segments import segments_of
from rpf3d_core.report.toe import beyond_toe
from rpf3d_core.report.view import draped, terrain_seen, view_html
from rpf3d_core.report.words import UNKNOWN
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.model import AreaSpec
from rpf3d_core.scene.reading import read_scene

SCENES = Path(__file__).parents[2] / "config" / "scenes"
SECTIONS = [
    "The answer", "Terrain, paths and hazard", "Critical section", "Retention of each bench", "Distance from the toe",
    "Where a fence would stand", "Inputs and where they come from", "Limits of the answer", "Sign-off",
]  # fmt: skip


class Page(HTMLParser):
    """The text of a page without its scripts, and the addresses that the page would load."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.words, self.fetched, self._within = [], [], ""
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self._within = tag
        self.fetched += [value for name, value in attrs if name in ("src", "href", "data", "srcset", "action")]

    def handle_data(self, data):
        if self._within not in ("script", "style"):
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def tables(elements, header):
    return [element for element in elements if isinstance(element, Table) and element.header[0] == header]


def test_a_report_has_every_section_in_order_and_warnings_first(report) -> None:
    text = Page(report[0].read_text(encoding="utf-8")).text
    places = [text.index(section) for section in SECTIONS]
    assert places == sorted(places)
    assert text.index("Read first") < places[0]
    assert all(sentence in text for sentence in (*LIMITS, *FIELDS))


def test_a_report_identifies_its_run(report, unknown_ground) -> None:
    text = Page(report[0].read_text(encoding="utf-8")).text
    summary = json.loads((unknown_ground / "summary.json").read_text())
    assert "North wall <stage 3> & #[ramp]_*" in text
    date = json.loads((unknown_ground / "inputs.json").read_text())["date"].replace("T", " ")
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d[+-]\d\d:\d\d", date)
    facts = dict(tables(report_elements(read_run(unknown_ground), "north"), "this run")[0].rows)
    assert facts == {
        "site": "north", "date of the run": date, "scene file": "bench_15m.yaml",
        "scene digest (SHA-256)": summary["scene"]["digest"],
        "rpf3d version": summary["versions"]["rpf3d"], "seed": "1", "rocks flown": "128 of 128",
        "parameter sets": "64",
    }  # fmt: skip
    assert all(f"{name} {fact}" in text for name, fact in facts.items() if name != "site")


def test_what_makes_the_answer_too_sure_stands_first(unknown_ground, known_ground) -> None:
    for folder, expected in ((unknown_ground, "not from a calibration"), (known_ground, "every coefficient counts as")):
        elements = report_elements(read_run(folder), "site")
        first = next(i for i, element in enumerate(elements) if isinstance(element, Warnings))
        assert first == 1, "the title, then warnings, then facts of the run"
        assert any(expected in sentence for sentence in elements[first].sentences)


def test_warnings_of_the_run_are_in_the_report(unknown_ground, tmp_path) -> None:
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    inputs = json.loads((folder / "inputs.json").read_text())
    (folder / "inputs.json").write_text(json.dumps(inputs | {"warnings": ["a rock reaches 900 m/s"]}))
    elements = report_elements(read_run(folder), "site")
    assert any("A rock reaches 900 m/s." in element.sentences for element in elements if isinstance(element, Warnings))


def test_missing_hazard_maps_are_named_first(unknown_ground, tmp_path) -> None:
    """Without its maps, the 3D view shows all ground as if no rock reached it."""
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    expected = "has no hazard maps (`hazard/`)"
    for has_maps in (True, False):
        warnings = next(each for each in report_elements(read_run(folder), "site") if isinstance(each, Warnings))
        assert any(expected in sentence for sentence in warnings.sentences) != has_maps
        shutil.rmtree(folder / "hazard", ignore_errors=True)


def test_notes_that_concern_files_only_stand_with_the_maps_and_not_among_the_warnings(unknown_ground, tmp_path) -> None:
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    inputs = json.loads((folder / "inputs.json").read_text())
    assert not set(inputs["notes"]) & set(inputs["warnings"])
    (folder / "inputs.json").write_text(json.dumps(inputs | {"warnings": ["a rock"], "notes": ["no cell of 1 m"]}))
    elements = report_elements(read_run(folder), "site")
    warnings = next(element for element in elements if isinstance(element, Warnings))
    assert "A rock." in warnings.sentences and "No cell of 1 m." not in warnings.sentences
    headings = [each.text for each in elements[: elements.index(Text("No cell of 1 m.", quiet=True))]
                if isinstance(each, Heading)]  # fmt: skip
    assert headings[-1] == "Terrain, paths and hazard"


def test_an_interrupted_run_says_so_first(unknown_ground, tmp_path) -> None:
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    summary = json.loads((folder / "summary.json").read_text())
    (folder / "summary.json").write_text(json.dumps(summary | {"partial": True, "rocks_planned": 6400}))
    warnings = next(element for element in report_elements(read_run(folder), "site") if isinstance(element, Warnings))
    assert warnings.sentences[0] == "The run was interrupted: 128 of 6,400 rocks have flown."


def test_every_share_has_both_intervals_the_predictive_first(unknown_ground) -> None:
    elements = report_elements(read_run(unknown_ground), "site")
    reached, retained = tables(elements, "zone")[:2]
    assert [table.header[1] for table in (reached, retained)] == ["reached", "retained"]
    for table in (reached, retained):
        assert list(table.header[2:]) == ["95 % predictive", "95 % sampling"]
        _, value, predictive, sampling = next(row for row in table.rows if row[0] == "berm")
        assert re.fullmatch(r"[\d.]+ %", value) and UNKNOWN not in (predictive, sampling) and predictive != sampling
    assert next(row for row in retained.rows if row[0] == "berm")[2] == "0-100 %"


def texts_of(elements) -> list[str]:
    return [element.text for element in elements if isinstance(element, Text)]


def answer_of(run) -> tuple[list[str], list[str]]:
    """Return the first cells of the table of main figures, and the sentences after it up to the next heading."""
    elements = report_elements(run, "site")
    begin = elements.index(Heading("The answer")) + 1
    texts = []
    for element in elements[begin + 1 :]:
        if not isinstance(element, Text):
            break
        texts.append(element.text)
    return [row[0] for row in elements[begin].rows], texts


def test_the_answer_names_every_area_and_the_zones_that_hold_most(known_ground) -> None:
    run = read_run(known_ground)
    some = next(bench for bench in run.summary["benches"].values() if bench["retained"]["share"] is not None)
    run.summary["benches"] = {
        **{f"FACE_{i}": {**some, "reached": share_of(30, 40), "stopped": share_of(0, 40)} for i in range(9)},
        **{f"BENCH_{i}": {**some, "reached": share_of(30, 40), "stopped": share_of(4 + i, 40)} for i in range(3)},
    }
    area = {"reached": some["reached"], "retained": some["retained"], "energy_p95_j": None}
    run.summary["areas_of_interest"] = {f"a{i}": area for i in range(14)}
    names, texts = answer_of(run)
    assert [name for name in names if " area " in name] == [f"rocks that reach the area a{i}" for i in range(14)]
    zones = [name for name in names if name.startswith("retained by")]
    assert zones == [f"retained by BENCH_{i}, of the rocks that reached it" for i in range(3)], "faces hold none"
    assert "; 9 more are in the table" in texts[0]


def test_the_answer_has_the_barriers_and_what_no_rock_reached(unknown_ground) -> None:
    run = read_run(unknown_ground)
    bench = next(iter(run.summary["benches"].values()))
    none = {**bench["reached"], "rocks": 0, "share": 0.0, "predictive": [0.0, 0.024], "sampling": [0.0, 0.0006]}
    pit_floor = {**bench, "reached": none, "retained": {**none, "share": None}}
    run.summary["benches"] = {"BENCH": {**bench, "reached": share_of(90, 128)}, "PIT FLOOR": pit_floor}
    share = {"rocks": 5, "share": 0.4, "interval_95": [0.3, 0.5], "predictive": [0.3, 0.5], "sampling": [0.38, 0.42]}
    run.summary["barriers"] = {"fence": at_a_barrier(share)}
    names, texts = answer_of(run)
    assert [name for name in names if "fence" in name] == [
        "rocks that come to fence",
        *(f"{did}, of the rocks that reached it"
        for did in (
            "caught in the end by fence", "broke through fence at the first arrival",
            "flew over fence at the first arrival",
        ))
    ]  # fmt: skip
    below = texts_of(report_elements(run, "site"))
    assert any("No rock reached PIT FLOOR" in text and "interval 0-3 %" in text for text in below)
    assert any(text.startswith("No rock reached PIT FLOOR. The retention of the benches below") for text in texts)


def test_rocks_lost_to_holes_have_the_share_that_the_warning_points_to(unknown_ground) -> None:
    """A warning names the column `at most`: the retention table and the answer have this share of zones and areas."""
    run = read_run(unknown_ground)
    bench = next(bench for bench in run.summary["benches"].values() if bench["reached"]["rocks"])
    none = {**bench["reached"], "rocks": 0, "share": 0.0, "predictive": [0.0, 0.05], "sampling": [0.0, 0.03]}
    lost = {"lost_to_holes": share_of(20, 128), "reached_at_most": share_of(32, 128)}
    zone, below = {**bench, **lost}, {**bench, **lost, "reached": none, "reached_at_most": share_of(20, 128)}
    run.summary["benches"], run.summary["areas_of_interest"] = {"BENCH": zone, "FLOOR": below}, {"hut": zone}
    elements = report_elements(run, "site")
    reached = tables(elements, "zone")[0]
    assert reached.header[-1] == "at most"
    assert {row[0]: row[-1] for row in reached.rows} == dict.fromkeys(("BENCH", "hut (area)"), "25.0 % (18-34)")
    answer = elements[elements.index(Heading("The answer")) + 1]
    most = next(row for row in answer.rows if row[0].startswith("at most"))
    assert most == ["at most: rocks that reach the area hut or were lost to holes", "25.0 %", UNKNOWN, "18-34 %"]
    assert any("lost to a hole reached such a zone, the share is 15.6 %" in text for text in texts_of(elements))


def test_the_warning_of_rocks_that_did_not_stop_says_what_became_of_them(unknown_ground) -> None:
    run = read_run(unknown_ground)
    run.summary["outcomes"] |= {"left_terrain": {"rocks": 3}, "lost_to_hole": {"rocks": 5}}
    elements = report_elements(run, "site")
    (box,) = (each for each in elements if isinstance(each, Warnings))
    words = "8 of 128 rocks did not stop on the terrain (5 fell through holes of the terrain; 3 flew past the edge"
    assert any(sentence.startswith(words) for sentence in box.sentences)
    assert any("leaves out the 8 rocks that did not stop" in text for text in texts_of(elements))


def test_rocks_that_broke_are_not_rocks_that_did_not_stop(unknown_ground) -> None:
    """Ten of the rows are rocks that broke, and two of them are rocks or fragments that flew past the edge."""
    run = read_run(unknown_ground)
    run.summary["outcomes"] |= {"fragmented": {"rocks": 10}, "left_terrain": {"rocks": 2}}
    (box,) = (each for each in report_elements(run, "site") if isinstance(each, Warnings))
    assert any(sentence.startswith("10 rocks broke. ") for sentence in box.sentences)
    assert any(sentence.startswith("2 of 118 rocks and fragments did not stop") for sentence in box.sentences)
    run.summary["outcomes"].pop("left_terrain")
    elements = report_elements(run, "site")
    (box,) = (each for each in elements if isinstance(each, Warnings))
    assert not any("did not stop" in sentence for sentence in (*box.sentences, *texts_of(elements)))


def test_inputs_have_the_masses_and_the_direction_of_the_release(unknown_ground) -> None:
    run = read_run(unknown_ground)
    run.inputs["scene"]["sources"][0] |= {"speed": 2.0, "azimuth_deg": 110.0, "elevation_deg": -20.0, "spread_deg": 5.0}
    run = run._replace(ends=run.ends._replace(mass=np.geomspace(7.5, 3.1e4, len(run.ends.mass))))
    rows = tables(report_elements(run, "site"), "input")[0].rows
    (mass,) = (value for name, value, _ in rows if name == "mass of the rocks flown")
    low, high, middle = (float(text.replace(",", "")) for text in re.findall(r"[\d,.]+(?= to| kg)", mass))
    mass = run.ends.mass
    assert (low, high, middle) == pytest.approx((mass.min(), mass.max(), np.median(mass)), 0.005)
    assert any(value == "2 m/s, towards 110 degrees clockwise from north, 20 degrees below the horizontal, "
               "in a cone of 5 degrees to each side" for _, value, _ in rows)  # fmt: skip


def test_rocks_that_did_not_stop_are_said_to_pass_every_fence(unknown_ground) -> None:
    run, words = read_run(unknown_ground), "such as rocks lost to holes, count as rocks that pass every place"
    stopped = run._replace(ends=run.ends._replace(at_rest=np.ones(len(run.ends.at_rest), dtype=bool)))
    lost = run._replace(ends=run.ends._replace(at_rest=np.arange(len(run.ends.at_rest)) > 9))
    for each, expected in ((stopped, False), (lost, True)):
        texts = [element.text for element in report_elements(each, "site") if isinstance(element, Text)]
        assert any(words in text for text in texts) == expected


def test_a_report_of_a_scene_yaml_has_the_name_of_its_folder(unknown_ground, tmp_path) -> None:
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    inputs = json.loads((folder / "inputs.json").read_text())
    for path, name in (("north_wall/scene.yaml", "north_wall"), ("north_wall/stage_3.yaml", "stage_3")):
        inputs["files"][0]["path"] = str(tmp_path / path)
        (folder / "inputs.json").write_text(json.dumps(inputs))
        write_report(folder, tmp_path / "r.html")
        assert f"<title>Rockfall report: {name}</title>" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_captions_name_what_is_shown_and_only_that(unknown_ground, known_ground) -> None:
    captions = [
        [each.caption for each in report_elements(read_run(folder), "site") if isinstance(each, Picture)]
        for folder in (unknown_ground, known_ground)
    ]
    assert captions[0][1] == "Reach probability of the cells: upper end of its 95 % predictive interval."
    assert captions[1][1] == "Reach probability of the cells."
    for each in captions:
        assert "may be larger than the p95 energy of the cell's zone" in each[2]
        assert not any("barriers" in caption for caption in each), "no scene has barriers"


def test_inputs_have_the_areas_the_numbers_of_rocks_and_the_units_of_angles(unknown_ground) -> None:
    run = read_run(unknown_ground)
    run.inputs["scene"]["areas_of_interest"] = [
        {"name": "hut", "polygons": "hut.geojson"}, {"name": "road", "polygons": [[0, 0], [1, 0], [1, 1]]},
    ]  # fmt: skip
    elements = report_elements(run, "site")
    rows = tables(elements, "input")[0].rows
    assert [row[1] for row in rows if row[0].startswith("area ")] == ["hut.geojson", "3 corners"]
    flown = [row[1] for row in rows if row[0].startswith("source ") and "rocks flown" in row[1]]
    assert sum(int(words.split()[0]) for words in flown) == 128
    assert "friction angle (degrees)" in {row[1] for row in tables(elements, "material")[0].rows}


def at_a_barrier(share: dict) -> dict:
    """Return the figures of a barrier as in summary.json, with the same share for all that rocks did."""
    p95 = {"p95": 1.0, "p95_interval_95": [0.5, 2.0], "p95_predictive": [0.2, 4.0], "max": 3.0}
    return {
        "came": 12, "capacity_j": 500.0, "height_m": 2.0, "first_energy_j": p95, "first_height_over_ground_m": p95,
        "caught": share, "first_broken_through": share, "first_flown_over": share,
    }  # fmt: skip


def test_rocks_that_a_barrier_caught_are_said_to_count_as_retained(unknown_ground) -> None:
    run, words = read_run(unknown_ground), "Rocks that barriers caught count as stopped"
    assert not any(words in each.text for each in report_elements(run, "site") if isinstance(each, Text))
    run.summary["outcomes"]["caught"] = share_of(12, 128)
    texts = [each.text for each in report_elements(run, "site") if isinstance(each, Text)]
    assert sum(words in text for text in texts) == 2, "below the answer and below the table of retention"


def test_distances_and_places_for_fences_say_that_barriers_were_in_place(unknown_ground) -> None:
    run, words = read_run(unknown_ground), "with the barriers of the scene in place (fence)"
    assert not any("barriers of the scene in place" in each.text for each in report_elements(run, "site")
                   if isinstance(each, Text))  # fmt: skip
    far = {**at_a_barrier(share_of(0, 1)), "came": 0}
    run.summary["barriers"] = {"fence": at_a_barrier(share_of(5, 12)), "far fence": far}
    texts = [each.text for each in report_elements(run, "site") if isinstance(each, Text)]
    assert sum(words in text for text in texts) == 2


def test_a_run_without_warnings_has_no_box_of_warnings(unknown_ground) -> None:
    run = read_run(unknown_ground)
    run.inputs.update(warnings=[], notes=[], surer_than_it_may_be=[])
    run = run._replace(ends=run.ends._replace(at_rest=np.ones(len(run.ends.key), dtype=bool)))
    assert len(beyond_toe(run).rows) == len(run.ends.key), "no rock is without a toe"
    assert [element for element in report_elements(run, "site") if isinstance(element, Warnings)] == []


def test_without_unknowns_no_predictive_interval_is_claimed(known_ground) -> None:
    elements = report_elements(read_run(known_ground), "site")
    answer = next(element for element in elements if isinstance(element, Table) and element.header[0] == "")
    assert answer.rows and {row[2] for row in answer.rows} == {UNKNOWN}
    texts = [element.text for element in elements if isinstance(element, Text)]
    assert any("Predictive intervals are unknown" in text for text in texts)


def test_inputs_say_where_they_come_from(unknown_ground, known_ground) -> None:
    elements = report_elements(read_run(unknown_ground), "site")
    rows = {row[1]: row for row in tables(elements, "material")[0].rows}
    assert "library bedrock" in rows["normal restitution"][3] and " to " in rows["normal restitution"][2]
    assert " to " in rows["friction angle (degrees)"][2]
    assert rows["friction angle (degrees)"][3].startswith("range assumed by rpf3d")
    assert any(element.text.startswith("Ground: NOT calibrated") for element in elements if isinstance(element, Text))
    known = tables(report_elements(read_run(known_ground), "site"), "material")[0].rows
    assert {(row[0], row[1]): row[3] for row in known} == {
        (material, coefficient): "stated in the scene"
        for material in ("default", "spill")
        for coefficient in ("normal restitution", "tangential restitution", "friction angle (degrees)")
    }
    inputs = {row[0]: row[2] for row in tables(report_elements(read_run(known_ground), "site"), "input")[0].rows}
    assert inputs["stop speed"] == "stated in the scene"
    assert inputs["gravity"] == "NOT stated: the default of rpf3d"


def test_a_report_fetches_nothing(report) -> None:
    html = report[0].read_text(encoding="utf-8")
    assert [value[:40] for value in Page(html).fetched if not value.startswith("data:")] == []
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', html)
    assert policy is not None and "default-src 'none'" in policy[1]
    assert not re.search(r"https?:|\*", policy[1])


def test_names_of_the_user_are_text_and_not_markup(tmp_path) -> None:
    bad = '</title><script>alert(1)</script> "#eval(1)" \\ $x$ @ref'
    elements = [Heading(bad, 1), Text(bad), Warnings(bad, [bad]), Table((bad, "b"), [(bad, "1")])]
    html = html_document(bad, elements, "")
    assert "<script>alert" not in html and html.count("&lt;script&gt;alert") == 7
    assert quoted('a"\\\n') == '"a\\"\\\\\\n"'
    write_pdf(tmp_path / "r.pdf", bad, elements)
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF")


PAGE = re.compile(rb"/Type\s*/Page\b(?!s)")
FONT = re.compile(rb"/BaseFont\s*/(?:[A-Z]{6}\+)?([A-Za-z]+)")
EMBEDDED = {b"LibertinusSerif", b"NewCM", b"NewCMMath", b"DejaVuSansMono"}
"""Font families that typst contains."""


def test_the_pdf_has_pages_pictures_and_fonts_of_its_own(report, unknown_ground, tmp_path) -> None:
    content = report[1].read_bytes()
    assert content.startswith(b"%PDF") and content.rstrip().endswith(b"%%EOF")
    elements = report_elements(read_run(unknown_ground), "site")
    pictures = sum(isinstance(element, Picture) for element in elements)
    assert pictures >= 2
    assert len(re.findall(rb"/Subtype\s*/Image", content)) >= pictures
    write_pdf(tmp_path / "short.pdf", "title", [Heading("title", 1), Text("text")])
    assert len(PAGE.findall((tmp_path / "short.pdf").read_bytes())) == 1
    assert len(PAGE.findall(content)) >= 4
    fonts = set(FONT.findall(content))
    assert fonts and fonts <= EMBEDDED


def square_picture() -> Picture:
    png = io.BytesIO()
    imsave(png, np.full((200, 200, 3), 0.5), format="png")
    return Picture(png.getvalue(), "A caption.", 0.9)


def filled(folder: Path, elements) -> list[float]:
    """Return, for each page of a PDF of the elements, the share of its height down to the last text or picture."""
    typst = pytest.importorskip("typst", reason="typst is not installed: it is in the extra `report`")
    found = typst.compile(write_source(folder, "t", elements), ignore_system_fonts=True, format="png", ppi=30.0)
    pages = [imread(io.BytesIO(page))[..., :3] for page in (found if isinstance(found, list) else [found])]
    bodies = [page[: int(0.94 * len(page))] for page in pages]
    return [np.flatnonzero((body < 0.95).any(axis=(1, 2)))[-1] / len(body) for body in bodies]


@pytest.mark.parametrize("rows", range(2, 30, 3))
def test_pages_with_large_pictures_and_tables_are_full(tmp_path, rows: int) -> None:
    """Square pictures, such as deep sections, and tables must fill pages, whatever precedes them."""
    table = Table(("zone", "reached"), [(f"bench_{row}", "1 %") for row in range(14)])
    above = Table(("this run", ""), [("site", str(row)) for row in range(rows)])
    picture = square_picture()
    *pages, _ = filled(tmp_path, [Heading("Report", 1), above, picture, picture, table, picture, table, table])
    assert min(pages) > 0.7, pages


def test_no_heading_is_left_alone_at_the_end_of_a_page(tmp_path) -> None:
    """A heading and the note on the 3D view go to the next page with a picture that does not fit."""
    above = Table(("this run", ""), [("site", str(row)) for row in range(40)])
    section = [Heading("Terrain"), View("", "", "The view is in the HTML file."), square_picture()]
    typst = pytest.importorskip("typst", reason="typst is not installed: it is in the extra `report`")
    source = write_source(tmp_path, "t", [Heading("Report", 1), above, *section])
    source.write_text(source.read_text() + "\n#context [#metadata(query(heading).last().location().page()) <page>]")
    assert json.loads(typst.query(source, "<page>", field="value", root=tmp_path, ignore_system_fonts=True)) == [2]


@pytest.mark.parametrize("rows", [3, 9, 20])
def test_the_layout_of_many_pictures_converges(tmp_path, rows: int) -> None:
    typst = pytest.importorskip("typst", reason="typst is not installed: it is in the extra `report`")
    table = Table(("zone", "reached"), [(f"bench_{row}", "1 %") for row in range(rows)])
    elements = [Heading("Report", 1), *[table, *[square_picture()] * 3] * 5]
    _, warnings = typst.compile_with_warnings(write_source(tmp_path, "t", elements), ignore_system_fonts=True)
    assert [warning.message for warning in warnings] == []


@pytest.mark.parametrize("png", [b"no picture", PNG + bytes(8)])
def test_a_report_that_cannot_be_laid_out_says_so(tmp_path, png: bytes) -> None:
    """The picture is not a PNG, or is a damaged one."""
    broken = [Picture(png, "a picture that is damaged")]
    with pytest.raises(InputError, match=r"r\.pdf: could not be laid out as PDF \(.+\); the HTML report is complete"):
        write_pdf(tmp_path / "r.pdf", "title", broken)
    assert not (tmp_path / "r.pdf").exists()


def test_one_path_for_both_reports_is_refused(unknown_ground, tmp_path) -> None:
    both = tmp_path / "report"
    done = CliRunner().invoke(
        app, ["report", str(unknown_ground), "--out", str(both), "--pdf", f"{tmp_path}/../{tmp_path.name}/report"]
    )
    assert done.exit_code != 0 and not both.exists()
    with pytest.raises(InputError, match="is named for both the HTML report and the PDF"):
        write_report(unknown_ground, both, both)


@pytest.mark.parametrize("options", [["--out", "{}", "--pdf"], ["--pdf", "--out", "{}"], ["--out={}", "--pdf"]])
def test_a_pdf_without_a_path_is_written_next_to_the_html_file(monkeypatch, tmp_path, options: list[str]) -> None:
    asked: list[Any] = []
    monkeypatch.setattr("rpf3d_core.report.report.write_report", lambda *given: asked.append(given))
    html = tmp_path / "wall.html"
    done = CliRunner().invoke(app, ["report", "run", *(each.format(html) for each in options)])
    assert done.exit_code == 0 and asked == [(Path("run"), html, tmp_path / "wall.pdf", "")]


def test_the_draped_map_has_at_least_the_values_of_its_cells(known_ground) -> None:
    run = read_run(known_ground)
    grid = read_hazard(run, "reach_probability")
    assert grid is not None
    seen = terrain_seen(run)
    corners, values = draped(seen, grid)
    middle = corners.mean(axis=1)
    summary = run.summary["hazard"]["reach_probability"]
    assert values.max() == pytest.approx(summary["max"])
    below = values < np.nan_to_num(grid.at(middle[:, :2])) - 1e-9
    assert below.mean() < 0.05, "raising a map moves few triangles into the next cell"
    releases = grid.at(run.ends.release[:, :2])
    assert np.isfinite(releases).all() and releases.min() > 0.0, "rocks reach the cells where they start"


@pytest.mark.parametrize("name", ["B 1.pdf", "B 1.PDF"])
def test_a_report_as_html_is_not_written_over_a_pdf(unknown_ground, tmp_path, name: str) -> None:
    (tmp_path / name).write_bytes(b"%PDF")
    done = CliRunner().invoke(app, ["report", str(unknown_ground), "--out", str(tmp_path / name)])
    assert done.exit_code != 0 and (tmp_path / name).read_bytes() == b"%PDF"
    with pytest.raises(InputError, match=r"give the name of an HTML file.+ with --pdf"):
        write_report(unknown_ground, tmp_path / name)


SCENE = """\
terrain: {files: [{path: bench.obj}], up: y}
materials: {default: {normal_restitution: 0.3, tangential_restitution: 0.7}}
sources: [{name: crest, points: [[-0.5, 15.5, 30], [-0.5, 15.5, 34]], rocks: 12, velocity: [2, 0, 0]}]
hazard: {cell: 2}
outputs: {pictures: false, recording: false}
"""


def test_a_map_with_y_up_lies_where_its_rocks_start(tmp_path) -> None:
    terrain = bench()
    lines = [f"v {x!r} {z!r} {-y!r}" for x, y, z in terrain.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in terrain.triangles.tolist()]
    (tmp_path / "bench.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "scene.yaml").write_text(SCENE)
    run_scene(read_scene(tmp_path / "scene.yaml"), tmp_path / "out", None, "reference")
    run = read_run(tmp_path / "out")
    grid = read_hazard(run, "reach_probability")
    assert grid is not None
    assert (grid.at(run.ends.release[:, :2]) > 0.0).all()
    assert np.isnan(grid.at(run.ends.release[:, :2] * (1.0, -1.0) + (0.0, 7.0))).all(), "elsewhere no rock comes"


@pytest.mark.parametrize("names", [("1", "2"), ("NA", "null"), ("2024-01-01", "true")])
def test_names_of_sources_are_text(tmp_path, names) -> None:
    terrain = bench()
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in terrain.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in terrain.triangles.tolist()]
    (tmp_path / "bench.obj").write_text("\n".join(lines) + "\n")
    each = ", ".join(f'{{name: "{name}", points: [[-0.5, 0, 15.5]], rocks: 2, velocity: [2, 0, 0]}}' for name in names)
    scene = SCENE.replace(", up: y", "").replace(SCENE.splitlines()[2], f"sources: [{each}]")
    (tmp_path / "scene.yaml").write_text(scene)
    run_scene(read_scene(tmp_path / "scene.yaml"), tmp_path / "out", None, "reference")
    run = read_run(tmp_path / "out")
    assert [source for source, _, _ in run.ends.key] == [names[0]] * 2 + [names[1]] * 2
    assert segments_of(run)[0].rocks == 4 and read_impacts(run) is not None


def test_a_result_of_another_version_is_refused(unknown_ground, tmp_path) -> None:
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    (folder / "inputs.json").unlink()
    with pytest.raises(InputError, match=r"has no inputs\.json; another version wrote it, so run its scene again"):
        write_report(folder, tmp_path / "r.html")
    with pytest.raises(InputError, match=r"has no summary\.json"):
        write_report(tmp_path, tmp_path / "r.html")


def test_a_damaged_result_is_refused(unknown_ground, tmp_path) -> None:
    folder = shutil.copytree(unknown_ground, tmp_path / "run")
    (folder / "trajectories.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(InputError, match="is damaged"):
        write_report(folder, tmp_path / "r.html")


def test_the_command_says_where_the_report_is(unknown_ground, tmp_path) -> None:
    done = CliRunner().invoke(app, ["report", str(unknown_ground), "--out", str(tmp_path / "r.html")])
    assert done.exit_code == 0, done.output
    assert f"report in {tmp_path / 'r.html'}" in done.output
    assert (tmp_path / "r.html").stat().st_size > 4_000_000


def test_a_missing_library_is_named_with_how_to_install_it(known_ground, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "typst", None)
    with pytest.raises(InputError, match=r"needs the library typst, .*pip install 'rpf3d\[report\]'"):
        write_pdf(tmp_path / "r.pdf", "title", [Text("text")])
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(InputError, match="needs the library plotly"):
        report_elements(read_run(known_ground), "site")


def test_the_view_shows_each_area_with_its_name_on_the_ground(tmp_path) -> None:
    corners = [[9, -9], [13, -9], [13, 9], [9, 9]]
    scene = read_scene(SCENES / "bench_15m.yaml")
    area = AreaSpec(name="berm", polygons=corners)
    run_scene(scene.model_copy(update={"areas_of_interest": (area,)}), tmp_path / "run", 64, "reference")
    run = read_run(tmp_path / "run")
    assert set(map(tuple, run.inputs["outlines"]["berm"][0])) == set(map(tuple, corners))
    html = view_html(run, terrain_seen(run), np.array([1.0, 0.0]))
    assert '"name":"area berm"' in html and html.count('"berm"') == 1
    del run.inputs["outlines"]  # as an earlier version wrote it
    assert '"name":"area berm"' not in view_html(run, terrain_seen(run), np.array([1.0, 0.0]))


def test_a_large_terrain_is_reduced_for_the_view_and_lies_where_it_lay(known_ground, monkeypatch) -> None:
    run = read_run(known_ground)
    whole = terrain_seen(run)
    monkeypatch.setattr(view, "MOST_TRIANGLES", len(whole.triangles) // 2)
    less = terrain_seen(run)
    assert less.of == len(whole.triangles) and len(less.triangles) <= 1.05 * len(whole.triangles) / 2
    assert less.vertices.min(axis=0) == pytest.approx(whole.vertices.min(axis=0), abs=3.0)
    assert less.vertices.max(axis=0) == pytest.approx(whole.vertices.max(axis=0), abs=3.0)


@pytest.mark.parametrize("wrong", ["out", "pdf"])
def test_an_output_that_cannot_be_written_is_refused_before_the_result_is_read(tmp_path, wrong) -> None:
    places = {"out": tmp_path / "r.html", "pdf": tmp_path / "r.pdf"} | {wrong: tmp_path / "nowhere" / "r"}
    with pytest.raises(InputError, match=r"because there is no folder .*nowhere"):
        write_report(tmp_path / "no result", **places)
    with pytest.raises(InputError, match="is a folder; give the path of a file"):
        write_report(tmp_path / "no result", **places | {wrong: tmp_path})
