"""Tests that scenes flown in parts by threads, processes or a Dask cluster always give the same bits."""

import json
import multiprocessing
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from scenes.small_pit import scene_file

import rpf3d_core as rpf3d
from rpf3d_core.ensemble import samples
from rpf3d_core.errors import InputError
from rpf3d_core.results.summary import summary
from rpf3d_core.runs import parallel as study_module
from rpf3d_core.runs.parallel import Resources, fly_part, fly_parts, merged, study
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.setup.rounds import Round, rounds_of_parts

PARTS = 8
TIMES = ("read_s", "index_s", "wall_s", "compile_s", "fly_s", "rocks_per_s")
DISTRIBUTIONS = ("runout", "max_speed", "max_energy", "max_height", "ground_speed")


@pytest.fixture
def scene(tmp_path):
    return scene_file(tmp_path)


def processes(workers=2):
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))


def arrays(maps):
    for kind in ("cells", "facets", "zones", "areas"):
        for name, value in vars(getattr(maps, kind)).items():
            parts = vars(value) if hasattr(value, "p95") else {"": value}
            yield from ((f"{kind}.{name}.{part}", array) for part, array in parts.items())


def assert_same_bits(run, other):
    """Assert that maps, totals and distributions of two runs are equal to the last bit."""
    for (name, one), (_, two) in zip(arrays(run.maps), arrays(other.maps), strict=True):
        assert np.array_equal(one, two, equal_nan=True), name
    assert run.maps.flown == other.maps.flown == run.totals.rocks > 0
    for name in ("outcomes", "impacts", "path", "rocks"):
        assert getattr(run.totals, name) == getattr(other.totals, name), name
    for name in DISTRIBUTIONS:
        for one, two in zip(getattr(run.totals, name).sorted(), getattr(other.totals, name).sorted(), strict=True):
            assert np.array_equal(one, two), name


def facts(run):
    return {name: value for name, value in summary(run).items() if name not in TIMES}


def test_eight_parts_in_processes_are_the_same_bits_as_one_run(scene):
    with processes() as pool:
        parts = fly_parts(scene, PARTS, pool)
    whole = rpf3d.simulate(scene)
    assert_same_bits(parts, whole)
    assert facts(parts) == facts(whole)


@pytest.mark.long
@pytest.mark.parametrize("engine", ["reference", "compiled"])
def test_eight_parts_on_threads_are_the_same_bits_as_one_run(scene, engine):
    with ThreadPoolExecutor(3) as pool:
        assert_same_bits(fly_parts(scene, PARTS, pool, engine=engine), rpf3d.simulate(scene, engine=engine))


@pytest.mark.long
def test_eight_parts_on_a_dask_cluster_are_the_same_bits_as_one_run(scene):
    distributed = pytest.importorskip("distributed", reason="dask and distributed are not installed (extra `test`)")
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, worker_dashboard_address=None
    )
    with cluster, distributed.Client(cluster) as client:
        assert cluster.scheduler_address.startswith("tcp://127.0.0.1:")
        with client.get_executor() as pool:
            assert_same_bits(fly_parts(scene, PARTS, pool), rpf3d.simulate(scene))
            found = {done.seed: done.summary["impacts"] for done in study([scene], pool, seeds=(1, 2), rocks=30)}
    assert found == {seed: rpf3d.simulate(scene, rocks=30, seed=seed).totals.impacts for seed in (1, 2)}


def test_parts_join_to_the_same_bits_in_any_order(scene):
    prepared = prepare(rpf3d.read_scene(scene))
    parts = [fly_part(prepared.scene, part, None, 5, 1) for part in rounds_of_parts([75, 25], 5)]
    one = merged(prepared, parts)
    for order in ([4, 3, 2, 1, 0], [2, 0, 4, 1, 3]):
        other = merged(prepared, [parts[i] for i in order])
        assert_same_bits(one, other)
        assert np.array_equal(one.flights.deposits.x, other.flights.deposits.x)
        assert np.array_equal(one.flights.paths.x, other.flights.paths.x)


@pytest.mark.long
def test_distributions_that_are_rounded_and_bins_that_are_merged_join_to_the_same_bits(tmp_path, monkeypatch):
    monkeypatch.setattr(samples, "EXACT", 45)  # a part has fewer rocks, all together have more
    scene = scene_file(tmp_path, more="").read_text().replace("cell: 10", "cell: 10, memory_gb: 0.0016")
    (tmp_path / "tight.yaml").write_text(scene)
    whole = rpf3d.simulate(tmp_path / "tight.yaml")
    assert len(whole.totals.max_speed.sorted()[0]) < whole.totals.rocks, "values were rounded"
    roomy = rpf3d.simulate(tmp_path / "pit.yaml")
    assert whole.maps.facets.percentiles_within > roomy.maps.facets.percentiles_within, "bins were merged"
    with ThreadPoolExecutor(2) as pool:
        assert_same_bits(fly_parts(tmp_path / "tight.yaml", PARTS, pool), whole)


def test_the_flights_of_all_parts_are_those_of_one_run_where_all_are_kept(scene):
    with ThreadPoolExecutor(2) as pool:
        parts = fly_parts(scene, PARTS, pool, resources=Resources(shown=None)).flights
    whole = rpf3d.simulate(scene).flights
    for table in ("deposits", "impacts"):
        for name, column in vars(getattr(whole, table)).items():
            if column is None:
                assert getattr(getattr(parts, table), name) is None, (table, name)
                continue
            assert np.array_equal(getattr(getattr(parts, table), name), column, equal_nan=True), (table, name)
    assert len(np.unique(parts.paths.row)) >= 10 and (np.diff(parts.paths.row) >= 0).all()


def test_a_run_put_together_from_parts_is_written_like_any_other(scene, tmp_path):
    with ThreadPoolExecutor(2) as pool:
        run = fly_parts(scene, 3, pool, resources=Resources(shown=None))
    folder = rpf3d.write_run(run, tmp_path / "out", recording=False)
    told = json.loads((folder / "summary.json").read_text())
    assert told["rocks"] == 100 and not told["partial"]
    assert sum(1 for _ in (folder / "deposits.csv").open()) == 101


@pytest.mark.parametrize("parts", [1, 7, 200, 1000])
def test_every_rock_flies_in_exactly_one_part(parts):
    rounds = rounds_of_parts([150, 3, 0], parts)
    flown = [[r for first, last in rounds for r in range(first[i], last[i])] for i in range(3)]
    assert flown == [list(range(150)), list(range(3)), []]
    assert all(sum(last) > sum(first) for first, last in rounds) and len(rounds) <= parts


def test_a_worker_prepares_a_scene_once_for_all_its_parts(scene, monkeypatch):
    times = []
    monkeypatch.setattr(study_module, "_READY", {})
    monkeypatch.setattr(study_module, "prepare", lambda scene: times.append(scene) or prepare(scene))
    with ThreadPoolExecutor(3) as pool:
        fly_parts(scene, PARTS, pool)
    assert len(times) == 2, "once for the workers, which are threads of one process, and once to put it together"


def test_a_scene_that_changed_on_disk_is_not_taken_for_the_one_kept(tmp_path):
    first = rpf3d.read_scene(scene_file(tmp_path))
    part = fly_part(first, Round([0, 0], [20, 0]), None, 0, 1)
    harder = rpf3d.read_scene(scene_file(tmp_path, R_n=0.7))
    assert fly_part(harder, Round([0, 0], [20, 0]), None, 0, 1).totals.impacts != part.totals.impacts


def test_parts_that_were_flown_over_other_files_are_refused(tmp_path):
    first = rpf3d.read_scene(scene_file(tmp_path))
    part = fly_part(first, Round([0, 0], [10, 0]), None, 0, 1)
    (tmp_path / "east.geojson").write_text((tmp_path / "east.geojson").read_text().replace("-300", "-200"))
    with pytest.raises(InputError, match="a worker has read other files"):
        merged(prepare(first), [part])


def test_a_scene_that_leaves_the_number_of_rocks_open_is_not_flown_in_parts(scene):
    with ThreadPoolExecutor(1) as pool, pytest.raises(InputError, match=r"rocks: auto.*say how many"):
        fly_parts(scene, PARTS, pool, rocks="auto")


def test_less_than_one_part_is_refused(scene):
    with ThreadPoolExecutor(1) as pool, pytest.raises(InputError, match=r"parts is 0.*at least 1"):
        fly_parts(scene, 0, pool)


@pytest.mark.long
def test_a_fault_in_a_worker_comes_back_as_the_sentence_it_is(tmp_path):
    buried = scene_file(tmp_path).read_text().replace("above_ground: 8, rocks: 25", "above_ground: 8, rocks: 24")
    buried = buried.replace("sources:\n", "sources:\n  - {name: buried, points: [[0, 0, -50]], rocks: 1}\n")
    (tmp_path / "buried.yaml").write_text(buried)
    with processes(1) as pool, pytest.raises(InputError, match="buried"):
        fly_parts(tmp_path / "buried.yaml", 2, pool)


@pytest.mark.long
def test_a_study_flies_every_scene_with_every_seed(scene, tmp_path):
    soft = scene_file(tmp_path, "soft.yaml", R_n=0.2, R_t=0.5)
    with processes() as pool:
        found = list(study([scene, soft], pool, seeds=(1, 2), rocks=20))
    expected = [("pit.yaml", 1), ("pit.yaml", 2), ("soft.yaml", 1), ("soft.yaml", 2)]
    assert sorted((done.scene.name, done.seed) for done in found) == expected
    assert sorted(done.number for done in found) == [0, 1, 2, 3]
    for done in found:
        run = rpf3d.simulate(done.scene, rocks=20, seed=done.seed)
        assert done.summary["impacts"] == run.totals.impacts and done.summary["scene"]["seed"] == done.seed


@pytest.mark.long
def test_a_study_leaves_a_result_folder_for_each_run_where_it_is_given_one(scene, tmp_path):
    with ThreadPoolExecutor(1) as pool:
        found = list(study([scene], pool, rocks=20, out=tmp_path / "out"))
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["0000_pit"]
    assert found[0].summary == json.loads((tmp_path / "out" / "0000_pit" / "summary.json").read_text())


def test_a_study_tells_of_each_run_as_it_finishes_and_not_in_order(scene):
    class Backwards(ThreadPoolExecutor):
        """Only keeps the submitted tasks in `waiting`; the test runs them in reverse order."""

        def submit(self, work, /, *arguments):
            future = Future()
            waiting.append((future, work, arguments))
            return future

    waiting = []
    finished = study([scene], Backwards(1), seeds=(1, 2, 3), rocks=5)
    assert len(waiting) == 3, "everything is on its way at once"
    numbers = []
    for _ in range(3):
        future, work, arguments = waiting.pop()
        future.set_result(work(*arguments))
        numbers.append(next(finished).number)
    assert numbers == [2, 1, 0]


class Never(ThreadPoolExecutor):
    """Runs the first tasks, as many as `runs`, and never starts another; `futures` has the futures of all tasks."""

    def __init__(self, runs):
        super().__init__(1)
        self.runs, self.futures = runs, []

    def submit(self, work, /, *arguments):
        self.futures.append(Future())
        if len(self.futures) <= self.runs:
            self.futures[-1].set_result(work(*arguments))
        return self.futures[-1]


def test_leaving_a_study_cancels_what_has_not_begun(scene):
    executor = Never(1)
    finished = study([scene], executor, seeds=(1, 2, 3), rocks=5)
    next(finished)
    finished.close()
    assert [future.cancelled() for future in executor.futures] == [False, True, True]


def test_leaving_a_study_before_its_first_run_cancels_every_run(scene):
    executor = Never(0)
    study([scene], executor, seeds=(1, 2), rocks=5).close()
    assert [future.cancelled() for future in executor.futures] == [True, True]


def test_a_study_is_refused_if_a_worker_reads_other_files(scene):
    class Elsewhere(ThreadPoolExecutor):
        """Changes a file of the scene before each task, like a machine with another file at the same path."""

        def submit(self, work, /, *arguments):
            area.write_text(area.read_text().replace("-300", "-200"))
            return super().submit(work, *arguments)

    area = scene.parent / "east.geojson"
    with Elsewhere(1) as pool, pytest.raises(InputError, match="a worker has read other files"):
        next(study([scene], pool, rocks=5))
