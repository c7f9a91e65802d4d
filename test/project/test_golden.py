"""Tests that the results of this tree are bitwise those of golden.json (test/support/golden_results/golden.py).

A failure names the parts that differ. For an intended change, run
`PYTHONPATH=test/support:. python -m golden_results.golden --renew "WHY"`.
"""

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
import rasterio
from golden_results import golden
from golden_results.golden_digests import SENTENCE, digest_of, digests_of, without_sentences
from golden_results.golden_scenes import ENTRIES
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

RENEW = 'if that is intended: PYTHONPATH=test/support:. python -m golden_results.golden --renew "WHY"'
FLOWN = "meshes_of_zones"
"""Name of an entry that flies quickly and writes every kind of file."""


QUICK = ("lab_40", "rebound_coulomb_limited", golden.SESSION)
"""Entries that `make test` compares; `make test-all` compares all."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.long) for name in golden.NAMES]
)
def test_an_entry_has_the_golden_results(name: str) -> None:
    code, printed = printed_by_the_command(name)
    if printed.startswith(("nothing is compared: ", f"{name}: left out")):
        pytest.skip(printed)
    assert code == 0, f"{printed}\n{RENEW}"
    assert printed.startswith(f"{name}: same")


def printed_by_the_command(*words: str) -> tuple[int, str]:
    """Run the command in a process of its own; return the exit code and what it printed."""
    command = [sys.executable, "-m", "golden_results.golden", *words]
    tree = os.pathsep.join(map(str, (golden.ROOT / "test/support", golden.ROOT)))
    environment = os.environ | golden.common_instructions() | {"PYTHONPATH": tree}
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, cwd=golden.ROOT)
    return ended.returncode, ended.stdout + ended.stderr


def test_golden_json_has_every_entry_and_a_reason() -> None:
    assert list(golden.entries()) == list(golden.NAMES), RENEW
    assert golden.stored()["why"].strip()


def test_every_model_and_effect_has_an_entry() -> None:
    offered = {f"{each['kind']}.{each['name']}" for each in json.loads(golden.command("effects", "--json"))}
    named = set().union(*(entry.named for entry in ENTRIES.values()))
    assert offered - named == set(), "add a scene to test/support/golden_results/golden_scenes.py"
    assert {"rebound", "ground", "contact", "effects"} == {each.partition(".")[0] for each in offered}


def test_no_two_entries_have_the_same_impacts() -> None:
    found = Counter(parts["impacts.parquet"] for name, parts in golden.entries().items() if name in ENTRIES)
    assert [digest for digest, count in found.items() if count > 1] == [], "the model or key of an entry has no effect"


# --- the digests themselves


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the result folder of the entry FLOWN."""
    folder = tmp_path_factory.mktemp("golden")
    golden.made(FLOWN, folder)
    return folder / "reference" / golden.RESULTS


@pytest.fixture
def copied(results: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(results, tmp_path / "copied"))


def in_text(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def in_table(path: Path, **changed: pa.Array) -> None:
    table = pyarrow.parquet.read_table(path)
    for name, column in changed.items():
        field = table.schema.field(name).with_type(column.type)
        table = table.set_column(table.column_names.index(name), field, column)
    pyarrow.parquet.write_table(table, path)


def column_of(path: Path, name: str) -> np.ndarray:
    return pyarrow.parquet.read_table(path).column(name).to_numpy().copy()


def by_a_bit(path: Path) -> None:
    speed = column_of(path, "speed_in")
    speed[3] = np.nextafter(speed[3], np.inf)
    in_table(path, speed_in=pa.array(speed))


def in_single_precision(path: Path) -> None:
    in_table(path, t=pa.array(column_of(path, "t").astype(np.float32)))


def without_a_value(path: Path) -> None:
    facet = pyarrow.parquet.read_table(path).column("facet").to_pylist()
    in_table(path, facet=pa.array([None, *facet[1:]], pa.int64()))


def in_other_order(path: Path) -> None:
    table = pyarrow.parquet.read_table(path)
    pyarrow.parquet.write_table(table.take([1, 0, *range(2, len(table))]), path)


def in_a_cell(path: Path) -> None:
    with rasterio.open(path, "r+") as file:
        band = file.read(1)
        band.flat[0] = 7
        file.write(band, 1)


def in_nodata(path: Path) -> None:
    with rasterio.open(path, "r+") as file:
        file.nodata = -1.0


def in_place(path: Path) -> None:
    with rasterio.open(path, "r+") as file:
        file.transform = file.transform @ rasterio.Affine.translation(1.0, 0.0)


def rewritten(path: Path, lift: float = 0.0) -> None:
    """Write a VTP file again with VTK, uncompressed, with the first point raised by `lift` (m)."""
    reader, writer = vtkXMLPolyDataReader(), vtkXMLPolyDataWriter()
    reader.SetFileName(str(path))
    reader.Update()
    if lift:  # adding 0 would change -0.0
        x, y, z = reader.GetOutput().GetPoints().GetPoint(0)
        reader.GetOutput().GetPoints().SetPoint(0, x, y, z + lift)
    writer.SetInputData(reader.GetOutput())
    writer.SetFileName(str(path))
    writer.SetDataModeToBinary()
    writer.SetCompressorTypeToNone()
    assert writer.Write()


CHANGES: dict[str, tuple[str, Any]] = {
    "a digit of a deposit": ("deposits.csv", lambda p: in_text(p, "\n", "\n ")),
    "a bit of an impact": ("impacts.parquet", by_a_bit),
    "the type of a column": ("impacts.parquet", in_single_precision),
    "a missing value": ("impacts.parquet", without_a_value),
    "the order of points": ("trajectories.parquet", in_other_order),
    "a cell": ("hazard/deposits.tif", in_a_cell),
    "nodata": ("hazard/energy_j.tif", in_nodata),
    "the place of a map": ("hazard/energy_j.tif", in_place),
    "a zone of hazard": ("hazard/zones.geojson", lambda p: in_text(p, '"level": 0.1', '"level": 0.2')),
    "a bench": ("hazard/benches.csv", lambda p: in_text(p, "talus", "talus_")),
    "a vertex": ("terrain.vtp", lambda p: rewritten(p, 1e-9)),
    "a point of a path": ("trajectories.vtp", lambda p: rewritten(p, 1e-9)),
    "a profile": ("profiles/sections.csv", lambda p: in_text(p, "\n", "\n ")),
    "a number of the summary": ("summary.json", lambda p: in_text(p, '"impacts": ', '"impacts": 1')),
    "a key of the summary": ("summary.json", lambda p: in_text(p, '"path_m"', '"way_m"')),
}


@pytest.mark.long
@pytest.mark.parametrize("change", CHANGES)
def test_a_change_of_a_result_is_named(change: str, results: Path, copied: Path) -> None:
    part, alter = CHANGES[change]
    alter(copied / part)
    assert golden.differences(digests_of(results), digests_of(copied)) == [f"{part}: changed"]


def test_a_new_and_a_missing_file_are_named_and_an_unknown_suffix_is_refused(results: Path, copied: Path) -> None:
    (copied / "hazard" / "height_m.tif").rename(copied / "hazard" / "depth_m.tif")
    named = golden.differences(digests_of(results), digests_of(copied))
    assert named == ["hazard/depth_m.tif: new", "hazard/height_m.tif: missing"]
    (copied / "notes.txt").write_text("")
    with pytest.raises(KeyError, match="txt"):
        digests_of(copied)


def test_times_sentences_pictures_and_the_encoding_of_files_do_not_count(results: Path, copied: Path) -> None:
    summary = json.loads((copied / "summary.json").read_text())
    summary |= {"read_s": 99.0, "rocks_per_s": 1.0, "engine": "another", "versions": {}}
    summary["runout_m"]["of"] = "in other words"
    (copied / "summary.json").write_text(json.dumps(summary))
    table = pyarrow.parquet.read_table(copied / "impacts.parquet")
    pyarrow.parquet.write_table(table, copied / "impacts.parquet", compression="none", use_dictionary=False)
    rewritten(copied / "terrain.vtp")
    rewritten(copied / "trajectories.vtp")
    (copied / "map.png").write_bytes(b"")
    assert golden.differences(digests_of(results), digests_of(copied)) == []


def test_a_string_with_a_blank_is_a_sentence_and_a_path_counts_by_its_name() -> None:
    summary = {"of": "all rocks", "kind": "zone", "files": ["/somewhere/pit.stl"], "none": None, "level": 0.5}
    assert without_sentences(summary) == {
        "of": SENTENCE, "kind": "zone", "files": ["pit.stl"], "none": None, "level": 0.5
    }  # fmt: skip


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (0.0, -0.0), (1, 1.0), (1, True), (None, 0), ("1", 1), (["ab", "c"], ["a", "bc"]), ([[1], 2], [[1, 2]]),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}), (np.zeros(4), np.zeros((2, 2))), (np.zeros(1), np.zeros(2, np.float32)),
        (b"a", "a"),
    ],
)  # fmt: skip
def test_different_values_have_different_digests(one: object, other: object) -> None:
    assert digest_of(one) != digest_of(other)


def test_a_type_without_a_rule_is_refused() -> None:
    with pytest.raises(TypeError, match="set"):
        digest_of([{1, 2}])


# --- the command


@pytest.fixture
def own_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Replace golden.json by a list with a single entry; return the path of the list."""
    monkeypatch.setattr(golden, "NAMES", ("lab_40",))
    monkeypatch.setattr(golden, "GOLDEN", tmp_path / "golden.json")
    monkeypatch.setattr(golden, "engines_of", lambda name: ("reference",))
    golden.renew("a test")
    return tmp_path / "golden.json"


def test_a_renewal_stores_the_reason_and_the_digests(own_list: Path, tmp_path: Path) -> None:
    content = json.loads(own_list.read_text())
    assert content["why"] == "a test"
    assert content["entries"] == {"lab_40": golden.made("lab_40", tmp_path / "made")}


def test_the_command_names_the_part_that_differs(own_list: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert golden.main(["lab_40"]) == 0
    assert "lab_40: same" in capsys.readouterr().out
    content = json.loads(own_list.read_text())
    content["entries"]["lab_40"]["impacts.parquet"] = "0" * 16
    own_list.write_text(json.dumps(content))
    assert golden.main([]) == 1
    assert "lab_40: DIFFERS" in (printed := capsys.readouterr().out) and "impacts.parquet: changed" in printed


def test_a_renewal_without_a_reason_or_of_some_entries_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--renew", " "], ["--renew", "because", "demo"], ["no_such_entry"]):
        with pytest.raises(SystemExit, match="2"):
            golden.main(words)
    assert "a reason" in capsys.readouterr().err


def test_with_another_fingerprint_nothing_is_compared(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(golden, "fingerprint", lambda: {**golden.stored()["made_with"], "numpy": "0.1"})
    assert golden.why_not_comparable() == "golden.json was made with another numpy"
    assert golden.main(["lab_40"]) == 1
    assert "nothing is compared" in capsys.readouterr().out


def test_the_command_uses_only_instructions_that_all_common_processors_have(monkeypatch: pytest.MonkeyPatch) -> None:
    extensions = {"SIMD Extensions": {"found": ["X86_V3", "X86_V4", "AVX512_ICL"]}}
    monkeypatch.setattr(np, "show_config", lambda mode: extensions)
    assert golden.common_instructions() == {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL"}
    extensions["SIMD Extensions"] = {"found": ["X86_V3"]}
    assert golden.common_instructions() == {}


def test_a_part_on_which_engines_disagree_has_both_digests() -> None:
    one, other = {"deposits.csv": "a", "impacts.parquet": "b"}, {"deposits.csv": "a"}
    found = golden.joined({"reference": one, "compiled": other})
    assert found == {"deposits.csv": "a", "impacts.parquet": "reference b, compiled nothing"}


def test_a_command_that_fails_raises_its_output(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=r"nowhere\.yaml"):
        golden.command("run", tmp_path / "nowhere.yaml", "--out", tmp_path / "out")
