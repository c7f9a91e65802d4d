"""Tests that runs over parameter sets count each set as if flown separately, with equal bits in both engines."""

import csv
import json
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rasterio
from scenes.small_pit import scene_file

import rpf3d_core as rpf3d
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.statistics import PERCENTILES
from rpf3d_core.hazard.layers import layers_of
from rpf3d_core.hazard.zones import upper_zones
from rpf3d_core.results.findings import Run
from rpf3d_core.results.notes import doubts_of_run
from rpf3d_core.results.overconfidence import surer_than_it_may_be
from rpf3d_core.results.summary import summary
from rpf3d_core.runs import over_sets
from rpf3d_core.runs.fly_scene import UNCONTROLLED, RunControl, fly_scene
from rpf3d_core.runs.parallel import fly_parts
from rpf3d_core.runs.run import replay
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.precompiler import Precompiler
from rpf3d_core.setup.prepared import empty_tallies, prepare, releases_in_ranges
from rpf3d_core.setup.rounds import AnyRound, EvenRound, Round
from rpf3d_core.setup.unknowns import sets_of_scene
from rpf3d_core.unknowns.dealing import set_of_rock
from rpf3d_core.unknowns.parameter_sets import parameter_sets, read_parameter_sets, write_parameter_sets
from rpf3d_core.values import Outcome

SETS, ROCKS = 40, 1200
PRIORS = """\
seed: 3
unknowns:
  sets: 40
  priors:
    materials.default.normal_restitution: {min: 0.3, max: 0.6}
    materials.*.tangential_restitution: {mean: 0.8, sd: 0.1, min: 0.6, max: 0.95}
"""


def scene_of(folder: Path, more: str = PRIORS) -> Any:
    return read_scene(scene_file(folder, more=more))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sets")


@pytest.fixture(scope="module")
def run(folder: Path) -> Run:
    return rpf3d.simulate(scene_of(folder), rocks=ROCKS, engine="compiled", threads=2)


def figures(run: Run) -> Any:
    return run.maps.sets


def rocks_by_set(run: Run) -> dict[int, list[int]]:
    """Return set -> rows of the deposits of the rocks that flew with the set."""
    found: dict[int, list[int]] = {}
    deposits = run.flights.deposits
    for row, (source, rock) in enumerate(zip(deposits.source.tolist(), deposits.rock.tolist(), strict=True)):
        found.setdefault(set_of_rock(rock, SETS, source), []).append(row)
    return found


def test_the_outcomes_and_stops_of_each_set_are_those_of_its_rocks(run: Run) -> None:
    deposits, sets = run.flights.deposits, figures(run)
    by_set = rocks_by_set(run)
    assert len(by_set) == SETS and sets.flown == SETS and run.totals.rocks == ROCKS == sum(map(len, by_set.values()))
    for number, rows in by_set.items():
        assert sets.rocks[number] == len(rows)
        assert sets.outcomes[number] == Counter(Outcome(outcome) for outcome in deposits.outcome[rows].tolist())
        speeds = np.percentile(deposits.max_speed[rows], PERCENTILES)
        np.testing.assert_allclose(sets.percentiles["max_speed"][number], speeds, rtol=1e-12)


@pytest.mark.parametrize("number", [0, 17, 39])
def test_a_set_counts_what_its_scene_alone_would(run: Run, number: int) -> None:
    """The scene with the values of the set is flown with the same rocks; places, energies and map cells must agree."""
    sets = figures(run)
    alone = prepare(with_values(run.scene, sets.sets.at(number)))
    tallies, deposits = empty_tallies(alone), run.flights.deposits
    rows = np.array(rocks_by_set(run)[number])
    mine = [np.sort(deposits.rock[rows[deposits.source[rows] == source]]) for source in range(2)]
    flights = fly_ensemble(alone.engine, alone.flight, releases_in_ranges(alone, mine), watch=tallies)
    order = np.lexsort((deposits.rock[rows], deposits.source[rows]))
    assert flights.deposits.x.tobytes() == deposits.x[rows[order]].tobytes()
    for places, tally in ((sets.zones, tallies.zones), (sets.areas, tallies.inside)):
        layers = layers_of(tally)
        reached, stopped, energy = (np.zeros(len(tally.slot)) for _ in range(3))
        reached[layers.cell], stopped[layers.cell] = layers.rocks, layers.deposits
        energy[:] = np.nan
        energy[layers.cell] = layers.energy.p95
        np.testing.assert_array_equal(places.reached[number], reached)
        np.testing.assert_array_equal(places.stopped[number], stopped)
        np.testing.assert_allclose(places.energy[number], energy, rtol=3e-3)  # a bin of a zone is 0.5 % wide
    cells = layers_of(tallies.squares)
    slots, counts = sets.cells[number]
    assert dict(zip(slots.tolist(), counts.tolist(), strict=True)) == dict(
        zip(cells.cell.tolist(), cells.rocks.tolist(), strict=True)
    )


def test_sets_add_up_to_the_maps(run: Run) -> None:
    zones, sets = run.maps.zones, figures(run)
    assert sets.zones.reached.sum(axis=0)[zones.cell].tolist() == zones.rocks.tolist()
    assert sets.zones.stopped.sum(axis=0)[zones.cell].tolist() == zones.deposits.tolist()
    cells = Counter[int]()
    for slots, counts in sets.cells:
        cells.update(dict(zip(slots.tolist(), counts.tolist(), strict=True)))
    assert [cells[cell] for cell in run.maps.cells.cell.tolist()] == run.maps.cells.rocks.tolist()


def facts_of(run: Run) -> str:
    """Return the summary as JSON, without times and the name of the engine."""
    facts = summary(run)
    for name in ("read_s", "index_s", "wall_s", "compile_s", "fly_s", "rocks_per_s", "engine"):
        facts.pop(name)
    facts["scene"].pop("digest")  # it has the name of the engine
    return json.dumps(facts, sort_keys=True)


@pytest.mark.parametrize(("engine", "threads"), [("compiled", 1), ("compiled", 5), ("reference", None)])
def test_engines_and_threads_give_the_same_bits(run: Run, engine: str, threads: int | None) -> None:
    other = rpf3d.simulate(run.scene, rocks=ROCKS, engine=engine, threads=threads)
    assert facts_of(other) == facts_of(run)
    assert other.flights.deposits.x.tobytes() == run.flights.deposits.x.tobytes()
    for mine, theirs in zip(run.maps.reach_band, other.maps.reach_band, strict=True):
        assert mine.tobytes() == theirs.tobytes()


def test_every_interval_of_a_share_holds_its_sampling_interval(run: Run) -> None:
    facts = summary(run)
    shares = [*facts["outcomes"].values()]
    for place in (*facts["benches"].values(), *facts["areas_of_interest"].values()):
        shares += [place["reached"], place["stopped"], place["retained"]]
    given = [share for share in shares if share["share"] is not None]
    assert all(share["interval_95"] == share["predictive"] for share in given)
    told = [share for share in given if share["predictive"] is not None]
    assert len(told) > 10
    for share in told:
        (low, high), (least, most) = share["predictive"], share["sampling"]
        assert low <= least <= share["share"] <= most <= high and share["interval_95"] == [low, high]
    wider = [share for share in told if share["predictive"] != share["sampling"]]
    assert len(wider) > 5, "the restitution decides how many rocks reach the lower benches"


def test_the_band_of_a_map_holds_its_values(run: Run) -> None:
    share = run.maps.cells.rocks / run.maps.flown
    assert (run.maps.reach_band.low <= share).all() and (share <= run.maps.reach_band.high).all()


def test_a_cell_whose_upper_end_is_not_known_is_in_every_upper_zone(run: Run) -> None:
    band = run.maps.reach_band
    unknown = replace(run.maps, reach_band=band._replace(high=np.full(len(band.high), np.nan)))
    (zone,) = upper_zones(unknown, [0.99])
    assert np.flatnonzero(zone.cells).tolist() == band.cell.tolist()


def test_with_rocks_of_few_sets_no_share_has_a_predictive_interval(run: Run) -> None:
    few = rpf3d.simulate(run.scene, rocks=20, engine="reference")
    facts = summary(few)
    shares = [place["reached"] for place in facts["benches"].values()]
    assert shares and all(share["predictive"] is None and share["interval_95"] is None for share in shares)
    assert any("predictive intervals are not known" in sentence for sentence in surer_than_it_may_be(few))


def test_a_rock_flies_again_with_its_own_set(run: Run) -> None:
    deposits = run.flights.deposits
    for row in (0, 500, 1100):
        again = replay(run.scene, int(deposits.source[row]), int(deposits.rock[row]))
        assert again.flights.deposits.x.tobytes() == deposits.x[row : row + 1].tobytes()


def test_more_rocks_keep_the_set_of_the_first(run: Run) -> None:
    """The parameter set of a rock does not depend on the number of rocks."""
    fewer = rpf3d.simulate(run.scene, rocks=ROCKS // 2, engine="compiled")
    ends = ends_of(run)
    assert all(ends[rock] == x for rock, x in ends_of(fewer).items())


def ends_of(run: Run) -> dict[tuple[int, int], list[float]]:
    """Return (source, rock) -> place (3,) m at which the rock ended."""
    deposits = run.flights.deposits
    rocks = zip(deposits.source.tolist(), deposits.rock.tolist(), strict=True)
    return dict(zip(rocks, deposits.x.tolist(), strict=True))


def test_parts_are_refused(run: Run) -> None:
    with ThreadPoolExecutor(1) as pool, pytest.raises(rpf3d.InputError, match="unknowns cannot be flown in parts"):
        fly_parts(run.scene, 2, pool)


def test_a_result_has_both_intervals_in_all_its_files(run: Run, tmp_path: Path) -> None:
    folder = rpf3d.write_run(run, tmp_path / "out", recording=False)
    facts = json.loads((folder / "summary.json").read_text())
    with (folder / "hazard" / "benches.csv").open(newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file) if row["kind"] == "zone"}
    for name, bench in facts["benches"].items():
        share, row = bench["reached"], rows[name]
        assert [float(row["reached_low"]), float(row["reached_high"])] == share["predictive"]
        assert [float(row["reached_sampling_low"]), float(row["reached_sampling_high"])] == share["sampling"]
    low, value, high = (band(folder / "hazard" / f"reach_probability{end}.tif") for end in ("_low", "", "_high"))
    assert (low <= value).all() and (value <= high).all() and (low < high).any()
    levels = json.loads((folder / "hazard" / "zones.geojson").read_text())["features"]
    area = {
        (each["properties"]["kind"], each["properties"].get("level")): each["properties"]["cells"] for each in levels
    }
    pairs = [(area[kind, level], area["reach_probability", level]) for kind, level in area
             if kind == "reach_probability_upper" and ("reach_probability", level) in area]  # fmt: skip
    assert pairs and all(upper >= cells for upper, cells in pairs)
    sets = read_parameter_sets(folder / "parameter_sets.parquet")
    assert sets.values.tobytes() == figures(run).sets.values.tobytes() and sets.weights is None
    assert facts["unknowns"]["sets_flown"] == SETS
    speed, names = facts["max_speed_m_s"], {f"p{p}" for p in PERCENTILES}
    assert set(speed["predictive"]) == set(speed["sampling"]) == names


def band(path: Path) -> Any:
    """Return the first band of a GeoTIFF."""
    with rasterio.open(path) as file:
        return file.read(1)


def test_a_sample_keeps_its_rows_together_in_proportion_to_their_weights(folder: Path) -> None:
    names = ("materials.default.normal_restitution", "materials.default.tangential_restitution")
    rows = np.array([[0.3, 0.6], [0.4, 0.7], [0.5, 0.8]])
    write_parameter_sets(folder / "sample.parquet", parameter_sets(names, rows, [1, 2, 5]))
    priors = "{materials.default.friction_angle_deg: {min: 20, max: 40}}"
    more = f"unknowns: {{sets: 64, sample: sample.parquet, priors: {priors}}}\n"
    sets = sets_of_scene(read_scene(scene_file(folder, "sampled.yaml", more=more)))
    assert sets.names == (*names, "materials.default.friction_angle_deg") and sets.weights is None
    found = Counter(map(tuple, sets.values[:, :2].tolist()))
    assert [found[tuple(row)] for row in rows.tolist()] == [8, 16, 40]
    assert 20 <= sets.values[:, 2].min() < 21 and 39 < sets.values[:, 2].max() <= 40


@pytest.mark.long
def test_the_books_leave_open_whether_the_berm_of_one_bench_holds() -> None:
    """Single book values give shares from 39 to 99 %, so the predictive interval must contain these."""
    scene = read_scene(Path(__file__).parents[2] / "config" / "scenes" / "bench_15m.yaml")
    low, high = summary(rpf3d.simulate(scene))["benches"]["berm"]["retained"]["predictive"]
    assert low <= 0.39 and high >= 0.99
    single = {"materials.default.tangential_restitution": 0.85, "effects.roughness.angle_sd_deg": 5.0}
    held = [
        summary(rpf3d.simulate(with_values(scene, {**single, "materials.default.normal_restitution": R_n}), rocks=2000))
        ["benches"]["berm"]["retained"]["share"] for R_n in (0.30, 0.50)
    ]  # fmt: skip
    assert held[0] > 0.9 and held[1] < 0.5


def test_a_stopped_run_of_many_rocks_has_flown_rocks_of_all_sets(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run in laps of 6 rocks per set that is stopped in its third lap is compared with the complete run."""
    monkeypatch.setattr(over_sets, "LAP", 6)
    flown: list[int] = []

    def flies(control: RunControl) -> Run:
        prepared = prepare(with_choices(scene_of(folder), ROCKS, "compiled", None))
        return fly_scene(prepared, Precompiler(), None, control=control)

    def stopped() -> bool:
        flown.append(1)
        return len(flown) > 2.5 * 2 * SETS  # called before each set and before its batch

    part = flies(RunControl(stop=stopped))
    assert "parameter sets with 12 to 19 rocks each" in " ".join(doubts_of_run(part))
    assert "parameter sets with" not in " ".join(doubts_of_run(run))
    assert figures(part).rocks.min() >= 6 and part.totals.rocks < ROCKS == part.planned
    whole = flies(UNCONTROLLED)
    np.testing.assert_array_equal(figures(whole).rocks, figures(run).rocks)
    np.testing.assert_array_equal(whole.maps.cells.energy.p95, run.maps.cells.energy.p95)
    np.testing.assert_array_equal(whole.maps.reach_band.high, run.maps.reach_band.high)
    assert summary(whole)["outcomes"] == summary(run)["outcomes"]


@pytest.mark.parametrize("each", [Round([0, 5], [1001, 17]), EvenRound([np.arange(1001)[::-1], np.arange(5, 17)])])
def test_laps_grow_up_to_a_bound_and_hold_each_rock_once(each: AnyRound) -> None:
    laps = list(each.laps(100, 150))
    sizes = np.array([lap.rocks for lap in laps])
    assert np.abs(sizes - [100, 100, 100, 100, 100, 125, 150, 150, 88]).max() <= 1 and sizes.sum() == each.rocks
    assert [lap.rocks for lap in each.laps(5000, 250)] == [each.rocks], "a first lap may be longer than the bound"
    for source in range(2):
        rocks = [rock for lap in laps for dealt in lap.dealt(3) for rock in dealt[source].tolist()]
        want = [rock for dealt in each.dealt(3) for rock in dealt[source].tolist()]
        assert sorted(rocks) == sorted(want)


@pytest.mark.parametrize("rocks", [20_000, 60_000, 300_000])
def test_sets_have_about_the_same_number_of_rocks_wherever_a_run_is_stopped(rocks: int) -> None:
    """A set that is one lap ahead has more weight in the figures: at most 2:1 in lap 2, less in later laps."""
    sets, flown, ratios = 8, np.zeros(8), []
    for lap in Round([0, 0], [rocks, rocks // 3]).laps(over_sets.LAP * sets, over_sets.MOST_IN_LAP):
        for number, dealt in enumerate(lap.dealt(sets)):
            flown[number] += sum(map(len, dealt))
            if flown.min() > 0.0:
                ratios.append((flown.max() / flown.min(), flown.sum()))
    first = over_sets.LAP * sets
    assert max(ratio for ratio, _ in ratios) < 2.02
    assert max((ratio for ratio, done in ratios if done > 2.01 * first), default=1.0) < 1.52
    assert max((ratio for ratio, done in ratios if done > 4.01 * first), default=1.0) < 1.27


def test_a_hundred_million_rocks_take_few_laps_and_empty_parts_are_not_kept() -> None:
    laps = Round([0], [10**8]).laps(over_sets.LAP * 64, over_sets.MOST_IN_LAP)
    assert len([lap.rocks for lap in laps]) == 43
    gathered = over_sets.Gathered(lambda deposits, impacts: None)
    gathered(SimpleNamespace(rock=np.empty(0)), None)
    assert gathered.parts == []
