"""Tests of measured sizes of rocks, as a list in the scene or as a file with one number per line."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import rpf3d_core as rpf3d
from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.formats.numbers import read_column
from rpf3d_core.results.notes import doubts_of_run
from rpf3d_core.runs.check import check_scene
from rpf3d_core.runs.check_shapes import measured_sizes
from rpf3d_core.scene.measured import sizes_from
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of

SCENE = """\
terrain: {{benches: {{number: 1, height: 8}}}}
materials: {{default: {{normal_restitution: 0.4, tangential_restitution: 0.8}}}}
rock: {{density: 2500, {size}}}
sources: [{{name: top, crest: 1, above_ground: 1, rocks: 400, velocity: [2, 0, 0]}}]
"""


def written(folder: Path, size: str) -> Path:
    (folder / "scene.yaml").write_text(SCENE.format(size=size))
    return folder / "scene.yaml"


def masses(scene: Path, engine: str) -> np.ndarray:
    return rpf3d.simulate(scene, engine=engine).flights.deposits.mass


@pytest.mark.parametrize("measure", ["mass", "volume", "diameter"])
def test_rocks_have_the_measured_sizes_on_both_engines(tmp_path: Path, measure: str) -> None:
    (tmp_path / "blocks.csv").write_text("size\n0.8\n0.4\n1.6\n0.4\n")
    from_file, inline = (written(tmp_path, f"{measure}: {{measured: {given}}}") for given in ("blocks.csv", "x.csv"))
    (tmp_path / "x.csv").write_text("0.4\n0.4\n0.8\n1.6\n")
    found = masses(from_file, "reference")
    of_size = {"mass": lambda x: x, "volume": lambda x: 2500.0 * x, "diameter": lambda x: 2500.0 * np.pi / 6.0 * x**3}
    exact = np.array([of_size[measure](size) for size in (0.4, 0.8, 1.6)])
    assert np.allclose(np.unique(found), exact, rtol=1e-12)
    assert np.mean(np.isclose(found, exact[0])) == pytest.approx(0.5, abs=4.0 * (0.25 / 400) ** 0.5)
    assert np.array_equal(found, masses(inline, "compiled"))


def test_a_list_in_the_scene_is_drawn_like_that_list_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "blocks.txt").write_text("# kg, weighed\n900\n\n250  # broken\n400\n")
    of_file = masses(written(tmp_path, "mass: {measured: blocks.txt}"), "reference")
    of_scene = masses(written(tmp_path, "mass: {measured: [400, 250, 900]}"), "reference")
    assert np.array_equal(of_file, of_scene)


def test_the_digest_follows_the_content_of_the_file(tmp_path: Path) -> None:
    digests = []
    for content in ("250\n400\n", "250\n401\n", "250\n400\n"):
        (tmp_path / "blocks.txt").write_text(content)
        digests.append(scene_digest(read_scene(written(tmp_path, "mass: {measured: blocks.txt}"))))
    assert digests[0] == digests[2] != digests[1]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "holds no number; each line must have one"),
        ("mass\n", "holds no number"),
        ("mass\n1,5\n", "line 2: must be one plain, finite number, but is '1,5'"),
        ("1;2\n", "line 1: must be one plain, finite number, but is 2 cells (1, 2)"),
        ("1\nx\n", "line 2: must be one plain, finite number, but is 'x'"),
        ("1\nnan\n", "line 2: must be one plain, finite number, but is 'nan'"),
        ("1\n1e999\n", "line 2: must be one plain, finite number"),
        ("1 2\n", "line 1: must be one plain, finite number, but is 2 cells (1, 2)"),
        ("mass\n0,97\n", "write 0.97, if the comma is a decimal comma"),
    ],
)
def test_a_file_that_is_no_list_is_refused_by_its_line(tmp_path: Path, content: str, sentence: str) -> None:
    (tmp_path / "sizes.csv").write_text(content)
    with pytest.raises(InputError) as caught:
        read_column(tmp_path / "sizes.csv", None, "mass")
    assert sentence in str(caught.value)
    with pytest.raises(InputError, match="rock"):
        read_scene(written(tmp_path, "mass: {measured: sizes.csv}"))


@pytest.mark.parametrize("begin", [b"PK\x03\x04\x14", b"\xd0\xcf\x11\xe0\xa1", b"PK\x03\x04"])
def test_a_spreadsheet_is_refused_with_what_to_do(tmp_path: Path, begin: bytes) -> None:
    (tmp_path / "blocks.xlsx").write_bytes(begin)
    with pytest.raises(InputError, match=r"blocks\.xlsx: is a spreadsheet, such as of Excel; save it as CSV"):
        read_scene(written(tmp_path, "mass: {measured: blocks.xlsx}"))


def test_a_text_in_another_encoding_is_refused_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "blocks.csv").write_bytes("Länge (m)\n0.5\n".encode("latin-1"))
    with pytest.raises(InputError, match=r"cannot be read as text .*; save it as UTF-8"):
        read_scene(written(tmp_path, "diameter: {measured: blocks.csv}"))


@pytest.mark.parametrize(
    ("measure", "header", "factor"),
    [
        ("diameter", "length (mm)", 0.001), ("diameter", "d [cm]", 0.01), ("diameter", "d_mm", 0.001),
        ("diameter", "Diameter, mm", 0.001), ("diameter", "width ( Inches )", 0.0254), ("diameter", "a (m)", 1.0),
        ("diameter", "d_max", 1.0), ("diameter", "axis (a)", 1.0),
        ("mass", "m (t)", 1000.0), ("mass", "mass_t", 1000.0), ("mass", "kg", 1.0),
        ("volume", "V (dm³)", 0.001), ("volume", "volume_m3", 1.0), ("volume", "V (L)", 0.001),
        ("diameter", "Length (L)", 1.0), ("diameter", "thickness (t)", 1.0), ("mass", "mass (m)", 1.0),
        ("mass", "mass, t", 1000.0), ("mass", "weight t", 1.0), ("mass", "t", 1000.0), ("diameter", "mm", 0.001),
        ("mass", "mass (tonne)", 1000.0), ("mass", "mass (ton)", 1000.0), ("mass", "mass (Mg)", 1000.0),
        ("mass", "mass (kt)", 1e6), ("mass", "mass (pound)", 0.45359237), ("mass", "mass (gram)", 0.001),
        ("diameter", "size (metre)", 1.0), ("diameter", "size (millimetre)", 0.001), ("mass", "mass (lbs)", 0.45359237),
        ("volume", "volume (cubic metres)", 1.0), ("mass", "mass (mg)", 1.0), ("mass", "mass (tons)", 1000.0),
    ],
)  # fmt: skip
def test_a_unit_in_the_header_converts_the_sizes(tmp_path: Path, measure: str, header: str, factor: float) -> None:
    (tmp_path / "blocks.csv").write_text(f'number;"{header}"\n1;200\n2;50\n')
    scene = read_scene(written(tmp_path, f'{measure}: {{measured: blocks.csv, column: "{header}"}}'))
    found = sizes_from(getattr(scene.rock, measure), measure).values.tolist()
    assert found == pytest.approx([50.0 * factor, 200.0 * factor])
    (told,) = measured_sizes(scene)
    assert ("converted to" in told) is (factor != 1.0), told


@pytest.mark.parametrize(
    ("size", "sentence"),
    [
        ("mass: {measured: blocks.csv}", r"line 3: `rock\.mass` has sizes in mm, by the name of the column 'a \(mm\)', "
         "but must be in kg or another unit of mass"),
        ("diameter: 1}\nsources: [{name: top, crest: 1, volume: {measured: blocks.csv}}]\n#",
         r"`sources\[0\]\.volume`"),
    ],
)  # fmt: skip
def test_a_unit_of_another_quantity_is_refused_by_its_place(tmp_path: Path, size: str, sentence: str) -> None:
    (tmp_path / "blocks.csv").write_text("a (mm)\n200\n")
    with pytest.raises(InputError, match=sentence):
        read_scene(written(tmp_path, size))


@pytest.mark.parametrize(
    ("measure", "header", "unit"),
    [("diameter", "mass_t", "t"), ("diameter", "mass_g", "g"), ("mass", "width_m", "m"),
     ("mass", "mean diameter (m)", "m"), ("mass", "max size (m)", "m"), ("diameter", "tonnage (t)", "t"),
     ("diameter", "block_l", "l"), ("volume", "mass, t", "t"), ("diameter", "t", "t")],
)  # fmt: skip
def test_a_unit_of_another_quantity_is_refused(tmp_path: Path, measure: str, header: str, unit: str) -> None:
    """2 t must not be read as 2 m; if the end of a column name may not be a unit, the message says how to rename it."""
    (tmp_path / "blocks.csv").write_text(f'number;"{header}"\n1;2\n')
    with pytest.raises(InputError, match=f"`rock.{measure}` has sizes in {unit}, by the name of the column") as caught:
        read_scene(written(tmp_path, f'{measure}: {{measured: blocks.csv, column: "{header}"}}'))
    assert ("is no unit there, name the column" in str(caught.value)) is ("(" not in header)


@pytest.mark.parametrize(
    ("measure", "header", "key"),
    [("diameter", "Tonnage", "mass"), ("diameter", "mass", "mass"), ("diameter", "Weight t", "mass"),
     ("diameter", "mass (metric ton)", "mass"), ("diameter", "ton", "mass"), ("diameter", "mass (t)", "mass"),
     ("mass", "Volume", "volume"), ("volume", "mean diameter", "diameter")],
)  # fmt: skip
def test_a_column_that_names_another_quantity_is_refused_with_the_key_it_belongs_to(
    tmp_path: Path, measure: str, header: str, key: str
) -> None:
    """2 t must not be read as 2 m, even if the name of the column states no unit."""
    (tmp_path / "blocks.csv").write_text(f'number;"{header}"\n1;2\n')
    with pytest.raises(InputError, match=rf"line 3: `rock\.{measure}` .*the key `{key}`"):
        read_scene(written(tmp_path, f'{measure}: {{measured: blocks.csv, column: "{header}"}}'))


@pytest.mark.parametrize("header", ["size", "diameter of equal mass", "tonnage-weighted diameter", "weighted"])
def test_a_name_that_may_state_a_length_is_a_diameter(tmp_path: Path, header: str) -> None:
    (tmp_path / "blocks.csv").write_text(f"{header}\n2\n")
    assert read_scene(written(tmp_path, "diameter: {measured: blocks.csv}")).rock.diameter


@pytest.mark.parametrize(
    ("size", "units"),
    [("80", "in cm (0.8 m) or in mm (0.08 m), or its mass"), ("{measured: [400, 12000]}", "in mm (12 m), or its mass"),
     ("{measured: [40, 120]}", "in cm (1.2 m) or in mm (0.12 m), or"), ("90000", "is its mass in g?")],
)  # fmt: skip
def test_a_size_in_centimetres_is_asked_for(tmp_path: Path, size: str, units: str) -> None:
    (told,) = (told for told in warnings_of(read_scene(written(tmp_path, f"diameter: {size}"))) if "`rock`" in told)
    assert f"more than any rock of a rockfall; is {'' if units.startswith('is') else 'its size '}"[:-3] in told
    assert units in told


@pytest.mark.parametrize(
    ("size", "content", "told"),
    [
        ("mass: 0.9", "", "has no rock above 0.9 kg, 0.0883 m in diameter; is its mass in t?"),
        ("mass: {mean: 1.2, sd: 0.3, min: 0.5, max: 3}", "", "above 3 kg, 0.132 m in diameter; is its mass in t?"),
        ("mass: {measured: [1.4, 0.3, 1.7]}", "", "has no rock above 1.7 kg, 0.109 m in diameter; is its mass in t?"),
        ("mass: {measured: b.csv}", "Masse\n1.4\n12\n", "above 12 kg, 0.209 m in diameter; are its masses in t? Write "
         "their unit in brackets: 'Masse (t)' or 'Masse (kg)'"),
        ("mass: {measured: b.csv}", "mass (g)\n900\n2000\n", "the numbers of the column 'mass (g)' in kg, not in g?"),
        ("diameter: {measured: b.csv}", "d (cm)\n0.8\n1.4\n", "the numbers of the column 'd (cm)' in m, not in cm?"),
        ("diameter: {measured: b.csv}", "d (cm)\n8\n14\n", None),
        ("mass: {measured: b.csv}", "Masse (kg)\n1.4\n2\n", None),
        ("mass: {measured: b.csv}", "Masse\n14\n70\n", None),
        ("mass: {measured: b.csv}", "Masse (t)\n0.4\n2\n", None),
        ("mass: {measured: b.csv}", "14\n20\n", None),
        ("mass: 11", "", None),
        ("diameter: 0.1", "", None),
        ("diameter: {measured: b.csv}", "d (cm)\n20\n40\n", None),
    ],
)  # fmt: skip
def test_small_rocks_are_asked_for_their_unit(tmp_path: Path, size: str, content: str, told: str | None) -> None:
    (tmp_path / "b.csv").write_text(content)
    key = size.partition(":")[0]
    found = [each for each in warnings_of(read_scene(written(tmp_path, size))) if f"`rock.{key}`" in each]
    assert len(found) == (told is not None)
    assert told is None or told in found[0]


def test_a_source_with_small_rocks_is_asked_for_its_unit(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE.format(size="mass: 900").replace("name: top", "name: top, mass: 0.9"))
    found = [each for each in warnings_of(read_scene(tmp_path / "scene.yaml")) if "is its mass in t?" in each]
    assert len(found) == 1 and found[0].startswith("`sources[0].mass` has no rock above 0.9 kg")


@pytest.mark.parametrize(("density", "told"), [(165, "2,640 kg/m3 (165 lb/ft3)"), (301, None), (2500, None)])
def test_a_density_in_pounds_per_cubic_foot_is_asked_for(tmp_path: Path, density: int, told: str | None) -> None:
    text = SCENE.format(size="diameter: 1").replace("density: 2500", f"density: {density}")
    (tmp_path / "scene.yaml").write_text(text)
    found = [each for each in warnings_of(read_scene(tmp_path / "scene.yaml")) if "`rock.density`" in each]
    assert len(found) == (told is not None)
    assert told is None or f"did you mean {told}?" in found[0]


@pytest.mark.parametrize("measure", ["diameter", "mass"])
@pytest.mark.parametrize("header", ["Radius (m)", "radius", "Blockradius", "mean radius_cm", "rayon (m)",
                                    "radio (m)", "raio (cm)", "r (m)", "r_mm", "r"])  # fmt: skip
def test_a_column_of_radii_is_refused(tmp_path: Path, measure: str, header: str) -> None:
    (tmp_path / "blocks.csv").write_text(f"{header}\n0.5\n")
    with pytest.raises(InputError, match=rf"`rock\.{measure}` .*states a radius; double its numbers"):
        read_scene(written(tmp_path, f"{measure}: {{measured: blocks.csv}}"))


@pytest.mark.parametrize("header", ["Umfang (m)", "circumference (m)", "Blockumfang", "perimeter_m"])
def test_a_column_of_circumferences_is_refused(tmp_path: Path, header: str) -> None:
    (tmp_path / "blocks.csv").write_text(f"{header}\n1.9\n")
    with pytest.raises(InputError, match=r"`rock\.diameter` .*states a circumference; divide its numbers by pi"):
        read_scene(written(tmp_path, "diameter: {measured: blocks.csv}"))


@pytest.mark.parametrize(
    ("measure", "header", "key"),
    [("diameter", "Masse", "mass"), ("diameter", "Gewicht", "mass"), ("diameter", "Blockmasse", "mass"),
     ("mass", "Durchmesser", "diameter"), ("mass", "Länge", "diameter"), ("volume", "La\u0308nge", "diameter"),
     ("mass", "Breite", "diameter"), ("mass", "HÖHE", "diameter"), ("mass", "Volumen", "volume")],
)  # fmt: skip
def test_german_names_of_columns_state_their_quantity(tmp_path: Path, measure: str, header: str, key: str) -> None:
    (tmp_path / "blocks.csv").write_text(f"{header}\n2\n", encoding="utf-8")
    with pytest.raises(InputError, match=rf"`rock\.{measure}` .*the key `{key}`"):
        read_scene(written(tmp_path, f"{measure}: {{measured: blocks.csv}}"))


@pytest.mark.parametrize(
    ("measure", "header", "doubt"),
    [("mass", "Tonnage", "may mean tonnes"), ("mass", "weight t", "may mean tonnes"),
     ("mass", "mass_t", "converted from t to kg;"), ("diameter", "d_in", "converted from in to m;"),
     ("mass", "mass (ton)", "converted from t to kg;"), ("mass", "t", "converted from t to kg;"),
     ("mass", "mass (stone)", "has no known unit in brackets: its numbers are read in kg;"),
     ("mass", "mass (mg)", "has no known unit in brackets"), ("mass", "mass (t)", None), ("diameter", "d_mm", None),
     ("diameter", "Kantenlänge (m)", "states an edge length"), ("diameter", "edge (mm)", "states an edge length"),
     ("diameter", "Querschnitt (m)", "states a cross section"), ("volume", "Kantenvolumen", None),
     ("diameter", "Durchmesser im Querschnitt (m)", None), ("diameter", "r_n diameter", None),
     ("diameter", "d_m", None), ("diameter", "axis (a)", None), ("mass", "mass (tonne)", None)],
)  # fmt: skip
def test_a_unit_that_the_name_of_a_column_may_not_mean_is_warned_of(
    tmp_path: Path, measure: str, header: str, doubt: str | None
) -> None:
    """The t of `mass_t` may mean tonnes or total; not only a check, but also a run reports the conversion."""
    (tmp_path / "blocks.csv").write_text(f"{header}\n1\n2\n")
    scene = read_scene(written(tmp_path, f"{measure}: {{measured: blocks.csv}}"))
    found = [told for told in warnings_of(scene) if "the name of the column" in told]
    assert len(found) == (doubt is not None)
    assert all(told.startswith(f"`rock.{measure}`: blocks.csv: the name of the column {header!r}") for told in found)
    assert all(doubt is not None and doubt in told for told in found)


@pytest.mark.parametrize("content", [None, "mass (kg)\n900\n"])
def test_a_file_of_sizes_may_be_removed_or_edited_after_the_flight(tmp_path: Path, content: str | None) -> None:
    """The warnings of a run refer to the file as it was during the run."""
    sizes = tmp_path / "blocks.csv"
    sizes.write_text("mass_t\n0.4\n0.9\n")
    run = rpf3d.simulate(written(tmp_path, "mass: {measured: blocks.csv}"), rocks=20, engine="reference")
    sizes.unlink()
    if content is not None:
        sizes.write_text(content)
    assert len([told for told in doubts_of_run(run) if "'mass_t' is read as a unit" in told]) == 1


@pytest.mark.parametrize(
    ("header", "measure", "told"),
    [("", "mass", "0 to 1 kg"), ("mass (t)\n", "mass", "0 to 1000 kg"), ("V (l)\n", "volume", "0 to 0.001 m3"),
     ("d (mm)\n", "diameter", "0 to 0.001 m")],
)  # fmt: skip
def test_a_size_of_zero_in_a_file_is_refused(tmp_path: Path, header: str, measure: str, told: str) -> None:
    (tmp_path / "sizes.csv").write_text(header + "0\n1\n")
    with pytest.raises(InputError, match=rf"`rock\.{measure}` may be drawn from {told}, but must be above 0"):
        read_scene(written(tmp_path, f"{measure}: {{measured: sizes.csv}}"))


TWO_SOURCES = """\
terrain: {{benches: {{number: 1, height: 8}}}}
materials: {{default: {{{material}}}}}
rock: {{density: 2500, {rock}}}
sources:
  - {{name: fine, crest: 1, above_ground: 1, rocks: 30, velocity: [2, 0, 0], mass: {{measured: [100, 200]}}}}
  - {{name: coarse, crest: 1, above_ground: 1, rocks: 30, velocity: [2, 0, 0], diameter: 1.5}}
  - {{name: others, crest: 1, above_ground: 1, rocks: 30, velocity: [2, 0, 0]}}
"""
POINT = "normal_restitution: 0.4, tangential_restitution: 0.8"
BODY = "restitution: 0.2, friction: 0.6"
COARSE = 2500.0 * np.pi / 6.0 * 1.5**3


@pytest.mark.parametrize(
    ("rock", "material", "others"),
    [
        ("volume: 0.2", POINT, 500.0),
        ("volume: 0.2, shape: sphere", f"{POINT}, rolling_friction: 0.1", 500.0),
        ("shape: {box: [1, 0.8, 0.5]}", BODY, 1000.0),
        ("mass: 70, shape: {family: equant}", BODY, 70.0),
    ],
    ids=["point", "sphere", "box of its own size", "family"],
)
def test_each_source_has_its_own_sizes_or_those_of_the_rock(
    tmp_path: Path, rock: str, material: str, others: float
) -> None:
    (tmp_path / "scene.yaml").write_text(TWO_SOURCES.format(rock=rock, material=material))
    deposits = rpf3d.simulate(tmp_path / "scene.yaml", engine="reference", rocks=60).flights.deposits
    assert set(deposits.mass[deposits.source == 0].round(6).tolist()) == {100.0, 200.0}
    np.testing.assert_allclose(deposits.mass[deposits.source == 1], COARSE, rtol=1e-12)
    np.testing.assert_allclose(deposits.mass[deposits.source == 2], others, rtol=1e-12)


def test_a_source_has_one_size_and_its_digest_is_that_of_before_where_it_has_none(tmp_path: Path) -> None:
    text = TWO_SOURCES.format(rock="volume: 0.2", material=POINT)
    (tmp_path / "scene.yaml").write_text(text.replace("diameter: 1.5", "diameter: 1.5, mass: 3"))
    with pytest.raises(InputError, match=r"`sources\[1\]` must have exactly one of diameter, mass, volume"):
        read_scene(tmp_path / "scene.yaml")
    (tmp_path / "scene.yaml").write_text(text)
    other = scene_digest(read_scene(tmp_path / "scene.yaml"))
    (tmp_path / "scene.yaml").write_text(text.replace("diameter: 1.5", "diameter: 1.6"))
    assert scene_digest(read_scene(tmp_path / "scene.yaml")) != other


TABLE = "block;diameter_m;mass_kg\nB0;0.4;120\nB1;0.9;980\n\nB2;0.4;110\n"


def test_a_column_of_a_table_is_read_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "blocks.csv").write_text(TABLE)
    (tmp_path / "plain.csv").write_text("120\n980\n110\n")
    named = masses(written(tmp_path, "mass: {measured: blocks.csv, column: mass_kg}"), "reference")
    assert np.array_equal(named, masses(written(tmp_path, "mass: {measured: plain.csv}"), "reference"))
    assert set(named) == {110.0, 120.0, 980.0}


@pytest.mark.parametrize(
    ("column", "content", "sentence"),
    [
        ("size", TABLE, "the column 'size' is not in the file; its columns are block, diameter_m, mass_kg"),
        ("a", "a;a\n1;2\n", "the column 'a' is twice in the file"),
        ("a", "1;2\n", "its first line does not name columns"),
        ("block", TABLE, "line 2: the column 'block' must be one plain, finite number, but is 'B0'"),
        ("b", "a;b\n1;2\n3\n", "line 3: the column 'b' must be one plain, finite number, but is ''"),
        (None, TABLE, "name one of the columns block, diameter_m, mass_kg as `column`"),
    ],
)
def test_a_column_that_cannot_be_read_is_named(
    tmp_path: Path, column: str | None, content: str, sentence: str
) -> None:
    (tmp_path / "blocks.csv").write_text(content)
    with pytest.raises(InputError) as caught:
        read_column(tmp_path / "blocks.csv", column, "mass")
    assert sentence in str(caught.value)


def test_a_column_of_a_list_in_the_scene_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the sizes are in the scene and not in a file"):
        read_scene(written(tmp_path, "mass: {measured: [400, 250], column: mass_kg}"))


@pytest.mark.parametrize(
    ("size", "sentence"),
    [
        ("diameter: {measured: blocks.csv, column: diameter_m}",
         "diameter: column 'diameter_m' of blocks.csv, read in m: 3 values from 0.4 to 0.9"),
        ("mass: {measured: one.csv}", "mass: column 'kg' of one.csv, read in kg: 2 values from 250 to 400"),
        ("mass: {measured: bare.csv}", "mass: the only column of bare.csv, read in kg: 2 values from 250 to 400"),
    ],
)  # fmt: skip
def test_check_says_which_column_is_read_in_which_unit(tmp_path: Path, size: str, sentence: str) -> None:
    (tmp_path / "blocks.csv").write_text(TABLE)
    (tmp_path / "one.csv").write_text("kg\n400\n250\n")
    (tmp_path / "bare.csv").write_text("400\n250\n")
    assert check_scene(read_scene(written(tmp_path, size))).measured == (sentence,)
    done = CliRunner().invoke(app, ["check", str(tmp_path / "scene.yaml")])
    assert sentence[:30] in done.output


def test_a_scene_without_a_column_keeps_its_digest(tmp_path: Path) -> None:
    (tmp_path / "blocks.txt").write_text("250\n400\n")
    scene = read_scene(written(tmp_path, "mass: {measured: blocks.txt}"))
    assert "column" not in scene.model_dump()["rock"]["mass"]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("Durchmesser [m]\n0,6\n", "line 2: must be one plain, finite number, but is '0,6'; write 0.6"),
        ("Nr;Durchmesser [m]\n1;0.6\n", "name one of the columns Nr, Durchmesser [m] as `column`"),
    ],
)
def test_a_refusal_names_no_column_that_the_scene_does_not_name(tmp_path: Path, content: str, sentence: str) -> None:
    (tmp_path / "blocks.csv").write_text(content)
    with pytest.raises(InputError) as caught:
        read_scene(written(tmp_path, "diameter: {measured: blocks.csv}"))
    assert "`rock.diameter` is refused: " in str(caught.value) and sentence in str(caught.value)
