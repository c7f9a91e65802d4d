"""Tests of nets and fences, by the rule in docs/explanation/physics.md: rocks are caught, break through or fly over."""

import math

import numpy as np
import pytest
from flights import scenes_of_facets as made
from flights.obstacles_made import MASS, RADIUS, energy_of, fence, fences, rough_ground, thrown, with_effects
from flights.on_both_engines import BOTH, loses_energy
from flights.rolling_spheres import roll, spheres
from scenes import small_pit

from rpf3d_core.kinetics.sphere_ground import TURN
from rpf3d_core.materials.library import Surface
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.builders.barriers import barriers_of
from rpf3d_core.simulation import capped
from rpf3d_core.simulation.record import FIRST_OBSTACLE
from rpf3d_core.values import Mode, Outcome

EXACT = 1e-12
"""Largest relative rounding error of one formula."""
LINE = [(0.0, -8.0), (0.0, 8.0)]
G = 9.81


def over_a_floor(engine, x, v, *effects, model="sliding", friction=30.0):
    """Fly rocks from x (m) with v (m/s) over a level floor with effects. friction : friction angle (degrees)"""
    physics = made.flight(made.surface(0.5, 0.8, friction), model)
    return made.fly(made.engine_over(engine, made.floor(cells=10)), with_effects(physics, *effects), x, v)


def met(flights):
    return flights.impacts.facet < 0


@pytest.mark.long
@BOTH
@pytest.mark.parametrize("share", [1.0, 2.0])
def test_a_rock_with_no_more_energy_than_the_net_holds_is_caught_where_it_struck(engine, share):
    t = 0.2
    energy = energy_of(math.hypot(10.0, G * t))
    net = fence(made.floor(cells=10), LINE, 3.0, share * energy * (1.0 + EXACT))
    flights = over_a_floor(engine, (-2.0, 0.5, 2.0), (10.0, 0.0, 0.0), net)
    assert flights.deposits.outcome[0] == Outcome.CAUGHT
    np.testing.assert_allclose(flights.deposits.x[0], (0.0, 0.5, 2.0 - 0.5 * G * t * t), atol=EXACT * 100)
    assert flights.deposits.impacts[0] == 0 and met(flights).tolist() == [True]
    assert flights.impacts.speed_out.tolist() == [0.0]


@BOTH
def test_a_caught_rock_is_told_to_lie_on_the_facet_below_the_net_that_it_never_touched(engine):
    terrain = made.floor(cells=10)
    flights = over_a_floor(engine, (-2.0, 0.5, 2.0), (10.0, 0.0, 0.0), fence(terrain, LINE, 3.0, 1e6))
    corners = terrain.vertices[terrain.triangles[flights.deposits.facet[0]]]
    assert corners[:, 0].min() <= 0.0 <= corners[:, 0].max() and corners[:, 1].min() <= 0.5 <= corners[:, 1].max()


@BOTH
@pytest.mark.parametrize("taken", [1.0, 0.4])
def test_a_rock_that_breaks_through_keeps_its_direction_and_the_energy_that_is_left(engine, taken):
    t, capacity = 0.2, 20e3
    before = np.array([10.0, 0.0, -G * t])
    net = fence(made.floor(cells=10), LINE, 3.0, capacity, taken)
    flights = over_a_floor(engine, (-2.0, 0.5, 2.0), (10.0, 0.0, 0.0), net)
    after = flights.paths.v[1]
    left = energy_of(np.linalg.norm(before)) - taken * capacity
    assert energy_of(np.linalg.norm(after)) == pytest.approx(left, rel=EXACT)
    np.testing.assert_allclose(np.cross(after, before), 0.0, atol=1e-10)
    assert met(flights).sum() == 1, "it is past the net, and meets it no more"


@BOTH
def test_a_rock_that_flies_over_is_not_changed_in_its_last_bit(engine):
    x, v = (-2.0, 0.5, 5.0), (10.0, 0.3, 3.0)
    without = over_a_floor(engine, x, v)
    assert made.same_bits(without, over_a_floor(engine, x, v, fence(made.floor(cells=10), LINE, 3.0, 1e9)))


@BOTH
@pytest.mark.parametrize(("height", "capacity"), [(0.0, 1e9), (50.0, 0.0), (0.0, 0.0)])
def test_a_panel_without_height_or_strength_leaves_every_bit_of_a_flight(engine, height, capacity):
    x, v = thrown(20)
    physics, terrain = made.flight(made.surface(0.5, 0.8, 25.0)), rough_ground()
    effect = fence(terrain, [(20.0, -8.0), (20.0, 8.0)], height, capacity)
    flown = [made.fly(made.engine_over(engine, terrain), p, x, v) for p in (physics, with_effects(physics, effect))]
    assert made.same_bits(*flown)


@BOTH
def test_the_top_of_the_block_counts_where_the_scene_says_so(engine):
    t = 0.2
    height = 2.0 - 0.5 * G * t * t + 0.5 * RADIUS
    terrain = made.floor(cells=10)
    found = [
        over_a_floor(engine, (-2.0, 0.5, 2.0), (10.0, 0.0, 0.0), fence(terrain, LINE, height, 1e9, top=top))
        for top in (False, True)
    ]
    assert [flights.deposits.outcome[0] == Outcome.CAUGHT for flights in found] == [True, False]


@BOTH
@pytest.mark.parametrize("x", [0.0, 1.0, 0.3], ids=["along the edges of facets", "within facets", "anywhere"])
def test_a_sliding_rock_is_caught_on_the_ground_at_the_panel(engine, x):
    terrain = made.floor(cells=10)
    flights = over_a_floor(
        engine, (-5.0, 0.5, 0.0), (9.0, 0.0, 0.0), fence(terrain, [(x, -8.0), (x, 8.0)], 2.0, 1e9), friction=5.0
    )
    assert flights.deposits.outcome[0] == Outcome.CAUGHT
    np.testing.assert_allclose(flights.deposits.x[0], (x, 0.5, 0.0), atol=1e-9)
    deceleration = math.tan(math.radians(5.0)) * G
    assert flights.impacts.speed_in[met(flights)][0] == pytest.approx(math.sqrt(81 - 2 * deceleration * (5 + x)))


@BOTH
def test_a_sliding_rock_that_breaks_through_goes_on_sliding_with_what_is_left(engine):
    terrain, capacity = made.floor(cells=10), 15e3
    net = fence(terrain, LINE, 2.0, capacity)
    flights = over_a_floor(engine, (-5.0, 0.5, 0.0), (9.0, 0.0, 0.0), net, friction=10.0)
    friction = math.tan(math.radians(10.0)) * G
    left = 0.5 * MASS * (81.0 - 2 * friction * 5.0) - capacity
    stop = flights.deposits.x[0]
    assert met(flights).sum() == 1 and flights.deposits.outcome[0] == Outcome.STOPPED
    assert stop[0] == pytest.approx((2 * left / MASS - 0.25) / (2 * friction), rel=1e-9)
    assert stop[1:] == pytest.approx([0.5, 0.0], abs=1e-12)


@pytest.mark.long
@BOTH
def test_bounces_that_are_summed_up_end_at_a_panel_in_their_way(engine):
    terrain = made.floor(cells=1)
    free = over_a_floor(engine, (-3.0, 0.0, 0.02), (12.0, 0.0, 0.0), model="none")
    settling = np.flatnonzero(free.paths.mode == Mode.SETTLING)[0]
    middle = 0.5 * (free.paths.x[settling, 0] + free.paths.x[settling + 1, 0])
    net = fence(terrain, [(middle, -8.0), (middle, 8.0)], 2.0, 1e9)
    flights = over_a_floor(engine, (-3.0, 0.0, 0.02), (12.0, 0.0, 0.0), net, model="none")
    assert flights.deposits.outcome[0] == Outcome.CAUGHT
    assert flights.deposits.x[0, 0] == pytest.approx(middle, abs=1e-9)


@BOTH
def test_no_rock_of_a_hundred_gets_through_a_net_that_holds_everything(engine):
    x, v = thrown(100 if engine == "compiled" else 30)
    terrain = rough_ground()
    physics = made.flight(made.surface(0.5, 0.8, 25.0))
    free = made.fly(made.engine_over(engine, terrain), physics, x, v)
    net = fence(terrain, [(18.0, -8.0), (20.0, 0.0), (18.0, 8.0)], 100.0, 1e12)
    flights = made.fly(made.engine_over(engine, terrain), with_effects(physics, net), x, v)
    went = (free.deposits.x[:, 0] > 25.0) & (np.abs(free.deposits.x[:, 1]) < 7.9)
    assert went.sum() > 10 and (flights.deposits.outcome[went] == Outcome.CAUGHT).all()
    assert (flights.deposits.x[flights.deposits.outcome == Outcome.CAUGHT][:, 0] < 20.0 + 1e-9).all()


@BOTH
def test_a_rock_that_goes_through_a_corner_breaks_one_side_of_it(engine):
    corner = [(-4.0, -8.0), (0.0, 0.0), (-4.0, 8.0)]
    net = fence(made.floor(cells=10), corner, 3.0, 10e3)
    flights = over_a_floor(engine, (-2.0, 0.0, 2.0), (10.0, 0.0, 0.0), net)
    assert met(flights).sum() == 1


@BOTH
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("height", [2.0, 0.0], ids=["in flight", "on the ground"])
@pytest.mark.parametrize("turned", [False, True], ids=["alike", "drawn the other way round"])
def test_a_rock_that_breaks_through_nets_that_stand_in_one_place_breaks_each_of_them_once(
    engine, count, height, turned
):
    terrain, capacity = made.floor(cells=10), 4e3
    lines = [[(0.7, -7.9), (0.1, 8.0)], [(0.1, 8.0), (0.7, -7.9)] if turned else [(0.7, -7.9), (0.1, 8.0)]]
    nets = fences(*(fence(terrain, lines[k % 2], 3.0, capacity) for k in range(count)))
    flights = over_a_floor(engine, (-2.0, 0.5, height), (10.0, 0.0, 0.0), nets, friction=0.0)
    numbers = FIRST_OBSTACLE - flights.impacts.facet[met(flights)]
    assert sorted(nets.panel.barrier[numbers]) == list(range(count))
    speeds = flights.impacts.speed_in[met(flights)][0], flights.impacts.speed_out[met(flights)][-1]
    assert energy_of(speeds[0]) - energy_of(speeds[1]) == pytest.approx(count * capacity, rel=1e-9)


@BOTH
@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("before", [-0.5, 0.5], ids=["behind the nets", "before the nets"])
def test_a_rock_that_lands_at_the_foot_of_nets_in_one_place_meets_each_of_them_once(engine, count, before):
    """The rock flies at 15 degrees to the nets; it lands half a slack from them, two slacks from its crossing."""
    terrain, capacity, t, v = made.floor(cells=10), 4e3, 0.4, 10.0
    net = fence(terrain, [(0.0, -7.9), (0.0, 8.0)], 3.0, capacity)
    heading = np.array([math.sin(0.25), math.cos(0.25), 0.0])
    x = np.array([-before * net.slack, 0.3, 0.5 * G * t * t]) - v * t * heading
    flights = over_a_floor(engine, x, v * heading, fences(*[net] * count), friction=0.0)
    landing = met(flights).tolist().index(False)
    assert abs(flights.impacts.x[landing, 0]) < net.slack
    numbers = FIRST_OBSTACLE - flights.impacts.facet[met(flights)]
    panels = fences(*[net] * count).panel
    assert panels.barrier[numbers].tolist() == list(range(count))


@BOTH
@pytest.mark.parametrize("turned", [False, True])
def test_a_rock_meets_both_of_two_nets_that_cross_within_the_slack_of_its_path(engine, turned):
    """The rock crosses one net while it is within the slack of the other, which it crosses three slacks later."""
    terrain, capacity = made.floor(cells=10), 4e3
    across = fence(terrain, [(-8.0, 0.0), (8.0, 0.0)], 3.0, capacity)
    along = fence(terrain, [(0.0, -7.9), (0.0, 8.0)], 3.0, capacity)
    heading = np.array([math.sin(0.25), math.cos(0.25), 0.0])
    x = np.array([-0.75 * across.slack, 0.0, 1.5]) - 2.0 * heading
    nets = fences(along, across) if turned else fences(across, along)
    flights = over_a_floor(engine, x, 10.0 * heading, nets, friction=0.0)
    numbers = FIRST_OBSTACLE - flights.impacts.facet[met(flights)]
    assert sorted(nets.panel.barrier[numbers]) == [0, 1]


@BOTH
@pytest.mark.parametrize("places", [(0.0, 0.95, 1.9), (1.9, 0.95, 0.0), (0.95, 0.0, 1.9), (0.6, 1.2, 0.0, 1.8)])
def test_a_rock_meets_nets_once_each_that_are_nearer_to_each_other_than_the_slack_by_pairs_only(
    tmp_path, engine, places
):
    """The nets are parallel; each is within the slack of the next, but not of all. places : positions (slacks)"""
    terrain = made.floor(cells=10)
    slack = fence(terrain, LINE, 3.0, 1e3).slack
    panels = ", ".join(
        f"{{name: net{k}, along: [[{place * slack!r}, -8], [{place * slack!r}, 8]], height: 3, capacity_kj: 1}}"
        for k, place in enumerate(places)
    )
    scene = read_scene(small_pit.scene_file(tmp_path, more=f"effects: {{barriers: {{panels: [{panels}]}}}}"))
    nets = barriers_of(scene.effects.barriers, scene, terrain)
    for heading in (10.0, -10.0):
        flights = over_a_floor(engine, (-0.2 * heading, 0.5, 1.5), (heading, 1.0, 0.0), nets)
        numbers = FIRST_OBSTACLE - flights.impacts.facet[met(flights)]
        assert sorted(nets.panel.barrier[numbers]) == list(range(len(places)))


@BOTH
def test_a_net_that_stands_elsewhere_lets_no_rock_past_the_one_before_it(engine):
    """A rock flies along a net, breaks a second net across its way, and lands at the foot of the first net."""
    terrain = made.strip([(-10.0, 3.0), (10.0, -3.0)], half_width=20.0)
    along = fence(terrain, [(2.0, -19.0), (2.0, 19.0)], 1.5, 1e9)
    across = fence(terrain, [(-8.0, -8.0), (8.0, -8.0)], 15.0, 1e3)
    physics = with_effects(made.flight(made.surface(0.5, 0.8, 30.0)), fences(along, across))
    flights = made.fly(made.engine_over(engine, terrain), physics, (2.0, -12.0, 8.0), (0.0, 10.0, 0.0))
    first, second, third = flights.impacts.facet
    assert first < 0 <= second and flights.impacts.x[1][0] == 2.0, "through the net across, then onto the ground"
    assert third < 0 and flights.deposits.outcome[0] == Outcome.CAUGHT


def test_both_engines_meet_the_same_panels_to_the_last_bit():
    x, v = thrown(60)
    terrain, physics = rough_ground(), made.flight(made.surface(0.5, 0.8, 25.0))
    net = fence(terrain, [(15.0, -8.0), (20.0, 0.0), (15.0, 8.0)], 3.0, 20e3, 0.7, top=True)
    one, other = (
        made.fly(made.engine_over(engine, terrain), with_effects(physics, net), x, v) for engine in made.ENGINES
    )
    assert met(one).sum() > 20 and made.same_bits(one, other)
    assert loses_energy(one)


def test_numbers_of_obstacles_go_on_from_one_effect_to_the_next():
    terrain = made.floor(cells=10)
    far, near = fence(terrain, [(3.0, -8.0), (3.0, 8.0)], 3.0, 1e9), fence(terrain, LINE, 3.0, 10e3)
    near = near._replace(first=far.obstacles)
    flights = over_a_floor("reference", (-2.0, 0.5, 2.0), (10.0, 0.0, 0.0), far, near)
    numbers = FIRST_OBSTACLE - flights.impacts.facet[met(flights)]
    assert numbers[0] >= far.obstacles > numbers[1] >= 0
    assert flights.deposits.x[0, 0] == pytest.approx(3.0, abs=1e-9)


@BOTH
def test_a_sphere_that_rolls_back_to_a_net_that_it_broke_through_meets_the_net_again(engine):
    """The sphere rolls uphill through a net of 40 kJ, turns, and returns with less energy, so the net catches it."""
    slope = made.rough_grid(1, 40.0, 0.5, 0.0)
    physics = spheres(Surface(0.0, 0.9, math.tan(math.radians(40.0)), 0.5, 0.05))
    net = fence(slope, [(25.0, 1.0), (25.0, 39.0)], 5.0, 40e3)
    up = (30.0, 20.0, -15.0 + 0.5 * math.hypot(1.0, 0.5) + 1e-3)
    flights = roll(made.engine_over(engine, slope), with_effects(physics, net), 0.5, up, (-14.3, 0.0, 7.15))
    assert flights.deposits.outcome[0] == Outcome.CAUGHT and met(flights).sum() == 2
    np.testing.assert_allclose(flights.deposits.x[0, 0], 25.0, atol=1e-9)


@BOTH
def test_a_rock_that_settles_behind_a_net_that_it_broke_through_meets_the_net_again(engine):
    """The rock breaks the net where it lands; its summed bounces end uphill of the net, and it slides back."""
    slope, physics = made.rough_grid(1, 40.0, 0.5, 0.0), made.flight(made.surface(0.5, 1.0, 10.0), smallest_bounce=0.5)
    uphill = (26.0, 20.0, -12.5), (-4.0, 0.0, 0.0)
    landing = made.fly(made.engine_over(engine, slope), physics, *uphill).impacts.x[0, 0]
    net = fence(slope, [(landing, 1.0), (landing, 39.0)], 5.0, 1.0)
    flights = made.fly(made.engine_over(engine, slope), with_effects(physics, net), *uphill)
    (settling,) = np.flatnonzero(flights.paths.mode == Mode.SETTLING)
    x, v = flights.paths.x[settling + 1, 0], flights.paths.v[settling + 1, 0]
    assert x < landing - 0.5 and v > 0.0, "behind the net, on its way back to it"
    np.testing.assert_allclose(flights.impacts.x[met(flights), 0], [landing, landing], atol=1e-9)


@BOTH
@pytest.mark.parametrize("mu", [0.0, 2.0], ids=["skids without friction", "rolls"])
@pytest.mark.parametrize("across", [0.0, 3.0])
def test_a_sphere_that_turns_back_on_one_facet_meets_the_net_on_its_way_up(engine, mu, across):
    """Without rolling friction, the whole way up and down again is one parabola."""
    slope = made.rough_grid(1, 40.0, 0.5, 0.0)
    physics = spheres(Surface(0.0, 0.9, mu, 0.0, 0.0))
    net = fence(slope, [(25.0, 1.0), (25.0, 39.0)], 5.0, math.inf)
    up = (30.0, 5.0, -15.0 + 0.5 * math.hypot(1.0, 0.5) + 1e-3)
    flights = roll(made.engine_over(engine, slope), with_effects(physics, net), 0.5, up, (-15.0, across, 7.5))
    assert flights.deposits.outcome[0] == Outcome.CAUGHT and met(flights).sum() == 1
    np.testing.assert_allclose(flights.deposits.x[0, 0], 25.0, atol=1e-9)
    assert flights.paths.v[-2][0] < -5.0, "uphill"
    if mu == 0.0:  # the velocity across does not change, the velocity along has the acceleration of gravity
        pull = 9.81 * math.sin(math.atan(0.5))
        speed, way = 15.0 * math.hypot(1.0, 0.5), 5.0 * math.hypot(1.0, 0.5)
        t = (speed - math.sqrt(speed * speed - 2.0 * pull * way)) / pull
        chord = TURN / 8.0 * 0.5 * speed * speed / pull  # largest distance (m) of the parabola from its chords
        np.testing.assert_allclose(flights.deposits.x[0, 1], 5.0 + across * t, atol=chord)


@BOTH
def test_a_rolling_sphere_has_the_spin_of_rolling_when_it_breaks_through_a_net(engine):
    """The sphere rolls 2 m from rest, on one facet, to a net of 1 J."""
    slope, radius, start = made.rough_grid(1, 100.0, 0.5, 0.0), 0.5, 5.0
    physics = spheres(Surface(0.0, 0.8, 1.0, 0.05, 0.05), max_time=100.0)
    net = fence(slope, [(7.0, 10.0), (7.0, 90.0)], 5.0, 1.0)
    up = math.hypot(1.0, 0.5)
    x = (start + radius * 0.5 / up, 50.0, -0.5 * start + radius / up)
    flights = roll(made.engine_over(engine, slope), with_effects(physics, net), radius, x)
    (at,) = np.flatnonzero(met(flights))
    assert flights.impacts.x[at, 0] == pytest.approx(7.0, abs=1e-9)
    assert flights.impacts.spin_in[at] == pytest.approx(flights.impacts.speed_in[at] / radius, rel=1e-6)


@BOTH
@pytest.mark.parametrize("before", [0.1, 0.5, 1.0])
def test_a_sphere_that_rolls_off_the_terrain_is_caught_by_a_net_before_its_border(engine, before):
    """The centre is ahead of the contact, so the segment to the net may also pass the border.

    before : distance (m) of the net from the border
    """
    level = made.rough_grid(10, 20.0, 0.36, 0.0)
    slope = made.terrain_of(made.turned(level.vertices, 30.0), level.triangles)
    ends = made.turned(np.array([[20.0 - before, 0.2, 0.0], [20.0 - before, 19.8, 0.0]]), 30.0)[:, :2]
    net = fence(slope, [tuple(end) for end in ends], 5.0, 1e8)
    y = np.linspace(4.0, 16.0, 7)
    on_slope = np.column_stack([np.full(7, 8.0), y, np.full(7, -8.0 * 0.36)])
    on_slope += 0.25 / math.hypot(1.0, 0.36) * np.array([0.36, 0.0, 1.0])
    physics = with_effects(spheres(Surface(0.3, 0.8, 0.7, 0.5, 0.1)), net)
    flights = roll(capped.engine_over(engine, slope), physics, 0.25, made.turned(on_slope, 30.0))
    assert (flights.deposits.outcome == Outcome.CAUGHT).all()


def test_the_foot_of_a_net_follows_the_higher_of_two_grounds_that_pass_through_each_other():
    slope = made.rough_grid(1, 40.0, 0.5, 0.0)
    tilt = np.array([[5.0, 5.0], [35.0, 35.0]]), np.array([[5.0, 35.0], [5.0, 35.0]])
    heap = np.stack([*tilt, -0.5 * tilt[0] + 0.4 * (tilt[1] - 20.0)], -1).reshape(-1, 3)
    both = made.joined(slope, made.terrain_of(heap, made.grid_triangles(2, 2)))
    panel = fence(both, [(30.0, 1.0), (30.0, 39.0)], 2.0, 1e3).panel
    for share in (0.1, 0.5, 0.9):
        y, z = panel.y + share * panel.dy, panel.z + share * panel.dz
        over_heap = np.where((y > 5.0) & (y < 35.0), 0.4 * (y - 20.0), 0.0)
        np.testing.assert_allclose(z, -15.0 + np.maximum(over_heap, 0.0), atol=1e-9)
