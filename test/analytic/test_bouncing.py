"""Tests of bouncing: all printed numbers of the reference, and the exact closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest
from flights.scenes_of_facets import ENGINES, down_the_slope, engine_over, flight, floor, fly, incline, surface

from rpf3d_core.results.mesh_writer import write_mesh
from rpf3d_core.runs.run import simulate
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Mode, Outcome

G = 9.81
PRINTED = 5.1e-7
"""Half a unit of the sixth decimal, the last that the reference prints, and a little for its own rounding."""
EXACT = 1e-10
"""Largest relative error of about ten impacts; the worst case needs 1e-12."""
SURVEYED = 1e-6
"""Largest error (m) in survey coordinates (docs/explanation/physics.md); float64 rounds 4.5e6 m by up to 5e-10 m."""

# Rn, Rt, h, angle | w0, u0 | t, s of impacts 2 to 4, after the first | t and s at the end of bouncing
TABLE = [
    (0.84, 0.70, 0.30, 22, 1.889536, 0.636185,
     0.415480, 0.581509, 0.764484, 1.333750, 1.057647, 2.065584, 2.596752, 4.794261),
    (0.84, 0.70, 0.30, 40, 1.561145, 1.091631,
     0.415480, 0.997812, 0.764484, 2.288582, 1.057647, 3.544336, 2.596752, 8.226474),
    (0.84, 0.70, 0.30, 50, 1.309957, 1.300955,
     0.415480, 1.189146, 0.764484, 2.727426, 1.057647, 4.223976, 2.596752, 9.803930),
    (0.84, 0.70, 0.30, 59, 1.049612, 1.455706,
     0.415480, 1.330598, 0.764484, 3.051859, 1.057647, 4.726428, 2.596752, 10.970131),
    (0.50, 0.80, 10.0, 22, 6.493598, 4.197734,
     1.427843, 9.739771, 2.141765, 16.070623, 2.498725, 19.211699, 2.855686, 21.643937),
    (0.50, 0.80, 10.0, 40, 5.365046, 7.202893,
     1.427843, 16.712478, 2.141765, 27.575588, 2.498725, 32.965363, 2.855686, 37.138840),
    (0.50, 0.80, 10.0, 50, 4.501808, 8.584074,
     1.427843, 19.917156, 2.141765, 32.863307, 2.498725, 39.286589, 2.855686, 44.260346),
    (0.50, 0.80, 10.0, 59, 3.607105, 9.605171,
     1.427843, 22.286350, 2.141765, 36.772477, 2.498725, 43.959825, 2.855686, 49.525222),
]  # fmt: skip
ROWS = pytest.mark.parametrize("row", TABLE, ids=[f"validation-2.2-Rn{r[0]}-Rt{r[1]}-{r[3]}deg" for r in TABLE])

MESHES = {
    "two_facets": {"cells": (1, 1)},
    "striking_37": {"cells": (5, 2), "strike": 37.0},
    "striking_120_uneven": {"cells": (40, 9), "strike": 120.0, "jitter": 1},
    "striking_270_fine": {"cells": (150, 20), "strike": 270.0, "jitter": 2},
}
OFF_THE_MIDDLE = 0.237
"""Offset (m) across the slope, away from the edges of even grids, which test/hard tests."""


def closed_form_ends(Rn: float, Rt: float, h: float, angle: float) -> tuple[float, float]:
    """Return time (s) and distance (m) from the first impact to the end of bouncing, summed bounce by bounce."""
    a, V = math.radians(angle), math.sqrt(2 * G * h)
    w, u, t, s = Rn * V * math.cos(a), Rt * V * math.sin(a), 0.0, 0.0
    while w > 1e-18:
        T = 2 * w / (G * math.cos(a))
        t, s = t + T, s + u * T + 0.5 * G * math.sin(a) * T * T
        u, w = Rt * (u + G * math.sin(a) * T), Rn * w
    return t, s


def dropped(engine: str, row: tuple, mesh: dict, smallest_bounce: float = 1e-3):
    """Drop a rock as in a row of TABLE, with `ground: none`.

    Return the flights, the point (3,) m below the release, and the downhill direction and normal of the slope.
    """
    Rn, Rt, h, angle = row[:4]
    strike = mesh.get("strike", 0.0)
    descent, normal = down_the_slope(angle, strike)
    across = OFF_THE_MIDDLE * np.cross(normal, descent)
    over = engine_over(engine, incline(angle, down=56.0, **mesh))
    flights = fly(over, flight(surface(Rn, Rt), "none", smallest_bounce=smallest_bounce), np.add(across, (0, 0, h)))
    return flights, across, descent, normal


@pytest.mark.long
@ROWS
@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_dropped_on_an_incline_bounces_as_printed(engine, mesh, row):
    flights, start, descent, normal = dropped(engine, row, mesh)
    first = flights.paths.v[1]
    assert [first @ normal, first @ descent] == pytest.approx(row[4:6], abs=PRINTED)
    t = flights.impacts.t - flights.impacts.t[0]
    s = (flights.impacts.x - start) @ descent
    found = np.stack([t[1:4], s[1:4]], axis=1).ravel()
    np.testing.assert_allclose(found, row[6:12], rtol=0.0, atol=PRINTED)


@ROWS
@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
@pytest.mark.parametrize("engine", ENGINES)
def test_bouncing_on_an_incline_ends_as_printed(engine, mesh, row):
    flights, start, descent, _ = dropped(engine, row, mesh)
    t = flights.deposits.t[0] - flights.impacts.t[0]
    end = flights.deposits.x[0] - start
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert [t, end @ descent] == pytest.approx(row[12:], abs=PRINTED)
    assert [t, end @ descent] == pytest.approx(closed_form_ends(*row[:4]), rel=EXACT)
    assert np.linalg.norm(end - (end @ descent) * descent) < EXACT


@pytest.mark.parametrize("height", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("row", [TABLE[0], TABLE[7]], ids=["validation-2.2-lab-22deg", "validation-2.2-Arturo-59deg"])
@pytest.mark.parametrize("engine", ENGINES)
def test_where_bouncing_ends_does_not_depend_on_the_smallest_bounce(engine, row, height):
    flights, start, descent, _ = dropped(engine, row, MESHES["striking_120_uneven"], height)
    end = (flights.deposits.t[0] - flights.impacts.t[0], (flights.deposits.x[0] - start) @ descent)
    assert end == pytest.approx(closed_form_ends(*row[:4]), rel=EXACT)


def test_a_smaller_smallest_bounce_is_not_merely_ignored():
    counts = [len(dropped("reference", TABLE[0], MESHES["two_facets"], h)[0].impacts.t) for h in (1e-2, 1e-4, 1e-6)]
    assert counts[0] < counts[1] < counts[2]


# --- the same slope far from the origin, read from files --------------------------------------------------------------

FAR = (500_000.0, 4_500_000.0, 0.0)

SCENE = """\
terrain: {{files: [{{path: {mesh}}}]}}
materials: {{default: {{normal_restitution: {Rn}, tangential_restitution: {Rt}}}}}
sources: [{{name: top, points: [[{x!r}, {y!r}, {z!r}]]}}]
rebound: constant
ground: none
engine: {engine}
"""


def write_ply(path: Path, terrain: Terrain) -> None:
    """Write a terrain as ASCII PLY in double precision, in the input's coordinates."""
    points = terrain.frame.points_to_input(terrain.vertices)
    lines = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(terrain.triangles)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(repr(float(c)) for c in point) for point in points]
    lines += [f"3 {a} {b} {c}" for a, b, c in terrain.triangles]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.long
@pytest.mark.parametrize("kind", [".vtp", ".ply"])
@pytest.mark.parametrize("row", [TABLE[1], TABLE[6]], ids=["validation-2.2-lab-40deg", "validation-2.2-Arturo-50deg"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_scene_read_from_a_file_in_survey_coordinates_gives_the_same_answer(engine, row, kind, tmp_path):
    Rn, Rt, h, angle = row[:4]
    mesh = incline(angle, 37.0, down=56.0, cells=(20, 5), jitter=3)
    there = Terrain(mesh.vertices, mesh.triangles, mesh.zone, mesh.zones, Frame(FAR))
    (write_mesh if kind == ".vtp" else write_ply)(tmp_path / f"slope{kind}", there)
    descent, normal = down_the_slope(angle, 37.0)
    start = OFF_THE_MIDDLE * np.cross(normal, descent)
    x, y, z = (float(c) for c in start + FAR + (0, 0, h))
    (tmp_path / "scene.yaml").write_text(SCENE.format(mesh=f"slope{kind}", Rn=Rn, Rt=Rt, x=x, y=y, z=z, engine=engine))

    run = simulate(tmp_path / "scene.yaml")

    end = run.terrain.frame.points_to_input(run.flights.deposits.x[0]) - FAR - start
    assert run.flights.engine == engine
    assert run.flights.deposits.t[0] - run.flights.impacts.t[0] == pytest.approx(row[12], abs=PRINTED)
    assert np.linalg.norm(end - row[13] * descent) < SURVEYED + PRINTED
    s = (run.terrain.frame.points_to_input(run.flights.impacts.x[1:4]) - FAR - start) @ descent
    np.testing.assert_allclose(s, row[7:12:2], rtol=0.0, atol=SURVEYED + PRINTED)


# --- validation.md 2.1 ------------------------------------------------------------------------------------------------


def wolfram_throw(engine: str):
    over = engine_over(engine, floor(cells=5))
    x = np.array([-1.1, 0.3, 1.5])
    flights = fly(over, flight(surface(0.7, 0.8), "none", smallest_bounce=1e-9), x, (1.0, 0.0, 0.0))
    return flights, x


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_thrown_on_a_flat_floor_ends_where_wolframs_demonstration_does(engine):
    flights, start = wolfram_throw(engine)
    t0 = math.sqrt(2 * 1.5 / G)
    exact = (t0 * 1.7 / 0.3, t0 * (1 + 2 * 0.56 / 0.44))
    assert (flights.deposits.t[0], flights.deposits.x[0, 0] - start[0]) == pytest.approx(exact, rel=EXACT)
    assert exact == pytest.approx((3.133674, 1.960641), abs=PRINTED)
    assert exact == pytest.approx((3.135, 1.96), abs=2e-3)  # [SNIP] three digits


@pytest.mark.parametrize("engine", ENGINES)
def test_the_thirteenth_bounce_on_a_flat_floor_is_where_wolframs_demonstration_has_it(engine):
    flights, start = wolfram_throw(engine)
    assert flights.impacts.t[12] == pytest.approx(3.097954, abs=PRINTED)
    assert flights.impacts.x[12, 0] - start[0] == pytest.approx(1.959302, abs=PRINTED)


# --- validation.md 2.4 ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gravity", "speed", "digits"),
    [(9.8, 13.08, 5e-3), (9.81, 13.0897, 5e-5)],
    ids=["validation-2.4-Beer-type-problem", "validation-2.4-own"],
)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_falls_20_m_on_a_smooth_slope_leaves_at_the_textbook_speed(engine, gravity, speed, digits):
    over = engine_over(engine, incline(40.0))
    flights = fly(
        over, flight(surface(0.2, 1.0), "sliding", gravity=gravity), (0.5, 0.2, 20.0 - 0.5 * math.tan(math.radians(40)))
    )
    assert flights.impacts.speed_out[0] == pytest.approx(speed, abs=digits)
    if gravity == G:
        descent, normal = down_the_slope(40.0)
        v = flights.paths.v[1]
        assert (v @ normal, v @ descent) == pytest.approx((3.0349, 12.7330), abs=5e-5)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_piece_of_bouncing_that_is_summed_up_is_called_settling(engine):
    flights, _, _, _ = dropped(engine, TABLE[4], MESHES["two_facets"])
    assert list(flights.paths.mode[-2:]) == [Mode.SETTLING, Mode.END]
