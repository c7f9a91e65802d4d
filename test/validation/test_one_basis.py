"""Tests that field and simulation are measured from the field's start by one function, on invented sites.

On both sites the ground is level and rocks stop where they land (R_n = R_t = 0, dropped at rest). So the distance of
each rock from its release is 0, and each spread of end points equals the spread of the releases.
"""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from field_cases import authume, tschamut
from field_cases.flying import Ends, Keys
from input_files.terrain_files import ascii_stl

GROUND = {"normal_restitution": 0.0, "tangential_restitution": 0.0, "friction_angle_deg": 40.0}
STOPS_AT_ONCE = {"rebound": "constant", "ground": "sliding", "materials": {"default": GROUND}}
SIX_SIGMA = 6.0

# --- a quarry: x along the profile, z across it, y up -----------------------------------------------------------------

HEIGHT = 30.0
DROPS = np.array([[1.0, HEIGHT, 3.0], [1.0, HEIGHT, 13.0], [7.0, HEIGHT, 3.0], [7.0, HEIGHT, 13.0]])
"""Drop points (m); each is 3 m along the profile and 5 m across it away from their mean."""
ALONG, ACROSS = 3.0, 5.0
FIELD_TIMES = 3
"""How often the invented field data contain the end point below each drop point."""

SCENE = """\
terrain: {files: [{path: plate.stl, zone: plate}], up: y}
materials: {default: {normal_restitution: 0.0, tangential_restitution: 0.0, friction_angle_deg: 40.0}}
rock: {density: 2700, mass: 800}
sources: [{name: drops, points_file: positions_P1.xyz, rocks: 4}]
rebound: constant
ground: sliding
stop_speed: 0.5
seed: 1
"""


@pytest.fixture
def quarry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield the folder of a level quarry whose field blocks stopped below their drop points."""
    corners = np.array([[-50.0, 0.0, -50.0], [50.0, 0.0, -50.0], [50.0, 0.0, 50.0], [-50.0, 0.0, 50.0]])
    (tmp_path / "plate.stl").write_text(ascii_stl(corners[[[0, 2, 1], [0, 3, 2]]]))
    (tmp_path / "scene.yaml").write_text(SCENE)
    ends = np.tile(DROPS * [1.0, 0.0, 1.0] + [0.0, authume.DATUM, 0.0], (FIELD_TIMES, 1))
    np.savetxt(tmp_path / "Endpoints_P1.txt", ends)
    np.savetxt(tmp_path / "positions_P1.xyz", DROPS)
    monkeypatch.setattr(authume, "DATA", tmp_path)
    monkeypatch.setattr(authume, "SCENE", tmp_path / "scene.yaml")
    monkeypatch.setattr(authume, "ROCKS", 400)
    yield from without_memory(tmp_path, authume.site)


def without_memory(folder: Path, *cached: Any) -> Iterator[Path]:
    """Yield a folder; clear the caches of the functions `cached` before and afterwards."""
    for function in cached:
        function.cache_clear()
    yield folder
    for function in cached:
        function.cache_clear()


def sample_sd(half_width: float, n: int) -> float:
    """Return the standard deviation of a sample of n values, half at -half_width and half at half_width."""
    return half_width * math.sqrt(n / (n - 1))


def test_rocks_that_stop_where_they_land_spread_as_their_releases_do(quarry: Path) -> None:
    field, (found, _) = authume.field(), authume.simulated(STOPS_AT_ONCE)
    angle = math.degrees(math.atan((HEIGHT - authume.DATUM) / math.hypot(ALONG, ACROSS)))
    for figures, n in ((field, 4 * FIELD_TIMES), (found, 400)):
        assert figures["side_mean"] == pytest.approx(0.0, abs=1e-9)
        assert figures["side_sd"] == pytest.approx(sample_sd(ACROSS, n), rel=1e-9)
        assert (figures["mean"], figures["sd"]) == pytest.approx((4.0, sample_sd(ALONG, n)), rel=1e-9)
        assert (figures["angle_mean"], figures["angle_sd"]) == pytest.approx((angle, 0.0), abs=1e-6)


def test_releases_that_are_moved_aside_move_the_end_points_seen_from_the_drop_point(quarry: Path) -> None:
    moved = DROPS + np.array([0.0, 0.0, 6.0])
    np.savetxt(quarry / "moved.xyz", moved)
    (quarry / "scene.yaml").write_text(SCENE.replace("positions_P1.xyz", "moved.xyz"))
    found, _ = authume.simulated(STOPS_AT_ONCE)
    assert found["side_mean"] == pytest.approx(6.0, rel=1e-9)
    assert found["side_sd"] == pytest.approx(sample_sd(ACROSS, 400), rel=1e-9)
    near, far = (math.atan((HEIGHT - authume.DATUM) / math.hypot(ALONG, 6.0 + s * ACROSS)) for s in (-1.0, 1.0))
    assert found["angle_mean"] == pytest.approx(math.degrees(0.5 * (near + far)), abs=1e-6)


def test_the_field_flown_as_a_simulation_has_the_fields_figures_to_the_last_bit(
    quarry: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scattered = np.random.default_rng(5).normal([40.0, 20.0, 6.0], [11.0, 3.0, 7.0], (41, 3))
    np.savetxt(quarry / "Endpoints_P1.txt", scattered)
    on_the_mesh = authume.end_points() - [0.0, authume.DATUM, 0.0]
    given: dict[str, Any] = {"source": np.zeros(41, int), "end": on_the_mesh, "stopped": np.ones(41, bool)}
    # A record of ends that had releases too would be filled with scattered ones: nothing may be measured from them.
    given["release"] = scattered[::-1]
    ends = Ends(**{name: given[name] for name in Ends.__dataclass_fields__})
    monkeypatch.setattr(authume, "site", lambda rocks, seed: Flown(ends))
    field, (found, _) = authume.field(), authume.simulated({})
    alike = set(field) & set(found)
    assert alike >= {"mean", "sd", "side_mean", "side_sd", "angle_mean", "angle_sd", "percentiles", "sections"}
    for name in alike:
        # The datum is subtracted and added again, which rounds heights; they affect only the reach angle.
        assert found[name] == (pytest.approx(field[name], rel=1e-12) if "angle" in name else field[name]), name
    assert found["distance"] == 0.0


class Flown:
    """Stands in for a site whose rocks always end in the same places."""

    def __init__(self, ends: Ends) -> None:
        self.ends = ends

    def fly(self, _: Keys) -> Ends:
        return self.ends


# --- a meadow: z up, one source a run ---------------------------------------------------------------------------------

LEVEL = 7.0
SCATTER = 4.0
"""Half-width (m) of the square in which the rocks of a run are released."""
MEAN_DISTANCE = SCATTER * (math.sqrt(2.0) + math.asinh(1.0)) / 3.0
"""Mean distance (m) of points in a square from its centre: 0.7652 times the half-width."""
RELEASES = {"a": (0.0, 120.0, LEVEL), "b": (10.0, 130.0, LEVEL), "c": (20.0, 125.0, LEVEL)}
ENDS = {"a": (60.0, 120.0, 0.0), "b": (70.0, 134.0, 0.0), "c": (80.0, 121.0, 0.0)}
"""Run -> end point (m): 60 m along x from the release, 0, 4 or -4 m across x, and 7 m lower."""
RUNOUTS = np.hypot(60.0, [0.0, 4.0, 4.0])


@pytest.fixture
def meadow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield the folder of a level meadow with three runs."""
    rows = "\n".join(" ".join([f"{LEVEL:g}"] * 43) for _ in range(46))
    head = "ncols 43\nnrows 46\nxllcorner -35\nyllcorner 85\ncellsize 5\nNODATA_value -9999\n"
    (tmp_path / "terrain.asc").write_text(head + rows + "\n")
    for name, places in (("release_points", RELEASES), ("observed_deposition", ENDS)):
        lines = [f"{run},{x},{y},{z},{z},0,0,0,0.2,60" for run, (x, y, z) in places.items()]
        columns = "trajectory_id,x_m,y_m,z_m,ground_z_m,vx_mps,vy_mps,vz_mps,radius_m,mass_kg"
        (tmp_path / f"{name}.csv").write_text("\n".join([columns, *lines]) + "\n")
    monkeypatch.setattr(tschamut, "DATA", tmp_path)
    monkeypatch.setattr(tschamut, "SPREAD", SCATTER)
    yield from without_memory(tmp_path, tschamut.runs, tschamut.site)


def test_runout_of_rocks_that_stop_where_they_land_is_their_scatter_about_the_run(meadow: Path) -> None:
    ends = tschamut.site(4000, 3).fly(STOPS_AT_ONCE)
    errors = tschamut.errors_of(ends)
    room = SIX_SIGMA * SCATTER / math.sqrt(4000)
    assert errors == pytest.approx(MEAN_DISTANCE - RUNOUTS, abs=room)


def test_the_meadows_field_has_the_figures_that_were_made_up(meadow: Path) -> None:
    field = tschamut.field_figures()
    angles = np.degrees(np.arctan(7.0 / RUNOUTS))
    assert (field["runout_mean"], field["runout_sd"]) == pytest.approx((RUNOUTS.mean(), RUNOUTS.std(ddof=1)))
    assert (field["angle_mean"], field["angle_sd"]) == pytest.approx((angles.mean(), angles.std(ddof=1)))
    assert (field["side_mean"], field["side_sd"]) == pytest.approx((0.0, 4.0), abs=1e-12)


def test_the_meadows_field_flown_as_a_simulation_has_the_fields_figures(
    meadow: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends = Ends(np.arange(3), tschamut.runs().end, np.ones(3, bool))
    monkeypatch.setattr(tschamut, "site", lambda rocks, seed: Flown(ends))
    monkeypatch.setattr(tschamut, "ROCKS_A_RUN", 1)
    found, _ = tschamut.simulated({})
    field = tschamut.field_figures()
    assert {name: found[name] for name in set(field) & set(found)} == {
        name: value for name, value in field.items() if name != "runs"
    }
    assert found["error_mean"] == found["error_absolute"] == found["end_off"] == 0.0
    assert found["correlation"] == pytest.approx(1.0)


# --- both sides go through one function -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["quarry", "meadow"])
def test_both_sides_go_through_the_same_function(
    name: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the results of the function are stretched, the figures of field and simulation must be stretched equally."""
    request.getfixturevalue(name)
    site, field = (authume, authume.field) if name == "quarry" else (tschamut, tschamut.field_figures)
    names = ("side_sd", "runout_mean", *(("angle_mean",) if name == "quarry" else ()))  # level rocks have no angle
    before = [figures[n] for figures in (field(), site.simulated(STOPS_AT_ONCE)[0]) for n in names]
    monkeypatch.setattr(site, "measured_from", stretched(site.measured_from))
    after = [figures[n] for figures in (field(), site.simulated(STOPS_AT_ONCE)[0]) for n in names]
    assert np.abs(before).min() > 0.01
    assert after == pytest.approx(3.0 * np.array(before), rel=1e-12)


def stretched(measure: Callable[..., Any]) -> Callable[..., Any]:
    return lambda *given: type(found := measure(*given))(*(3.0 * values for values in found))
