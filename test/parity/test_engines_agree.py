"""Tests that both engines give the same bits, on every shipped scene and for every pair of models."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import rpf3d_core as rpf3d
from rpf3d_core.ensemble import batches, flight_order
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights, given_columns
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases, releases_of
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.keys import GroundSpec, ReboundSpec
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.prepared import scene_flight
from rpf3d_core.setup.sources import rock_of, scene_sources
from rpf3d_core.simulation.engines import Engine, engine_of
from rpf3d_core.terrain.facets import Terrain, facets_of

pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine to compare with")

SCENES = Path(__file__).parents[2] / "config" / "scenes"
AUTHUME = Path(__file__).parents[3] / "shared" / "data" / "authume"
LABS = ("lab_22", "lab_40", "lab_50", "lab_59")
FEW = 40
"""Number of rocks in tests with other models: the reference engine flies about 50 rocks per second in a pit."""

OWN = [("demo", 200), ("authume_p1", 100), *((lab, 1) for lab in LABS)]
MODELS = [(rebound, ground) for rebound in ("constant", "thesis_literal") for ground in ("none", "sliding")]
OTHER = [(name, min(rocks, FEW), *models) for name, rocks in OWN for models in MODELS]


def scene_called(name: str) -> Scene:
    if name == "authume_p1" and not AUTHUME.is_dir():
        pytest.skip(f"the Authume data is not there ({AUTHUME})")
    return rpf3d.read_scene(SCENES / f"{name}.yaml")


@cache
def ground_of(name: str) -> Terrain:
    return rpf3d.read_terrain(scene_called(name))[0]


@cache
def engine_over(engine: str, name: str) -> Engine:
    return engine_of(engine, facets_of(ground_of(name)))


def prepared(engine: str, name: str, rocks: int, **models: str) -> tuple[Engine, Flight, Releases]:
    """Return the engine, the physics and the releases of a scene; this engine also gives the release heights."""
    specs = {"rebound": ReboundSpec, "ground": GroundSpec}
    chosen = {key: specs[key].model_validate({model: {}}) for key, model in models.items()}
    scene = with_choices(scene_called(name).model_copy(update=chosen), rocks, engine, None)
    terrain, built = ground_of(name), engine_over(engine, name)
    releases = releases_of(scene_sources(scene, terrain), rock_of(scene.rock), scene.seed, built)
    return built, scene_flight(scene, terrain), releases


def columns(part: object) -> dict[str, np.ndarray]:
    return {name: np.asarray(values) for name, values in given_columns(part).items()}


def assert_same_bits(one: object, other: object) -> None:
    """Assert that all columns are equal, including the sign of zero; NaN equals NaN, whatever its bits."""
    for name, a in columns(one).items():
        b = columns(other)[name]
        assert a.dtype == b.dtype and a.shape == b.shape, name
        alike = (a == b) & (np.signbit(a) == np.signbit(b)) if a.dtype.kind == "f" else a == b
        absent = np.isnan(a) & np.isnan(b) if a.dtype.kind == "f" else np.zeros(a.shape, bool)
        assert (alike | absent).all(), f"{name}: {np.argwhere(~(alike | absent))[:5].tolist()}"


def assert_same_flights(one: Flights, other: Flights) -> None:
    for part in ("deposits", "impacts", "paths"):
        assert_same_bits(getattr(one, part), getattr(other, part))


@pytest.mark.long
@pytest.mark.parametrize(("name", "rocks"), OWN)
def test_both_engines_leave_the_same_bits_on_a_scene_as_it_is(name: str, rocks: int) -> None:
    reference, compiled = (fly_ensemble(*prepared(engine, name, rocks)) for engine in ("reference", "compiled"))
    assert (reference.engine, compiled.engine) == ("reference", "compiled")
    assert len(reference.deposits.t) == rocks and len(reference.impacts.t) >= rocks
    assert_same_flights(reference, compiled)


@pytest.mark.long
@pytest.mark.parametrize(("name", "rocks", "rebound", "ground"), OTHER)
def test_both_engines_leave_the_same_bits_under_every_pair_of_models(
    name: str, rocks: int, rebound: str, ground: str
) -> None:
    reference, compiled = (
        fly_ensemble(*prepared(engine, name, rocks, rebound=rebound, ground=ground))
        for engine in ("reference", "compiled")
    )
    assert len(reference.impacts.t) >= rocks
    assert_same_flights(reference, compiled)


@pytest.mark.long
@pytest.mark.parametrize("name", ["demo", "authume_p1"])
def test_both_engines_find_the_same_ground_below_the_same_points(name: str) -> None:
    # A vertical flight finds the height, so the locator of each engine is tested.
    low, high = (engine_over("compiled", name).facets.low, engine_over("compiled", name).facets.high)
    x = np.random.default_rng(3).uniform(low, high, (300, 3))
    reference, compiled = (engine_over(engine, name).ground_below(x) for engine in ("reference", "compiled"))
    assert (reference[:, 1] >= 0).any() and (reference[:, 1] < 0).any()
    np.testing.assert_array_equal(reference, compiled)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_number_of_threads_does_not_matter(threads: int) -> None:
    parts = prepared("compiled", "demo", 300)
    assert_same_flights(fly_ensemble(*parts, threads=threads), fly_ensemble(*parts))


@pytest.mark.parametrize("engine", ["reference", "compiled"])
@pytest.mark.parametrize("size", [1, 7, 1000])
def test_the_size_of_batches_does_not_matter(monkeypatch: pytest.MonkeyPatch, engine: str, size: int) -> None:
    parts = prepared(engine, "demo", 25)
    whole = fly_ensemble(*parts)
    monkeypatch.setattr(flight_order, "LARGEST_BATCH", size)
    monkeypatch.setattr(flight_order, "REFERENCE_BATCH", size)
    monkeypatch.setattr(flight_order, "BATCHES_A_THREAD", 1)
    assert_same_flights(fly_ensemble(*parts, threads=1), whole)
    flown: list[int] = []
    every = np.ones(25, dtype=bool)
    control = batches.BatchControl(threads=1, advance=flown.append)
    batches.fly_batches(*parts, batches.Keep(paths=every, impacts=every), control=control)
    assert sum(flown) == 25 and max(flown) == min(size, 25)


@pytest.mark.parametrize("engine", ["reference", "compiled"])
@pytest.mark.parametrize("room", [1, 40, 333])
def test_how_much_there_is_room_to_write_down_at_once_does_not_matter(
    monkeypatch: pytest.MonkeyPatch, engine: str, room: int
) -> None:
    parts = prepared(engine, "demo", 25)
    whole = fly_ensemble(*parts)
    monkeypatch.setattr(batches, "ROOM", room)
    assert_same_flights(fly_ensemble(*parts), whole)
    assert_same_flights(fly_ensemble(*parts, paths=4), fly_ensemble(*parts, paths=4))


@pytest.mark.parametrize("engine", ["reference", "compiled"])
def test_a_rock_flown_alone_leaves_the_same_bits_as_among_others(engine: str) -> None:
    built, flight, releases = prepared(engine, "demo", 12)
    together = fly_ensemble(built, flight, releases)
    for i in range(12):
        alone = fly_ensemble(built, flight, Releases(**{k: a[i : i + 1] for k, a in columns(releases).items()}))
        for part in ("deposits", "impacts", "paths"):
            rows = columns(getattr(together, part))
            its = rows["row"] == i if "row" in rows else np.arange(12) == i
            expected = {k: a[its] for k, a in rows.items() if k != "row"}
            got = {k: a for k, a in columns(getattr(alone, part)).items() if k != "row"}
            assert all(np.array_equal(got[k], expected[k], equal_nan=got[k].dtype.kind == "f") for k in expected), part


@pytest.mark.parametrize("engine", ["reference", "compiled"])
def test_what_is_written_down_does_not_change_where_rocks_go(engine: str) -> None:
    parts = prepared(engine, "demo", 12)
    everything, nothing = fly_ensemble(*parts), fly_ensemble(*parts, record=False)
    some = fly_ensemble(*parts, paths=3)
    assert_same_bits(everything.deposits, some.deposits)
    assert_same_bits(everything.impacts, some.impacts)
    assert len(nothing.impacts.t) == len(nothing.paths.t) == 0 and np.isnan(nothing.deposits.max_height).all()
    kept = {**columns(nothing.deposits), "max_height": everything.deposits.max_height}
    assert_same_bits(everything.deposits, type(everything.deposits)(**kept))
    assert sorted(set(some.paths.row.tolist())) == [0, 5, 11], "three rocks, evenly spread"


def test_another_seed_gives_other_releases_and_the_same_seed_the_same() -> None:
    scene = scene_called("demo")
    runs = [rpf3d.simulate(scene, rocks=5, engine="reference", seed=seed) for seed in (1, 1, 2)]
    assert_same_flights(runs[0].flights, runs[1].flights)
    assert not (runs[0].flights.deposits.release == runs[2].flights.deposits.release).any(axis=1).any()
