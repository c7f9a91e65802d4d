"""Tests of `rpf3d cost` and `rpf3d run --accuracy` on a small pit, and of the key `method` of a scene."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from programs.command_line import call, refused
from scenes.small_pit import HAZARD_CELL, scene_file

from rpf3d_core.accuracy import geometric, in_contact, measure, numerical, statistical
from rpf3d_core.accuracy.files import read_price_list, write_price_list
from rpf3d_core.accuracy.numerical import Steps
from rpf3d_core.accuracy.statistical import Sampled
from rpf3d_core.accuracy.tables import NOTE
from rpf3d_core.errors import SceneError
from rpf3d_core.hazard.raster import raster_over
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare

LINE = {"setting", "error", "seconds_per_1000_rocks"}
"""Keys of each line of the three lists."""


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduce the measurement to few rocks and settings, because these tests do not check the measured values."""
    monkeypatch.setattr(measure, "PAIRED", 60)
    monkeypatch.setattr(measure, "OVER_TERRAINS", 200)
    monkeypatch.setattr(statistical, "MOST", 500)
    monkeypatch.setattr(geometric, "PARTS", (2, 8))
    monkeypatch.setattr(numerical, "BUDGET", 0.1)
    monkeypatch.setattr(numerical, "RASTER_STEPS", (1e-2,))
    monkeypatch.setattr(measure, "SETTINGS", (Steps(0.1, 0.5), Steps(0.01, 0.05), Steps(1e-5, 0.05, True)))


@pytest.mark.long
def test_rocks_with_a_shape_have_accuracies_of_contact_in_place_of_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quick: None
) -> None:
    scene, out = scene_of_bodies(tmp_path), tmp_path / "out"
    assert call(monkeypatch, "cost", scene, "--out", out, "--target", 0.9) == 0
    told = capsys.readouterr().out
    assert "contact at 2 mm" in told and "left out" in told and "50 digits" in told
    facts = json.loads((out / "cost.json").read_text())
    lines = facts["numerical"]
    assert [line["setting"] for line in lines] == [
        {"method": "contact", "accuracy": 0.002 * factor} for factor in (*in_contact.FACTORS, in_contact.FINEST)
    ]
    assert facts["scene"]["method"] == {"method": "contact", "accuracy": 0.002}
    assert lines[-1]["error"] == lines[-1]["distance"] == 0.0, "the finest is compared with itself"
    for line in lines:
        assert line["error"] == pytest.approx(statistical.beyond_chance(line["distance"], line["floor"]))
        assert line["seconds_per_1000_rocks"] > 0.0 and "tunnelled" not in line
    assert lines[-2]["distance"] > 0.0, "another accuracy is another path"
    first = [line["first_impact_m"][0] for line in lines]
    assert first[-1] == 0.0 and all(off < 0.05 for off in first), "flight is exact up to the first contact"
    assert facts["events_against_exact_arithmetic"]["median_and_largest_by_impact"] == []
    kept = read_price_list(out, facts["scene"]["digest"])
    assert kept is not None and kept.method == {"method": "contact", "accuracy": 0.002}


def test_spheres_have_exact_contacts_only_and_the_list_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quick: None
) -> None:
    scene, out = scene_of_spheres(tmp_path), tmp_path / "out"
    assert call(monkeypatch, "cost", scene, "--out", out, "--target", 0.9) == 0
    reason = "spheres: fixed steps, rasters and impacts with 50 digits are left out, because these methods find only"
    assert reason in capsys.readouterr().out
    facts = json.loads((out / "cost.json").read_text())
    assert [line["setting"] for line in facts["numerical"]] == [{"method": "events"}]
    assert facts["scene"]["method"] == {"method": "events"}
    assert facts["events_against_exact_arithmetic"]["median_and_largest_by_impact"] == []
    assert len(facts["geometric"]) == 3 and len(facts["statistical"]) == 3
    assert call(monkeypatch, "run", scene, "--out", out, "--accuracy", 0.9) == 0
    assert json.loads((out / "summary.json").read_text())["rocks"] == 125, "the fewest rocks that were measured"


def scene_of_spheres(folder: Path) -> Path:
    """Write the scene of the small pit with spheres in place of points; return its path."""
    path = scene_file(folder)
    kept = [line for line in path.read_text().splitlines() if not line.startswith(("rebound", "ground"))]
    points = "tangential_restitution: 0.8"
    text = "\n".join(kept).replace(points, f"{points}, friction_angle_deg: 30, rolling_friction: 0.3")
    path.write_text(f"{text}\nrock: {{shape: sphere, diameter: 0.5}}\nground: sphere\n")
    return path


def scene_of_bodies(folder: Path) -> Path:
    """Write the scene of the small pit with bodies in place of points; return its path."""
    path = scene_file(folder)
    kept = [line for line in path.read_text().splitlines() if not line.startswith(("rebound", "ground"))]
    ground = "restitution: 0.2, friction: 0.6, rolling_resistance: 0.2"
    text = "\n".join(kept).replace("normal_restitution: 0.5, tangential_restitution: 0.8", ground)
    path.write_text(f"{text}\nrock: {{shape: {{family: equant}}}}\n")
    return path


@pytest.mark.long
def test_the_price_list_has_every_series_and_a_run_buys_from_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quick: None
) -> None:
    scene, out = scene_file(tmp_path, more="method: {stepping: {dt: 0.02, threshold: 0.1}}"), tmp_path / "out"
    assert call(monkeypatch, "cost", scene, "--out", out, "--target", 0.3) == 0
    told = capsys.readouterr().out
    assert "the largest is the" in told and "events against 50 digits" in told and NOTE in told, "no line is folded"
    facts = json.loads((out / "cost.json").read_text())
    assert facts["program"] == "rpf3d" and {"definitions", "units", "versions", "target"} <= facts.keys()
    for name, least in (("numerical", 5), ("geometric", 3), ("statistical", 3)):
        assert len(facts[name]) >= least
        for line in facts[name]:
            assert line.keys() >= LINE
            assert 0.0 <= line["error"] <= 1.0 and line["seconds_per_1000_rocks"] > 0.0
    methods = [line["setting"]["method"] for line in facts["numerical"]]
    assert methods[0] == "events" and "raster" in methods
    rasters = {line["setting"]["cell"] for line in facts["numerical"] if line["setting"]["method"] == "raster"}
    finest = raster_over(prepare(read_scene(scene)).terrain).cell
    assert finest != HAZARD_CELL and rasters == {finest, 4.0 * finest}, "as fine as the facets, not as the map"
    assert facts["scene"]["method"] == {"method": "stepping", "dt": 0.02, "threshold": 0.1, "squared": False}
    assert facts["scene"]["method"] in [line["setting"] for line in facts["numerical"]]
    errors = {(s.get("dt"), s.get("threshold")): line["error"] for line in facts["numerical"] if (s := line["setting"])}
    assert errors[0.1, 0.5] > errors[0.01, 0.05] > 0.0
    assert (out / "cost.png").read_bytes().startswith(b"\x89PNG")
    assert _entities(out / "cost.rrd") >= {"/picture", "/document", "/cost/events/points"}

    monkeypatch.setattr(measure, "doublings", None)  # measuring again would fail
    assert call(monkeypatch, "run", scene, "--out", out, "--accuracy", 0.3) == 0
    rocks = next(line["setting"]["rocks"] for line in facts["statistical"] if line["error"] <= 0.3)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["rocks"] == rocks
    assert summary["scene"]["method"] == "events", "an accuracy is bought by events, whatever the scene names"
    assert json.loads((out / "cost.json").read_text()) == facts, "a run leaves the price list where it is"


def _entities(path: Path) -> set[str]:
    """Return the entities of a recording, which must pass `rerun rrd verify`."""
    import rerun.chunk

    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and "verified without error" in done.stdout + done.stderr
    return {str(chunk.entity_path) for chunk in rerun.chunk.RrdReader(path).stream().to_chunks()}


def test_a_price_list_is_kept_for_the_same_scene_and_version_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, quick: None
) -> None:
    prices = measure.price_list(scene_file(tmp_path))
    folder = write_price_list(tmp_path / "out", prices, 0.1, recording=False)
    assert read_price_list(folder, prices.digest) == prices
    assert read_price_list(folder, "another") is None
    assert read_price_list(tmp_path / "nowhere", prices.digest) is None
    facts = json.loads((folder / "cost.json").read_text())
    facts["versions"]["rpf3d"] = "0.0.1"
    (folder / "cost.json").write_text(json.dumps(facts))
    assert read_price_list(folder, prices.digest) is None, "another version may fly otherwise"
    (folder / "cost.json").write_text('{"program": "rpf3d", "scene": {"digest": "other"}}')
    assert read_price_list(folder, prices.digest) is None


@pytest.mark.parametrize(("more", "rocks"), [("", 100), ("rocks: 5000", 5000), ("rocks: auto", 1000)])
def test_the_rocks_of_a_scene_are_those_that_a_run_of_it_flies(tmp_path: Path, more: str, rocks: int) -> None:
    scene = read_scene(scene_file(tmp_path, more=f"{more}\nengine: reference"))
    assert measure.rocks_of(scene, prepare(scene)) == rocks


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("cost", "SCENE", "--out", "OUT", "--target", "0"), "the accuracy is 0; it must be a number above 0"),
        (("run", "SCENE", "--out", "OUT", "--accuracy", "1.5"), "the accuracy is 1.5; it must be a number above 0"),
        (("run", "SCENE", "--out", "OUT", "--accuracy", "0.1", "--rocks", "5"), "--rocks and --accuracy both say"),
        (("cost", "SCENE", "--out", "SCENE"), "is a file; the results need the path of a folder"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: tuple, complaint: str
) -> None:
    places = {"SCENE": scene_file(tmp_path), "OUT": tmp_path / "out"}
    assert complaint in refused(monkeypatch, capsys, *(places.get(word, word) for word in words))
    assert not (tmp_path / "out").exists()


def test_cost_needs_the_compiled_engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from rpf3d_core.errors import InputError

    monkeypatch.setattr(measure, "HAS_NUMBA", False)
    with pytest.raises(InputError, match="needs numba"):
        measure.price_list(scene_file(tmp_path))


@pytest.mark.parametrize(
    ("method", "complaint"),
    [
        ("steps", "`method` is 'steps', but must be events, or a mapping {stepping: {dt, threshold, squared}}"),
        ("{}", "`method` is {}, but must be events, or a mapping"),
        ("{stepping: {dt: 0}}", "`method.stepping.dt` is 0, but must be a number from 1e-07 to 1 (s), the time step"),
        ("{stepping: {dt: 3}}", "`method.stepping.dt` is 3, but must be a number from 1e-07 to 1 (s), the time step"),
        ("{stepping: {threshold: 0}}", "`method.stepping.threshold` is 0, but must be a number above 0 (m)"),
        ("{stepping: {treshold: 1}}", "`method.stepping.treshold` is not a key of a scene; did you mean `threshold`?"),
        ("{stepping: {squared: 1}}", "`method.stepping.squared` is 1, but must be true or false"),
    ],
)
def test_a_method_that_is_none_is_refused_with_what_would_be_right(tmp_path: Path, method: str, complaint: str) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(scene_file(tmp_path, more=f"method: {method}"))
    assert complaint in str(caught.value)


def test_a_scene_flies_by_the_method_that_it_names(tmp_path: Path) -> None:
    exact = simulate(scene_file(tmp_path, "a.yaml", more="method: events"), rocks=20, engine="reference")
    plain = simulate(scene_file(tmp_path, "b.yaml"), rocks=20, engine="reference")
    steps = "method: {stepping: {dt: 0.01, threshold: 0.3}}"
    stepped = simulate(scene_file(tmp_path, "c.yaml", more=steps), rocks=20, engine="reference")
    assert (exact.flights.deposits.x == plain.flights.deposits.x).all()
    assert not (exact.flights.deposits.x == stepped.flights.deposits.x).all(axis=1).any()
    assert stepped.scene.method.describe() == "stepping (dt 0.01 s, threshold 0.3 m): inexact"


def test_chance_is_told_of_the_nearest_number_of_rocks() -> None:
    assert statistical.floor_of(5, [Sampled(10, 0.9, 0.9, 0.1, None, 1.0)]) == 1.0, "no two maps are further apart"
