"""Tests of the fixed-step method: order of convergence, biases, agreement with events, and failures."""

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
    incline,
    rough_grid,
    surface,
)

from rpf3d_core.accuracy import numerical
from rpf3d_core.accuracy.flown import flight_seconds, spread
from rpf3d_core.accuracy.numerical import Steps
from rpf3d_core.arc import Arc, position, time_over
from rpf3d_core.detection.closest import closest_facet, closest_point, distance_to_facet
from rpf3d_core.detection.contact import plain_locator
from rpf3d_core.effects.drag_layer import DragLayer
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.simulation.engines import Engine, stepping
from rpf3d_core.simulation.parabola import height_for_effects
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import STANDARD_GRAVITY, Outcome

G = STANDARD_GRAVITY
UP = np.array([0.0, 0.0, 1.0])
STEPS = (0.02, 0.01, 0.005, 0.0025, 0.00125, 0.000625)
"""Time steps (s), with a factor of 32 between the first and the last."""
FASTEST = 20.0
"""Speed (m/s) that no rock of these tests exceeds, so that no rock skips a threshold of FASTEST * dt."""
ORDER = 1.0
ORDER_WITHIN = 0.1
"""Tolerance of the fitted order of convergence: the mean errors of 64 rocks scatter by about a tenth."""
ROCKS = 64
ROUNDING = 1e-9
"""Largest rounding error (m) of closed forms of some metres."""


def stepped_over(name: str, terrain, dt: float, threshold: float, **how) -> Engine:
    return stepping(engine_over(name, terrain), dt, threshold, **how)


def drops() -> tuple[np.ndarray, np.ndarray]:
    """Return positions (R, 3) m and velocities (R, 3) m/s of rocks that land at different fractions of a step."""
    k = np.arange(ROCKS)
    golden = (k * 0.6180339887) % 1.0
    x = np.stack([-2.0 + golden, np.linspace(-1.0, 1.0, ROCKS), 4.0 + 6.0 * ((k * 0.7548776662) % 1.0)], 1)
    v = np.stack([1.0 + 2.0 * golden, np.zeros(ROCKS), 2.0 * golden - 1.0], 1)
    return x, v


def first_impacts(engine: Engine, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    impacts = fly(engine, flight(surface()), x, v).impacts
    rows, first = np.unique(impacts.row, return_index=True)
    assert len(rows) == len(x), "every rock meets the ground"
    return impacts.x[first]


def on_plane_through_origin(normal: np.ndarray, x: np.ndarray, v: np.ndarray, height: float = 0.0) -> np.ndarray:
    """Return the places (R, 3) m where parabolas reach `height` (m) above a plane through the origin."""
    a, b, c = -0.5 * G * normal[2], v @ normal, x @ normal - height
    t = (-b - np.sqrt(b * b - 4 * a * c)) / (2 * a)
    return x + v * t[:, None] - 0.5 * G * (t**2)[:, None] * UP


@pytest.mark.long
@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("angle", [0.0, 35.0])
def test_the_first_impact_converges_with_order_one_where_the_threshold_shrinks_with_the_step(
    name: str, angle: float
) -> None:
    terrain = incline(angle, half_width=20.0)
    x, v = drops()
    exact = on_plane_through_origin(down_the_slope(angle)[1], x, v)
    errors = [
        np.linalg.norm(first_impacts(stepped_over(name, terrain, dt, FASTEST * dt), x, v) - exact, axis=1).mean()
        for dt in STEPS
    ]
    slope = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert slope == pytest.approx(ORDER, abs=ORDER_WITHIN), errors


@pytest.mark.parametrize("name", ENGINES)
def test_a_fixed_threshold_leaves_a_bias_that_no_step_removes(name: str) -> None:
    threshold, dt, normal = 0.1, 1e-4, UP
    x, v = drops()
    found = first_impacts(stepped_over(name, floor(), dt, threshold), x, v)
    early = on_plane_through_origin(normal, x, v, height=threshold)
    exact = on_plane_through_origin(normal, x, v)
    a_step = FASTEST * dt
    assert np.abs(found - early).max() < a_step
    bias = np.linalg.norm(early - exact, axis=1)
    assert np.linalg.norm(found - exact, axis=1) == pytest.approx(bias, abs=a_step)
    assert bias.min() >= threshold


@pytest.mark.parametrize("name", ENGINES)
def test_comparing_the_squared_distance_is_a_threshold_of_its_square_root(name: str) -> None:
    x, v = drops()
    terrain = incline(20.0, half_width=20.0)
    literal = fly(stepped_over(name, terrain, 1e-3, 0.05, squared=True), flight(surface()), x, v)
    root = fly(stepped_over(name, terrain, 1e-3, math.sqrt(0.05)), flight(surface()), x, v)
    plain = fly(stepped_over(name, terrain, 1e-3, 0.05), flight(surface()), x, v)
    np.testing.assert_array_equal(literal.impacts.x, root.impacts.x)
    above = first_impacts(stepped_over(name, floor(), 1e-4, 0.05, squared=True), x, v)[:, 2]
    assert above.min() > 0.2, "0.05 means 0.22 m"
    assert not np.array_equal(literal.impacts.x[:ROCKS], plain.impacts.x[:ROCKS])


@pytest.mark.parametrize("name", ENGINES)
def test_steps_that_are_passed_over_unseen_change_no_bit(name: str) -> None:
    terrain = rough_grid(6, 12.0, 0.4, 0.3, seed=3, centred=True)
    x, v = drops()
    both = [
        fly(stepped_over(name, terrain, 4e-3, 0.1, every_step=every), flight(surface()), x[:16] + 3.0 * UP, v[:16])
        for every in (False, True)
    ]
    np.testing.assert_array_equal(both[0].paths.x, both[1].paths.x)
    np.testing.assert_array_equal(both[0].deposits.outcome, both[1].deposits.outcome)


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("model", ["none", "sliding"])
def test_every_rock_has_an_outcome_of_the_one_loop_and_a_position_that_is_a_number(name: str, model: str) -> None:
    terrain = rough_grid(8, 16.0, 0.5, 0.5, seed=5, centred=True)
    x, v = drops()
    for dt, threshold in ((0.1, 0.5), (0.01, 0.05), (1e-3, 0.005)):
        deposits = fly(stepped_over(name, terrain, dt, threshold), flight(surface(), model), x + 5.0 * UP, v).deposits
        ends = (Outcome.STOPPED, Outcome.LEFT_TERRAIN, Outcome.UNRESOLVED_CONTACT, Outcome.MAX_IMPACTS)
        assert np.isin(deposits.outcome, ends).all()
        assert np.isfinite(deposits.x).all() and np.isfinite(deposits.t).all()


@pytest.mark.parametrize("name", ENGINES)
def test_a_step_longer_than_the_threshold_tunnels_through_the_ground(name: str) -> None:
    x, v = drops()
    through = fly(stepped_over(name, floor(), 0.1, 0.05), flight(surface()), x, v).deposits
    lost = through.outcome == Outcome.LEFT_TERRAIN
    assert lost.mean() > 0.5, "at 10 m/s a step is 1 m, ten times the band of 2 x 0.05 m"
    held = fly(stepped_over(name, floor(), 1e-3, 0.05), flight(surface()), x, v).deposits
    assert (held.outcome == Outcome.STOPPED).all()


@pytest.mark.parametrize("name", ENGINES)
def test_effects_have_the_exact_height_above_the_ground_whatever_the_steps_are(name: str) -> None:
    layer = DragLayer(coefficient=500.0, height=2.0, accuracy=0.01, gravity=G, edges=np.empty((0, 4)))
    engine = stepped_over(name, floor(), 0.1, 0.05, squared=True)
    for z in (0.1, 1.99, 2.01, 30.0):
        height = height_for_effects(layer, plain_locator(engine.method), engine.facets, (0.3, 0.2, z))
        assert height == pytest.approx(z, abs=ROUNDING)


@pytest.mark.parametrize("name", ENGINES)
def test_fine_steps_come_to_where_events_come(name: str) -> None:
    terrain = incline(25.0, half_width=20.0)
    x, v = drops()
    physics = flight(surface())
    exact = fly(engine_over(name, terrain), physics, x, v).deposits
    fine = fly(stepped_over(name, terrain, 1e-5, 5e-4), physics, x, v).deposits
    assert (exact.outcome == fine.outcome).all()
    off = np.linalg.norm(exact.x - fine.x, axis=1)
    assert off.max() < 0.02, "some bounces, each off by a threshold or so over the sine of the angle"


def test_both_engines_step_alike_where_no_two_facets_are_equally_close() -> None:
    terrain = rough_grid(6, 12.0, 0.3, 0.4, seed=8, centred=True)
    x, v = drops()
    reference, compiled = (
        fly(stepped_over(name, terrain, 2e-3, 0.05), flight(surface()), x + 3.0 * UP, v).deposits for name in ENGINES
    )
    same = (reference.x == compiled.x).all(axis=1)
    assert same.mean() > 0.9, "which of two equally close facets VTK names is its own choice"


def test_the_price_of_steps_is_that_of_one_for_the_steps_of_all_rocks(monkeypatch: pytest.MonkeyPatch) -> None:
    class Case:
        engine, flight = engine_over("reference", floor()), flight(surface())

    x, v = drops()
    nothing = np.zeros(ROCKS)
    releases = Releases(nothing.astype(int), np.arange(ROCKS), x, v, nothing, nothing)
    setting, steps = Steps(0.01, 0.3), 500.0
    flown = taken(releases, spread(np.arange(ROCKS), numerical.TIMED_ROCKS))
    aloft = flight_seconds(fly(stepping(Case.engine, 0.01, 0.3), Case.flight, flown.x, flown.v))
    clock = iter([1.0, 3.0])
    monkeypatch.setattr(numerical.time, "process_time", lambda: next(clock))
    price = numerical.price_of(Case(), releases, setting, steps, 1e-9)
    assert price.by_clock and price.step == pytest.approx(2.0 * 0.01 / aloft)
    assert price.seconds_per_1000 == pytest.approx(1000 * steps * price.step)
    counted = numerical.price_of(Case(), releases, setting, steps, 1.0)
    assert counted == (1000 * steps, 1.0, False), "a rock that takes longer than the budget is not flown"


@pytest.mark.parametrize("seed", range(5))
def test_the_closest_facet_is_that_of_trying_all_points_of_all_facets(seed: int) -> None:
    engines = [engine_over(name, rough_grid(5, 10.0, 0.5, 1.0, seed=seed, centred=True)) for name in ENGINES]
    stepping(engines[0], 0.1, 0.1)  # the loop contains VTK's rule
    facets: Facets = engines[1].facets
    for x in np.random.default_rng(seed).uniform(-4, 4, (40, 3)):
        point = (float(x[0]), float(x[1]), float(x[2]))
        distances = [distance_to_facet(facets, f, point) for f in range(len(facets.zone))]
        for engine in engines:
            found = closest_facet(engine.locator, facets, point, 50.0)
            assert found.distance == pytest.approx(min(distances), abs=ROUNDING)
            assert distances[found.facet] == pytest.approx(min(distances), abs=ROUNDING)
            none = closest_facet(engine.locator, facets, point, 0.5 * min(distances))
            assert none.facet == -1 and none.distance == 0.5 * min(distances)


def test_the_closest_point_of_a_facet_beats_a_fine_net_of_its_points() -> None:
    facets = engine_over("compiled", rough_grid(1, 2.0, 0.5, 1.0, seed=4)).facets
    a, b, c = np.asarray(facets.corners)[0].reshape(3, 3)
    weights = np.array([(i, j) for i in range(41) for j in range(41 - i)]) / 40.0
    net = a + weights[:, :1] * (b - a) + weights[:, 1:] * (c - a)
    spacing = 2.0 * np.linalg.norm([b - a, c - a], axis=1).max() / 40.0
    for x in np.random.default_rng(4).uniform(-2, 4, (200, 3)):
        nearest = np.linalg.norm(net - x, axis=1).min()
        found = np.array(closest_point(facets, 0, tuple(x)))
        assert np.linalg.norm(found - x) <= nearest + ROUNDING
        assert np.linalg.norm(found - x) >= nearest - spacing


def test_no_arc_goes_further_than_promised_within_the_time_told() -> None:
    arc = Arc((0.0, 0.0, 0.0), (3.0, -1.0, 4.0), G)
    for begin in (0.0, 0.3, 2.0):
        until = time_over(arc, begin, 0.7)
        points = np.array([position(arc, t) for t in np.linspace(begin, until, 2001)])
        assert 0.0 < np.linalg.norm(np.diff(points, axis=0), axis=1).sum() <= 0.7
