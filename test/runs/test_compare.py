"""Tests of the comparison of two results: significant differences, partial runs, and folders that are not results."""

import json

import pytest
from programs.command_line import rpf3d as command
from scenes.small_pit import scene_file

import rpf3d_core as rpf3d
from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.ensemble.two_shares import newcombe_interval
from rpf3d_core.errors import InputError
from rpf3d_core.results.earlier_results import read_summary, stops_by_zone
from rpf3d_core.results.summary import summary
from rpf3d_core.runs.compare import Counted, compare_runs, compare_summaries, comparison_section
from rpf3d_core.runs.compare_tables import decimals_for, lines_of, markdown_of, percent, points, share_rows


def place(reached, stopped, rocks, energy=1000.0):
    return {
        "reached": share_of(reached, rocks),
        "stopped": share_of(stopped, rocks),
        "retained": share_of(stopped, reached),
        "energy_p95_j": energy,
    }


def told(rocks=1000, seed=1, digest="a", zones=None, areas=None, planned=None, program="rpf3d"):
    """Return a summary with the values that a comparison reads.

    zones, areas : name -> (rocks that reached it, rocks that stopped); planned : rocks planned if the run is partial
    """
    zones = {"bench_1": (900, 300)} if zones is None else zones
    return {
        "program": program,
        "scene": {"file": "pit.yaml", "digest": digest, "seed": seed},
        "terrain": {"triangles": 12},
        "rocks": rocks,
        "rocks_planned": planned or rocks,
        "partial": planned is not None,
        "benches": {name: place(*counts, rocks) for name, counts in zones.items()},
        "areas_of_interest": {name: place(*counts, rocks) for name, counts in (areas or {}).items()},
        "hazard": {"percentiles_within": 0.05},
    }


def result(folder, facts):
    folder.mkdir()
    (folder / "summary.json").write_text(json.dumps(facts))
    return folder


def row_of(comparison, place, measure):
    return next(row for row in comparison.differences if (row.place, row.measure) == (place, measure))


def test_each_share_stands_beside_the_other_with_the_difference_b_less_a():
    compared = compare_summaries(told(), told(2000, zones={"bench_1": (1700, 700)}))
    assert [row.measure for row in compared.differences] == ["reached", "stopped", "retained"]
    stopped = row_of(compared, "bench_1", "stopped")
    assert (stopped.a, stopped.b) == (Counted(300, 1000), Counted(700, 2000))
    assert stopped.change == pytest.approx(0.05) and stopped.significant
    assert stopped.interval == newcombe_interval(700, 2000, 300, 1000)
    assert row_of(compared, "bench_1", "retained").a == Counted(300, 900), "of those that reached it"


def test_both_shares_have_the_same_decimals():
    """The shares are 1 of 6,400 and 1 of 2,000 rocks; 0.05 % must not be printed as 0.0 % next to 0.02 %."""
    compared = compare_summaries(told(6400, zones={"pit": (1, 0)}), told(2000, zones={"pit": (1, 0)}))
    row = next(row for row in share_rows(compared) if row[1] == "reached")
    assert row[2].startswith("0.02 % (") and row[3].startswith("0.05 % (") and row[4].startswith("+0.03 (")


def test_rocks_that_barriers_caught_are_compared_and_said_to_count_as_stopped():
    with_fence = {**told(seed=2), "outcomes": {"caught": share_of(110, 1000)}}
    compared = compare_summaries(told(), with_fence)
    row = row_of(compared, "all rocks", "caught")
    assert (row.a, row.b) == (Counted(0, 1000), Counted(110, 1000)) and row.significant
    assert share_rows(compared)[-1][:2] == ("all rocks", "caught")
    assert next(note for note in compared.notes if "rocks that barriers caught count" in note).startswith("B: ")
    assert not any("caught" in note for note in compare_summaries(told(), told()).notes)


def test_a_run_does_not_differ_from_itself():
    compared = compare_summaries(told(), told())
    assert not any(row.significant or row.p_holm < 1.0 for row in compared.differences)
    assert any("the same scene with the same seed" in note for note in compared.notes)


@pytest.mark.long
def test_rocks_start_alike_where_seed_and_sources_are_the_same_and_nowhere_else(tmp_path):
    def facts(name, more="", R_n=0.5, rocks=30, seed=1):
        return summary(rpf3d.simulate(scene_file(tmp_path, name, R_n=R_n, more=more), rocks, seed=seed))

    def alike(a, b):
        return [note.split(":")[0] for note in compare_summaries(a, b).notes if "start alike" in note]

    one = facts("one.yaml")
    assert alike(one, facts("one.yaml")) == ["these are the same scene with the same seed"]
    for other in (facts("other.yaml", R_n=0.4), facts("more.yaml", rocks=40)):
        assert alike(one, other) == ["these are runs from the same sources with the same seed"]
    lighter = facts("lighter.yaml", "rock: {mass: 3}")
    assert alike(one, lighter) == alike(one, facts("one.yaml", seed=2)) == []
    assert alike(told(digest="a"), told(digest="b")) == [], "an older summary does not say what its sources are"


def test_p95_energies_are_not_said_to_be_surer_than_they_are():
    (note,) = [note for note in compare_summaries(told(), told()).notes if "p95" in note]
    assert "have no interval" in note and "chance can make a difference" in note


def test_with_few_rocks_a_large_difference_is_none():
    few = [told(21, zones={"ramp": (hits, hits)}) for hits in (12, 8)]  # the thesis' ramp, 57 and 38 %
    many = [told(2100, zones={"ramp": (hits, hits)}) for hits in (1200, 800)]
    assert not row_of(compare_summaries(*few), "ramp", "stopped").significant
    assert row_of(compare_summaries(*many), "ramp", "stopped").significant


def test_a_difference_that_only_many_comparisons_explain_is_marked_as_standing_alone():
    zones = {f"bench_{k}": (500, 250) for k in range(20)}
    compared = compare_summaries(told(zones=zones), told(zones={**zones, "bench_3": (500, 295)}))
    stopped = row_of(compared, "bench_3", "stopped")
    assert stopped.significant and stopped.p < 0.05 < stopped.p_holm
    cells = next(cells for cells in share_rows(compared) if cells[:2] == ("bench_3", "stopped"))
    assert cells[-1] == "alone"
    assert any("would be, by chance" in note and "Holm" in note for note in compared.notes)


def test_areas_of_interest_are_compared_and_told_from_zones_of_the_same_name():
    compared = compare_summaries(told(areas={"bench_1": (10, 5)}), told(areas={"bench_1": (90, 5)}))
    assert {(row.kind, row.place) for row in compared.differences} == {("zone", "bench_1"), ("area", "bench_1")}
    assert any("bench_1 (area)" in cells for cells in share_rows(compared))


def test_places_of_one_run_only_are_listed_and_not_compared():
    compared = compare_summaries(told(zones={"a": (5, 5), "both": (5, 5)}), told(zones={"both": (5, 5), "b": (5, 5)}))
    assert {row.place for row in compared.differences} == {"both"}
    assert {"only in A: a", "only in B: b"} <= set(lines_of(compared))
    section = comparison_section(compared)
    assert (section["only_in_a"], section["only_in_b"]) == (["a"], ["b"])


def test_places_that_no_rock_came_to_are_left_out_and_retained_needs_rocks_in_both():
    zones = [{"nowhere": (0, 0), "once": (0, 0)}, {"nowhere": (0, 0), "once": (4, 1)}]
    compared = compare_summaries(*(told(zones=some) for some in zones))
    assert [(row.place, row.measure) for row in compared.differences] == [("once", "reached"), ("once", "stopped")]


def test_a_partial_run_is_called_one():
    compared = compare_summaries(told(), told(400, zones={"bench_1": (300, 90)}, planned=1000))
    assert "B is partial: 400 of 1,000 rocks have flown" in compared.notes
    assert not any(note.startswith("A is partial") for note in compared.notes)


def test_pieces_that_count_as_rocks_are_told_of_the_run_that_has_them():
    compared = compare_summaries(told(), {**told(), "pieces": 600})
    (note,) = [note for note in compared.notes if "pieces" in note]
    assert note.startswith("of B, 600 of 1,000 rocks are pieces of the other 400: shares and reach probability are ")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "has no summary.json"),
        ("{", "is damaged"),
        ("[]", "is not the summary of a run"),
        (json.dumps({"program": "other"}), "is not the summary of a run"),
        (json.dumps({"program": "rpf3d", "scene": {}, "rocks": 1}), "has no `rocks_planned`; another version"),
        (json.dumps(told(0, zones={})), "has flown no rock"),
    ],
)
def test_what_is_no_result_is_refused_by_name(tmp_path, content, sentence):
    good, bad = result(tmp_path / "good", told()), tmp_path / "bad"
    bad.mkdir()
    if content is not None:
        (bad / "summary.json").write_text(content)
    for folders in ((good, bad), (bad, good)):
        with pytest.raises(InputError, match=f"bad.*{sentence}"):
            compare_runs(*folders)


def test_runs_with_other_seeds_do_not_differ_and_softer_ground_does(tmp_path):
    runs = [
        rpf3d.simulate(scene_file(tmp_path, R_n=R_n, R_t=R_t), rocks=400, seed=seed)
        for R_n, R_t, seed in ((0.5, 0.8, 1), (0.5, 0.8, 2), (0.3, 0.5, 3))
    ]
    one, again, soft = (summary(run) for run in runs)
    assert all(row.p_holm > 0.05 for row in compare_summaries(one, again).differences)
    changed = row_of(compare_summaries(one, soft), "floor", "reached")
    assert changed.significant and changed.change < 0.0 and changed.p_holm < 0.05


def test_the_command_prints_tables_or_json_and_refuses_what_is_no_result(tmp_path):
    a = result(tmp_path / "a", told())
    b = result(tmp_path / "b", told(2000, zones={"bench_1": (1700, 700)}, seed=2))
    done = command("compare", a, b)
    assert done.returncode == 0, done.stderr
    assert "bench_1  stopped   30.0 % (27.2 to 33.0)  35.0 % (32.9 to 37.2)" in done.stdout
    parsed = json.loads(command("compare", "--json", a, b).stdout)
    assert parsed["differences"][1]["difference"] == pytest.approx(0.05)
    assert parsed["energy_p95_j"] == [{"kind": "zone", "place": "bench_1", "a": 1000.0, "b": 1000.0}]
    refused = command("compare", a, tmp_path)
    assert refused.returncode == 2 and "summary.json" in refused.stderr and "Traceback" not in refused.stderr


def test_markdown_holds_every_row():
    compared = compare_summaries(told(), told(zones={"bench_1": (850, 310)}))
    text = markdown_of(compared)
    assert text.count("| bench_1 |") == 4 and "| bench_1 | 1 | 1 | 1.00 |" in text


@pytest.mark.parametrize(("width", "decimals"), [(0.4, 1), (0.003, 1), (0.0006, 2), (0.00004, 3), (0.0, 4)])
def test_shares_have_as_many_decimals_as_their_intervals_ask_for(width, decimals):
    assert decimals_for(width) == decimals


def test_shares_and_differences_are_told_in_per_cent_and_points():
    assert percent(Counted(300, 1000)) == "30.0 % (27.2 to 33.0)"
    assert points(0.05, (0.012, 0.088)) == "+5.0 (+1.2 to +8.8)"


def test_rocks_that_stopped_are_read_with_zone_and_height(tmp_path):
    run = rpf3d.simulate(scene_file(tmp_path), rocks=40)
    folder = rpf3d.write_run(run, tmp_path / "out", recording=False)
    stops = list(stops_by_zone(folder))
    told = json.loads((folder / "summary.json").read_text())["stopped_in_zones"]
    assert {zone: sum(z == zone for z, _ in stops) for zone in told} == {z: s["rocks"] for z, s in told.items()}
    assert all(-1.0 < altitude < 80.0 for _, altitude in stops)


def test_a_damaged_table_of_deposits_is_refused(tmp_path):
    (tmp_path / "deposits.csv").write_text("outcome,zone\nstopped,face\n")
    with pytest.raises(InputError, match=r"deposits.csv: is damaged"):
        list(stops_by_zone(tmp_path))
    with pytest.raises(InputError, match="cannot be read"):
        list(stops_by_zone(tmp_path / "nowhere"))


def test_a_folder_that_does_not_exist_and_one_of_a_sweep_are_named_as_such(tmp_path):
    with pytest.raises(InputError, match="nix: does not exist; give a folder that `rpf3d run` wrote"):
        read_summary(tmp_path / "nix")
    (tmp_path / "out" / "cells").mkdir(parents=True)
    result(tmp_path / "out" / "cells" / "5ee914f6", told())
    with pytest.raises(InputError, match=r"out: is a sweep: give one of its cells, such as .*5ee914f6; sweep"):
        read_summary(tmp_path / "out")
