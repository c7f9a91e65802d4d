"""Tests of a calibration from scene to files: output, refusals, continuation, and equal engines."""

import json
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from campaigns.recovery import BLOCKS, MIDDLE, known_scene
from typer.testing import CliRunner

from rpf3d_core.calibration import verdict
from rpf3d_core.calibration.calibrate import LEAST_BUDGET_S, calibrate, deadline_after
from rpf3d_core.calibration.flying import fly_set, releases_of_round, slope_of
from rpf3d_core.calibration.rounds import Control
from rpf3d_core.cli import app
from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare, releases_in_ranges
from rpf3d_core.unknowns.parameter_sets import read_parameter_sets

pytestmark = pytest.mark.skipif(not HAS_NUMBA, reason="hundreds of parameter sets need the compiled engine")

FILES = {
    "calibration.json", "calibrated.yaml", "posterior.parquet", "report.md", "posterior.png", "predicted.png",
    "coverage.png", "state",
}  # fmt: skip
SEED = 3
BERM = "areas_of_interest:\n  - {name: berm, polygons: [[45, -3], [52.5, -3], [52.5, 3], [45, 3]]}\n"
COUNTS = """\
  shares: [{place: berm, stopped: 9, of: 20}, {place: berm, reached: 15, of: 20}]
  gates: [{name: road, at: 52, passed: 10, of: 20}]
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    """Return the path of a scene with observed stops, and the true values with which these were simulated."""
    return known_scene(tmp_path_factory.mktemp("site"), SEED, MIDDLE)


@pytest.fixture(scope="module")
def done(site: tuple[Path, dict[str, float]]) -> Path:
    """Return the result folder of a finished calibration of `site`."""
    out = site[0].parent / "results" / "out"
    result = CliRunner().invoke(app, ["calibrate", str(site[0]), "--out", str(out), "--budget", "400"])
    assert result.exit_code == 0, result.output
    return out


def content(out: Path) -> dict:
    return json.loads((out / "calibration.json").read_text())


def test_all_files_are_written(done: Path) -> None:
    assert {path.name for path in done.iterdir()} == FILES


def test_the_keys_of_calibration_json(done: Path) -> None:
    found = content(done)
    keys = "parameters correlation effective_samples noise score gain coverage verdict warnings"
    assert list(found) == keys.split()
    assert set(found["score"]) == {"held_out", "prior", "book", "curve"}
    assert found["score"]["book"] is None  # the scene has no book values
    for one in found["parameters"].values():
        assert set(one) == {"prior", "mean", "low", "high", "shrinkage"}
        assert one["low"] < one["mean"] < one["high"]
    assert found["gain"]["over_curve"] == pytest.approx(found["score"]["held_out"] - found["score"]["curve"])
    assert found["gain"]["standard_error"] > 0.0
    assert found["coverage"]["blocks"] == BLOCKS
    assert set(found["coverage"]["with_misfit"]) == {"50", "90", "misfit"}


def test_the_true_values_are_found_and_only_their_combination(done: Path, site: tuple[Path, dict[str, float]]) -> None:
    found = content(done)
    for name, value in site[1].items():
        assert found["parameters"][name]["low"] < value < found["parameters"][name]["high"]
    first, second = site[1]
    assert found["correlation"][first][second] < -0.8
    assert "only a combination of them is determined" in found["verdict"]
    assert found["effective_samples"] > 50
    assert found["score"]["held_out"] > found["score"]["prior"]


def test_the_posterior_is_a_sample_in_the_units_of_the_scene(done: Path, site: tuple[Path, dict[str, float]]) -> None:
    sample, found = read_parameter_sets(done / "posterior.parquet"), content(done)
    assert sample.names == tuple(site[1])
    means = [one["mean"] for one in found["parameters"].values()]
    np.testing.assert_allclose(sample.values.mean(axis=0), means, atol=0.01)


def test_the_posterior_knows_where_its_slope_is(done: Path, site: tuple[Path, dict[str, float]]) -> None:
    scene = read_scene(site[0])
    prepared = prepare(scene)
    releases = releases_in_ranges(prepared, [range(3) for _ in prepared.sources]).x + prepared.terrain.frame.origin
    stops = read_points(scene.observed.points_file, "z")
    place = read_parameter_sets(done / "posterior.parquet").place
    assert place is not None
    for points in (releases[:, :2], stops[:, :2]):
        assert (points >= np.array([place.west, place.south]) - 1.0).all()  # each round has other releases
        assert (points <= np.array([place.east, place.north]) + 1.0).all()
    both = np.concatenate([releases, stops])[:, :2]
    np.testing.assert_allclose([place.west, place.south], both.min(axis=0), atol=1.0)
    np.testing.assert_allclose([place.east, place.north], both.max(axis=0), atol=1.0)


def test_the_calibrated_scene_flies_from_any_folder(
    done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = read_scene(done / "calibrated.yaml")
    assert scene.has_unknowns
    sample = read_parameter_sets(done / "posterior.parquet")
    assert scene.unknowns.sets == len(sample) >= 50
    assert scene.rocks >= 100 * len(sample)  # the total over all sets
    result = CliRunner().invoke(app, ["run", str(done / "calibrated.yaml"), "--out", "flown", "--rocks", "2000"])
    assert result.exit_code == 0, result.output
    assert "predictive" in result.output


def test_an_interrupted_calibration_continues_to_the_same_bits(done: Path, site: tuple[Path, dict[str, float]]) -> None:
    out, calls = site[0].parent / "interrupted", [0]

    def stop() -> bool:
        calls[0] += 1
        return calls[0] > 150

    cut = calibrate(site[0], out, Control(deadline=deadline_after(400), stop=stop, threads=1))
    assert cut.found is None
    assert 0 < cut.sets < 200
    assert not (out / "calibration.json").exists()
    calibrate(site[0], out, Control(deadline=deadline_after(400), threads=2))
    assert (out / "calibration.json").read_bytes() == (done / "calibration.json").read_bytes()
    assert (out / "posterior.parquet").read_bytes() == (done / "posterior.parquet").read_bytes()


def test_too_few_effective_samples_are_refused(
    done: Path, site: tuple[Path, dict[str, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = site[0].parent / "refused"
    shutil.copytree(done, out)
    monkeypatch.setattr(verdict, "FLOOR", 1e6)
    result = CliRunner().invoke(app, ["calibrate", str(site[0]), "--out", str(out), "--budget", "400"])
    assert result.exit_code == 1
    assert {path.name for path in out.iterdir()} == {"calibration.json", "report.md", "state"}
    assert content(out)["verdict"].startswith("refused: ")
    assert "What would help" in result.output.replace("\n", " ")
    assert (out / "report.md").read_text().splitlines()[1].startswith("**Refused**")


def test_a_refused_calibration_shows_no_number_that_could_be_a_result(
    done: Path, site: tuple[Path, dict[str, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    out, known = site[0].parent / "numberless", content(done)
    shutil.copytree(done, out)
    monkeypatch.setattr(verdict, "FLOOR", 1e6)
    printed = CliRunner().invoke(app, ["calibrate", str(site[0]), "--out", str(out), "--budget", "400"]).output
    refused = content(out)
    assert list(refused) == list(known)
    for name, one in refused["parameters"].items():
        assert list(one) == list(known["parameters"][name])
        assert one["prior"] == known["parameters"][name]["prior"]
        assert one["mean"] is one["low"] is one["high"] is one["shrinkage"] is None
    assert set(refused["score"].values()) == {None}
    assert {value for row in refused["correlation"].values() for value in row.values()} == {None}
    assert refused["gain"] is refused["coverage"] is None
    report = (out / "report.md").read_text()
    for text in (printed, report):
        for one in known["parameters"].values():
            assert f"{one['mean']:.3g}" not in text
        assert f"{known['score']['held_out']:.2f}" not in text
        assert "intervals hold" not in text
    assert "rpf3d: refused: " in printed.replace("\n", " ")
    assert "note: refused" not in printed.replace("\n", " ")


@pytest.mark.long
def test_a_budget_is_kept_and_its_sets_are_used(done: Path, site: tuple[Path, dict[str, float]]) -> None:
    """`done` has compiled all loops before; this may take longer than the budget."""
    path = site[0].parent / "many_rocks.yaml"
    path.write_text(site[0].read_text().replace("rocks: 400", "rocks: 20000"))
    began = time.monotonic()
    short = calibrate(path, site[0].parent / "short", Control(deadline=deadline_after(50)))
    assert time.monotonic() - began < 50
    assert short.found is not None
    assert 0 < short.sets == short.found.sets < 620  # not all rounds


def test_both_engines_give_the_same_bits(site: tuple[Path, dict[str, float]]) -> None:
    data = "calibration:\n" + COUNTS
    text = site[0].read_text().replace("rocks: 400", "rocks: 64").replace("calibration:\n", BERM + data)
    flown = []
    for engine in ("compiled", "reference"):
        path = site[0].parent / f"{engine}.yaml"
        path.write_text(text.replace("engine: compiled", f"engine: {engine}"))
        slope = slope_of(read_scene(path))
        flown.append(fly_set(slope, [0.35, 0.8], releases_of_round(slope, 0)))
    assert flown[0].stops.place.tobytes() == flown[1].stops.place.tobytes()
    assert flown[0].densities.tobytes() == flown[1].densities.tobytes()
    counts = flown[0].densities[:, -1, BLOCKS:].mean(axis=0)  # three counts, with the largest misfit
    assert ((counts > 0.0) & (counts < 1.0)).all()
    np.testing.assert_allclose(counts.reshape(3, 2).sum(axis=1), 1.0)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("  unknowns:", "  shares: [{place: nowhere, stopped: 1, of: 2}]\n  unknowns:", "neither an area of interest"),
        ("  rocks: 400", "  rocks: 400\n  book: {materials.gravel.friction: 1}", "`gravel` is not one of default"),
        ("observed: {points_file: stops.csv, along: [1, 0, 0]}", "", "nothing to calibrate on"),
        ("  rocks: 400", "  mass_column: 4", "column 4: `calibration.mass_column` must be a number above 0"),
    ],
)  # fmt: skip
def test_what_is_refused_before_a_rock_flies(
    site: tuple[Path, dict[str, float]], before: str, after: str, message: str
) -> None:
    path, out = site[0].parent / "wrong.yaml", site[0].parent / "wrong"
    assert before in site[0].read_text()
    path.write_text(site[0].read_text().replace(before, after))
    with pytest.raises(InputError, match=message):
        calibrate(path, out, Control(deadline=deadline_after(60)))
    assert not out.exists()


def test_a_folder_of_another_calibration_is_refused(done: Path, site: tuple[Path, dict[str, float]]) -> None:
    other = site[0].parent / "other.yaml"
    other.write_text(site[0].read_text().replace("rocks: 400", "rocks: 401"))
    with pytest.raises(InputError, match="the calibration of another scene"):
        calibrate(other, done, Control(deadline=deadline_after(60)))
    with pytest.raises(InputError, match="not part of a calibration"):
        calibrate(site[0], site[0].parent, Control(deadline=deadline_after(60)))


def test_a_budget_without_a_flight_says_what_took_it_and_what_would_do(site: tuple[Path, dict[str, float]]) -> None:
    with pytest.raises(InputError, match=r"reading took .* compiling .* at least --budget \d+") as fault:
        calibrate(site[0], site[0].parent / "no_time", Control(deadline=time.monotonic()))
    assert int(str(fault.value).split()[-1]) >= LEAST_BUDGET_S


@pytest.mark.parametrize("budget", [0.0, 5.0, -5.0, float("nan"), float("inf")])
def test_a_budget_that_is_no_time_is_refused(budget: float) -> None:
    with pytest.raises(InputError, match="--budget"):
        deadline_after(budget)
