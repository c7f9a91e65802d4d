"""Tests of the ground models of Azzoni and STONE for rolling: closed forms, stop rules, and keys of a scene."""

import dataclasses
import math

import numpy as np
import pytest
from flights.scenes_of_facets import (
    ENGINES,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    gully,
    incline,
    same_bits,
    strip,
)

from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.errors import SceneError
from rpf3d_core.kinetics.coulomb_sphere import MATERIALS_OWN, CoulombSphere
from rpf3d_core.kinetics.rolling import Rolling
from rpf3d_core.kinetics.rolling_stone import RollingStone
from rpf3d_core.kinetics.sphere_ground import SphereGround
from rpf3d_core.materials.distributions import fixed, uniform_between
from rpf3d_core.materials.draws import DrawnSurface, drawn_materials
from rpf3d_core.materials.library import Surface
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.simulation.engines import Models
from rpf3d_core.values import Outcome

G = 9.81
OVER_EDGES = 1e-6
"""Largest relative error: at each edge a rock is within the contact tolerance, about 1e-10 m, of the plane."""
PRINTED = 5e-3
"""Largest rounding error (m) of the reference, which prints two decimals."""
BOTH = pytest.mark.parametrize("engine", ENGINES)


def rolling(ground, mu_r, stop_speed=0.0, mu=0.0, **settings):
    """Return the physics of rolling with a ground model on one material. mu : sliding friction, without effect here"""
    physics = flight(Surface(0.5, 0.8, mu, stop_speed, mu_r), **settings)
    return dataclasses.replace(physics, models=Models(physics.models.rebound, ground))


def rolled(engine, ground, mu_r, angle, speed, **how):
    """Return the distance (m) that a rock rolls down a slope of `angle` degrees, and its flights; speed in m/s."""
    descent, normal = down_the_slope(angle, 37.0)
    over = engine_over(engine, incline(angle, 37.0, cells=(7, 3), down=120.0))
    start = descent + 0.3 * np.cross(normal, descent)
    flights = fly(over, rolling(ground, mu_r, **how), start, speed * descent)
    return float((flights.deposits.x[0] - start) @ descent), flights


WAYS = [
    pytest.param(Rolling(), 0.5, 20.0, 10.0, 55.82, id="physics-9.5: Azzoni, 20 degrees"),
    pytest.param(RollingStone(0.0), 0.5, 20.0, 10.0, 48.45, id="physics-9.5: STONE, 20 degrees"),
    pytest.param(Rolling(), 0.4, 0.0, 5.0, 4.460, id="physics-9.5: Azzoni, flat"),
]


@pytest.mark.long
@BOTH
@pytest.mark.parametrize(("ground", "mu_r", "angle", "speed", "way"), WAYS)
def test_a_rock_rolls_to_a_stop_after_the_printed_way(engine, ground, mu_r, angle, speed, way):
    went, flights = rolled(engine, ground, mu_r, angle, speed)
    b = math.radians(angle)
    exact = speed**2 / (2 * G * 5 / 7 * (mu_r * math.cos(b) - math.sin(b)))
    if isinstance(ground, RollingStone):
        exact = speed**2 / (2 * G * (math.sin(math.atan(mu_r)) - math.sin(b)))
    assert exact == pytest.approx(way, abs=PRINTED)
    assert went == pytest.approx(exact, rel=OVER_EDGES)
    assert flights.deposits.t[0] == pytest.approx(2 * exact / speed, rel=OVER_EDGES)
    assert flights.deposits.outcome[0] == Outcome.STOPPED


@BOTH
@pytest.mark.parametrize("angle", [22.0, 40.0, 50.0, 59.0])
def test_a_sphere_rolls_down_with_five_sevenths_of_gravity(engine, angle):
    """The accelerations (m/s2) are those of a_roll in section 2.5 of the validation reference."""
    a = dict(zip((22.0, 40.0, 50.0, 59.0), (2.624922, 4.504105, 5.367783, 6.006294), strict=True))[angle]
    _, flights = rolled(engine, Rolling(), 0.0, angle, 0.0)
    speeds, way = np.linalg.norm(flights.paths.v_end[:-2], axis=1), flights.deposits.path[0]
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert speeds.max() ** 2 / (2 * 119.0) == pytest.approx(a, rel=1e-6)
    assert way > 119.0 - 1e-6


@BOTH
def test_a_rock_that_begins_to_roll_rises_to_seven_fifths_of_the_height_of_its_energy(engine):
    """The rock starts to roll at its full speed and without spin, so it gains the energy of rotation (physics.md)."""
    angle, speed = 30.0, 8.0
    descent, _ = down_the_slope(angle)
    over, start = engine_over(engine, incline(angle, down=60.0)), 40.0 * descent
    flights = fly(over, rolling(Rolling(), 0.0), start, -speed * descent)
    height = speed**2 / (2.0 * G)
    assert flights.paths.x[:, 2].max() - start[2] == pytest.approx(1.4 * height, rel=OVER_EDGES)


@BOTH
@pytest.mark.parametrize("above", [0.0, 0.5])
def test_a_rock_that_lands_and_rolls_up_a_ramp_rises_to_at_most_seven_fifths_of_the_height_of_its_energy(engine, above):
    speed, steps = 14.0, np.radians(np.arange(1.0, 36.0))
    x, z = np.cumsum(0.5 * np.cos(steps)), np.cumsum(0.5 * np.sin(steps))
    ramp = strip([(-30.0, 0.0), (0.0, 0.0), *zip(x, z, strict=True), (x[-1] + 40.0, z[-1] + 28.0)], 20.0)
    physics = dataclasses.replace(rolling(Rolling(), 0.0), materials=flight(Surface(0.3, 1.0, 0.0, 0.0, 0.0)).materials)
    flights = fly(engine_over(engine, ramp), physics, (-20.0, 1.3, above), (speed, 0.0, 0.0))
    height = speed**2 / (2.0 * G)
    assert 1.1 * height < flights.paths.x[:, 2].max() <= above + 1.4 * height


@BOTH
def test_each_model_has_a_stop_of_its_own(engine):
    """Azzoni's model stops at the material's stop speed where friction holds, STONE's at its own speed on any slope."""
    slow = rolled(engine, Rolling(), 0.5, 20.0, 10.0, stop_speed=2.0)[0]
    assert slow == pytest.approx(96.0 / 100.0 * 55.82, abs=PRINTED)
    slow = rolled(engine, RollingStone(3.0), 0.5, 20.0, 10.0, stop_speed=9.0)[0]
    assert slow == pytest.approx(91.0 / 100.0 * 48.45, abs=PRINTED)
    assert rolled(engine, RollingStone(3.0), 0.1, 30.0, 2.9)[1].deposits.outcome[0] == Outcome.STOPPED
    assert rolled(engine, RollingStone(3.0), 0.1, 30.0, 3.1)[1].deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert rolled(engine, Rolling(), 0.1, 30.0, 0.1, stop_speed=3.0)[1].deposits.outcome[0] == Outcome.LEFT_TERRAIN


@BOTH
def test_a_rock_that_rolls_across_a_slope_stops_at_stones_speed_before_it_turns_downhill(engine):
    """Friction cannot hold the rock, but the rock first rolls uphill and is below the stop speed before it turns."""
    descent, normal = down_the_slope(30.0)
    v = 2.0 * np.cross(normal, descent) - 4.0 * descent
    over = engine_over(engine, incline(30.0, cells=(7, 3)))
    for stop_speed, outcome in ((2.5, Outcome.STOPPED), (0.9, Outcome.LEFT_TERRAIN)):
        flights = fly(over, rolling(RollingStone(stop_speed), 0.2), 20.0 * descent, v)
        assert flights.deposits.outcome[0] == outcome
        if outcome == Outcome.STOPPED:
            assert np.linalg.norm(flights.paths.v_end[-2]) == pytest.approx(stop_speed, rel=1e-9)


@pytest.mark.parametrize("ground", [Rolling(), RollingStone(0.5)], ids=["Azzoni", "STONE"])
def test_both_engines_roll_alike_over_facets_and_through_gullies(ground):
    descent, normal = down_the_slope(25.0)
    terrains = (incline(25.0, cells=(20, 9), jitter=3, half_width=30.0), gully(40.0, 25.0, 10.0, cells=6))
    for terrain, x in zip(terrains, (5.0 * descent, np.array([1.0, 0.7, 3.0])), strict=True):
        v = np.outer(np.linspace(1, 9, 9), np.cross(normal, descent) - 0.4 * descent)
        one, other = (
            fly(engine_over(name, terrain), rolling(ground, 0.45, 0.3), np.tile(x, (9, 1)), v) for name in ENGINES
        )
        assert same_bits(one, other)
        assert set(one.deposits.outcome) <= {Outcome.STOPPED, Outcome.LEFT_TERRAIN}


@BOTH
def test_in_a_level_gully_a_rock_rolls_against_the_push_of_both_sides(engine):
    """With the normal forces N_1, N_2 per mass, the acceleration along the gully is 5/7 (g_line - mu_r (N_1 + N_2))."""
    over = engine_over(engine, gully(40.0, 40.0, 10.0))
    mu_r, dip = 0.3, math.radians(10.0)
    line = np.array([math.cos(dip), 0.0, -math.sin(dip)])
    end = fly(over, rolling(Rolling(), mu_r), (0.0, 0.0, 0.0), 6.0 * line).deposits
    sides = [np.cross(line, [0.0, s, math.tan(math.radians(40.0))]) for s in (1.0, -1.0)]
    normals = np.array([math.copysign(1.0, n[2]) * n / np.linalg.norm(n) for n in sides])
    gravity = np.array([0.0, 0.0, -G])
    pushes = np.linalg.lstsq(normals.T, -(gravity - (gravity @ line) * line), rcond=None)[0]
    a = 5 / 7 * (gravity @ line - mu_r * pushes.sum())
    assert end.x[0] @ line == pytest.approx(-36.0 / (2 * a), rel=OVER_EDGES)


def test_rolling_friction_may_be_drawn_and_disturbs_no_other_draw():
    over, x = engine_over("reference", floor(200.0)), np.tile([-9.0, 0.3, 1.0], (40, 1))
    ways = {}
    rocks, ones = np.arange(40), np.ones(40)
    v = np.tile([4.0, 0.0, 0.0], (40, 1))
    for name, drawn in (("fixed", fixed(0.4)), ("drawn", uniform_between(0.2, 0.8))):
        ground = DrawnSurface(uniform_between(0.3, 0.7), fixed(1.0), fixed(30.0), 0.0, False, drawn)
        physics = dataclasses.replace(rolling(Rolling(), 0.0), materials=drawn_materials([ground]))
        ways[name] = fly_ensemble(over, physics, Releases(0 * rocks, rocks, x, v, ones, ones))
    first = [flights.impacts.speed_out for flights in ways.values()]
    assert np.array_equal(*first), "restitution has a stream of its own"
    bounced = [flights.deposits.ground_speed for flights in ways.values()]
    assert np.array_equal(*bounced)
    ends = ways["drawn"].deposits.x[:, 0] - ways["fixed"].deposits.x[:, 0]
    assert np.all(ends != 0.0)


# --- scenes -----------------------------------------------------------------------------------------------------------

SCENE = """\
terrain: {{files: [{{path: slope.obj}}]}}
materials:
  default: {{normal_restitution: 0.5, tangential_restitution: 0.8{more}}}
sources: [{{name: crest, points: [[0.2, 0.2, 1]]}}]
ground: {ground}
"""


def scene_of(folder, ground, more=""):
    (folder / "slope.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "scene.yaml").write_text(SCENE.format(ground=ground, more=more))
    return read_scene(folder / "scene.yaml")


def test_a_scene_names_a_rolling_model_and_the_rolling_friction_of_its_materials(tmp_path):
    flight = prepare(scene_of(tmp_path, "rolling", ", rolling_friction: 0.45")).flight
    assert flight.models.ground == Rolling()
    assert flight.materials.mu_r[0] == 0.45
    flight = prepare(scene_of(tmp_path, "rolling_stone", ", rolling_friction: {uniform: [0.3, 0.6]}")).flight
    assert flight.models.ground == RollingStone(3.0)
    flight = prepare(scene_of(tmp_path, "{rolling_stone: {stop_speed: 1}}", ", rolling_friction: 0.4")).flight
    assert flight.models.ground == RollingStone(1.0)


def test_a_scene_names_the_sphere_and_flies_it(tmp_path):
    named = "sphere\nrock: {shape: sphere}\ncontact: {coulomb_sphere: {tangential_restitution: 0.9}}"
    scene = scene_of(tmp_path, named, ", rolling_friction: 0.4")
    flight = prepare(scene).flight
    assert flight.models == Models(CoulombSphere(MATERIALS_OWN, 0.9), SphereGround())
    assert flight.materials.mu_r[0] == 0.4
    flights = simulate(scene)
    assert flights.flights.deposits.outcome[0] in (Outcome.LEFT_TERRAIN, Outcome.STOPPED)


SPHERE_WITH = "rock: {shape: sphere}\ncontact: {coulomb_sphere: "


@pytest.mark.parametrize(
    ("ground", "words"),
    [
        ("sphere", "`ground` is sphere, which needs `rock.shape: sphere`"),
        ("sliding\nrock: {shape: sphere}", "`ground` is sliding, but `rock.shape: sphere` goes with none or sphere"),
        ("sphere\nrebound: coulomb_sphere", "`rebound` names coulomb_sphere, but a sphere is a shape: give `rock: {"),
        ("none\nrebound: {coulomb_sphere: {}}", "parameters in `contact: {coulomb_sphere: ...}`"),
        ("none\nrock: {shape: sphere}\nrebound: constant", "`rebound` is for points; spheres have `contact: coulomb"),
        ("none\nrock: {shape: sphere}\ncontact: rigid", "`contact` is rigid, but the shape of the rocks goes"),
        ("none\nrock: {shape: {box: [1, 1, 1]}}\ncontact: coulomb_sphere", "is coulomb_sphere, but the shape of the"),
        ("none\ncontact: coulomb_sphere", "is for spheres and rocks with a shape, and `rock.shape` is point"),
        ("none\n" + SPHERE_WITH + "{damping: 0.9}}", "contact.coulomb_sphere.damping` is not a parameter: a"),
        ("none\n" + SPHERE_WITH + "{damping: 1}}", "Give `rolling_friction` in `materials` instead, a loss"),
        ("none\n" + SPHERE_WITH + "{impact_friction: -1}}", "impact_friction` is -1, but must be a number >= 0"),
        (
            "none\nrock: {shape: sphere}\nmethod: {stepping: {dt: 1e-3, threshold: 0.05}}",
            "`method.stepping` finds contacts of points, but `rock.shape` has a size",
        ),
    ],
)
def test_what_does_not_go_with_the_sphere_is_refused_with_the_key_named(tmp_path, ground, words):
    with pytest.raises(SceneError, match=r"scene\.yaml") as caught:
        scene_of(tmp_path, ground)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("ground", "more", "words"),
    [
        ("rolling", "", "`materials.default.rolling_friction` is not given, but `ground: rolling` needs it"),
        ("rolling_stone", "", "`materials.default.rolling_friction` is not given, but `ground: rolling_stone`"),
        ("rolling", ", rolling_friction: -0.1", "`materials.default.rolling_friction` is -0.1, but must be"),
        ("{rolling_stone: {stop_speed: -1}}", ", rolling_friction: 0.4", "stop_speed` is -1, but must be"),
    ],
)
def test_a_rolling_model_without_what_it_needs_is_refused_with_the_key_named(tmp_path, ground, more, words):
    with pytest.raises(SceneError, match=r"scene\.yaml") as caught:
        scene_of(tmp_path, ground, more)
    assert words in str(caught.value)
