"""Tests of terrain components that intersect: a rock that slides over one component does not pass below another."""

import math

import numpy as np
import pytest
from campaigns.never_below import flown
from flights.obstacles_made import fence, with_effects
from flights.on_both_engines import BOTH, NEAR, G, outcomes
from flights.scenes_of_facets import (
    engine_over,
    flight,
    fly,
    grid_triangles,
    gully,
    incline,
    joined,
    released,
    same_bits,
    surface,
    terrain_of,
)
from meshes.cutting_pieces import highest
from meshes.random_ground import case_of, fallen

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.kinetics import slide_path
from rpf3d_core.simulation.engines import engine_of
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.values import Mode, Outcome

FALL, SIDE = 0.7, 40.0
"""Fall (m/m) towards +x of the plane on which the muck pile lies, and the side (m) of this plane."""
TOP, STEEP = np.array([20.0, 20.0, -0.7 * 20.0 + 3.0]), 4.0 / 3.0
"""Top (3,) m of the muck pile, 3 m above the slope, and the slope (m/m) of its four sides."""
ROCKS = {"compiled": 400, "reference": 30}
KINDS = [("sliding", "constant"), ("sliding", "coulomb_limited"), ("rolling", "coulomb_limited")]


def slope(cells: int = 10) -> Terrain:
    """Return the square plane that falls towards +x from x = 0, in cells x cells squares."""
    return plane(np.linspace(0.0, SIDE, cells + 1), np.linspace(0.0, SIDE, cells + 1))


def plane(x: np.ndarray, y: np.ndarray) -> Terrain:
    """Return the part of the plane with vertices at the coordinates x and y (m)."""
    u, w = (v.ravel() for v in np.meshgrid(x, y, indexing="ij"))
    return terrain_of(np.column_stack([u, w, -FALL * u]), grid_triangles(len(x), len(y)))


def muck_pile() -> Terrain:
    """Return a pyramid with four sides, 8 m high and open below; its border is below the slope."""
    x = 6.0 * np.array([[0, 0], [-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = np.column_stack([x, np.where(np.arange(5) > 0, -6.0 * STEEP, 0.0)]) + TOP
    return terrain_of(corners, [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)])


def depth(x: np.ndarray) -> np.ndarray:
    """Return the depth (N,) m of places (N, 3) m below the slope or the pile's surface; negative in the air."""
    side = np.abs(x[:, :2] - TOP[:2]).max(axis=1)
    pile = np.where(side < 6.0, TOP[2] - STEEP * side, -np.inf)
    return np.asarray(np.maximum(-FALL * x[:, 0], pile) - x[:, 2])


def on_paths(flights: Flights) -> tuple[np.ndarray, np.ndarray]:
    """Return places (N, 3) m on all paths, 16 per path segment, and their rocks (N,)."""
    paths = flights.paths
    going = np.flatnonzero(np.diff(paths.row) == 0)
    share = np.linspace(0.0, 1.0, 16)[:, None, None]
    t, way = (paths.t[going + 1] - paths.t[going])[:, None], paths.x[going + 1] - paths.x[going]
    flying = paths.x[going] + paths.v[going] * share * t - 0.5 * (share * t) ** 2 * np.array([0.0, 0.0, G])
    places = np.where((paths.mode[going] == Mode.FLIGHT)[:, None], flying, paths.x[going] + share * way)
    return places.reshape(-1, 3), np.tile(paths.row[going], 16)


def within_the_slope(x: np.ndarray) -> np.ndarray:
    """Return whether places (N, 3) m are inside the slope in plan, by more than rounding: (N,)."""
    return np.asarray(((x[:, :2] > NEAR) & (x[:, :2] < SIDE - NEAR)).all(axis=1))


def over_the_pile(engine: str, model: str, rebound: str) -> Flights:
    """Fly rocks that start upslope of the muck pile, about half of them on the ground, and move down towards it."""
    draw, count = np.random.default_rng(1), ROCKS[engine]
    x = np.column_stack([draw.uniform(6.0, 12.0, count), draw.uniform(15.0, 25.0, count), np.zeros(count)])
    x[:, 2] = -FALL * x[:, 0] + draw.choice([0.0, 1.0], count) * draw.uniform(0.0, 2.0, count)
    v = np.column_stack([draw.uniform(0.0, 6.0, count), draw.normal(0.0, 1.0, count), np.zeros(count)])
    v[:, 2] = -FALL * v[:, 0]
    over = engine_over(engine, joined(slope(), muck_pile()))
    return fly(over, flight(surface(0.35, 0.85, 30.0), model, rebound), x, v)


@BOTH
@pytest.mark.parametrize(("model", "rebound"), KINDS)
def test_no_rock_passes_below_a_muck_pile_that_cuts_through_the_slope(engine, model, rebound):
    flights = over_the_pile(engine, model, rebound)
    places, rock = on_paths(flights)
    assert rock[(depth(places) > NEAR) & within_the_slope(places)].tolist() == []
    ends = flights.deposits
    left = ends.outcome == Outcome.LEFT_TERRAIN
    assert not within_the_slope(ends.x[left]).any()
    assert outcomes(flights) <= {Outcome.STOPPED, Outcome.LEFT_TERRAIN}
    near = np.abs(depth(places)) < NEAR
    assert np.unique(rock[near & (places[:, 2] > -FALL * places[:, 0] + 0.01)]).size > 0.1 * ROCKS[engine]


@BOTH
def test_a_rock_that_slides_straight_into_the_pile_stops_in_the_gully_before_it(engine):
    """The gully between the slope and the pile's uphill side is level, so the rock stops in it."""
    line = (TOP[2] - STEEP * TOP[0]) / (-FALL - STEEP)
    over = engine_over(engine, joined(slope(), muck_pile()))
    x = np.array([10.0, 20.3, -7.0])
    flights = fly(over, flight(surface(0.0, 0.0, 10.0), "sliding"), x)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.x[0].tolist() == pytest.approx([line, 20.3, -FALL * line], abs=NEAR)
    down = math.atan(FALL)
    speed2 = 2.0 * G * (math.sin(down) - math.tan(math.radians(10.0)) * math.cos(down)) * (line - 10.0) / math.cos(down)
    assert flights.deposits.max_speed[0] == pytest.approx(math.sqrt(speed2), rel=1e-9)


@BOTH
@pytest.mark.parametrize("dip", [2.0, 30.0], ids=["slides on", "bounces"])
def test_a_rock_in_a_gully_meets_a_level_sheet_that_cuts_the_gully(engine, dip):
    """From the line where the sheet cuts the gully on, the rock is on the sheet."""
    level, steep = -3.0, math.tan(math.radians(dip))
    begin = -level / steep
    sheet = [(begin + x, y, level) for x, y in ((-3.0, -4.0), (3.0, -4.0), (3.0, 4.0), (-3.0, 4.0))]
    both = joined(gully(40.0, 40.0, dip, length=begin + 10.0), terrain_of(sheet, [(0, 1, 2), (0, 2, 3)]))
    start = np.array([begin - 6.0, 0.0, -(begin - 6.0) * steep])
    physics = flight(surface(0.3, 0.9, 0.5 * dip), "sliding", smallest_bounce=1e-2)
    flights = fly(engine_over(engine, both), physics, start, (2.0, 0.0, -2.0 * steep))
    places, _ = on_paths(flights)
    assert np.abs(flights.paths.x - (begin, 0.0, level)).max(axis=1).min() < NEAR
    over = (np.abs(places[:, 0] - begin) < 3.0 - NEAR) & (np.abs(places[:, 1]) < 4.0 - NEAR)
    ground = np.where(over, np.maximum(level, -places[:, 0] * steep), -places[:, 0] * steep)
    assert (places[over, 2] > ground[over] - NEAR).all()
    assert (places[over, 0] > begin + 1.0).any()
    bounces = np.abs(flights.impacts.x - (begin, 0.0, level)).max(axis=1) < NEAR
    assert bounces.any() == (dip > 10.0)


def fast_past_the_pile(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return places (N, 3) m on the slope and on the pile, and velocities (N, 3) m/s along the slope."""
    draw = np.random.default_rng(3)
    x = np.column_stack([draw.uniform(2.0, 25.0, count), draw.uniform(8.0, 32.0, count), np.zeros(count)])
    x[:, 2] += depth(x)
    v = np.column_stack([draw.uniform(0.0, 20.0, count), draw.normal(0.0, 5.0, count), np.zeros(count)])
    v[:, 2] = -FALL * v[:, 0]
    return x, v


def test_rocks_slide_past_the_pile_as_in_segments_sixteen_times_as_short(monkeypatch):
    """The chord of a short segment is nearly the rock's path, and so does not enter a facet that the rock leaves.

    R_n = 0 keeps rocks on the ground. The chosen rocks are 16 of the 47 of 2,000 that the chords of long segments once
    stopped, and the first 8 of the others.
    """
    x, v = fast_past_the_pile(2000)
    chosen = [35, 75, 76, 101, 208, 229, 275, 293, 448, 480, 566, 620, 642, 688, 702, 715, *range(8)]
    over, physics = joined(slope(), muck_pile()), flight(surface(0.0, 0.9, 10.0), "sliding")
    ends = [fly(engine_over(name, over), physics, x[chosen], v[chosen]).deposits for name in ("reference", "compiled")]
    monkeypatch.setattr(slide_path, "BEND", slide_path.BEND / 16.0)
    fine = fly(engine_over("reference", over), physics, x[chosen], v[chosen]).deposits
    assert Outcome.LEFT_TERRAIN in fine.outcome
    for end in ends:
        assert end.outcome.tolist() == fine.outcome.tolist()
        assert np.median(np.linalg.norm(end.x - fine.x, axis=1)) < 0.1


def bench_with_heap(draw: np.random.Generator) -> Terrain:
    """Return a face over a flatter slope, and a heap of 12 to 39 facets of its own at the foot."""
    face, flat = (math.tan(math.radians(draw.uniform(*range_))) for range_ in ((20.0, 70.0), (-5.0, 35.0)))
    x = np.concatenate([np.linspace(-20.0, 0.0, 3), np.linspace(10.0, 50.0, 4)])
    y = np.linspace(-30.0, 30.0, int(draw.integers(2, 12)))
    noise = draw.choice([0.0, 0.05, 0.3])
    ground = np.array(
        [(a, b, -a * (face if a < 0.0 else flat) + noise * draw.uniform(-1.0, 1.0)) for a in x for b in y]
    )
    sides, size, high = int(draw.integers(4, 14)), draw.uniform(3.0, 12.0), draw.uniform(1.0, 6.0)
    turns, middle = (
        2.0 * np.pi * np.arange(sides) / sides,
        np.array([draw.uniform(-4.0, 14.0), draw.uniform(-8.0, 8.0)]),
    )
    plan = middle + np.outer([size, 0.5 * size], np.ones(sides))[..., None] * np.stack(
        [np.cos(turns), np.sin(turns)], -1
    )
    level = np.where(plan[..., 0] < 0.0, -face * plan[..., 0], -flat * plan[..., 0])
    level += np.array([[-noise - 1.0], [0.6 * high]])
    rings = np.concatenate([plan, level[..., None]], axis=-1).reshape(-1, 3)
    top = (*middle, -middle[0] * (face if middle[0] < 0.0 else flat) + high)
    around = [(i, (i + 1) % sides) for i in range(sides)]
    facets = [
        t for i, j in around for t in ((i, j, sides + j), (i, sides + j, sides + i), (sides + i, sides + j, 2 * sides))
    ]
    return joined(terrain_of(ground, grid_triangles(len(x), len(y))), terrain_of([*rings, top], facets))


@pytest.mark.parametrize("friction_angle", [5.0, 15.0, 35.0])
def test_no_rock_ends_in_motion_between_a_slope_and_a_heap(friction_angle):
    """With R_n = 0, a rock that is turned again and again into the slope gets nowhere."""
    draw, unresolved = np.random.default_rng(8), 0
    for _ in range(150):
        terrain = bench_with_heap(draw)
        x = np.column_stack([draw.uniform(-19.0, 10.0, 60), draw.uniform(-20.0, 20.0, 60), np.full(60, 100.0)])
        x[:, 2] = highest(terrain.vertices[terrain.triangles], x[:, :2]) + draw.choice([0.0, 3.0], 60)
        flights = fly(engine_over("compiled", terrain), flight(surface(0.0, 0.9, friction_angle)), x, threads=1)
        unresolved += int((flights.deposits.outcome == Outcome.UNRESOLVED_CONTACT).sum())
    assert unresolved == 0


@BOTH
@pytest.mark.parametrize(("model", "rebound"), KINDS)
@pytest.mark.parametrize("apart", [0.0, 0.5, -0.5], ids=["touching", "a crack between", "overlapping by half a crack"])
def test_tiles_of_one_plane_that_touch_change_no_result(engine, model, rebound, apart):
    """Two tiles with different cells meet at x = 15 m; two small sheets far below intersect, so that the search runs.

    apart : gap in x between the tiles, as a multiple of the width of a crack
    """
    y = np.linspace(0.0, SIDE, 8)
    upper, lower = plane(np.linspace(0.0, 15.0, 5), y), plane(np.linspace(15.0, SIDE, 9), np.linspace(0.0, SIDE, 12))
    deep = np.array([20.0, 20.0, -500.0])
    sheets = [terrain_of(deep + np.array([(0, 0, 0), (1, 0, a), (0, 1, 0)]), [(0, 1, 2)]) for a in (0.0, 0.5)]
    lower.vertices[:, 0] += apart * facets_of(joined(upper, lower, *sheets)).crack
    tiles = joined(upper, lower, *sheets)
    draw, count = np.random.default_rng(3), ROCKS[engine]
    x = np.column_stack([draw.uniform(5.0, 14.0, count), draw.uniform(5.0, 35.0, count), np.zeros(count)])
    x[:, 2] = -FALL * x[:, 0]
    v = draw.uniform(0.0, 5.0, (count, 1)) * (1.0, 0.0, -FALL)
    v[:, 1] = draw.choice([0.0, 1.0], count) * draw.normal(0.0, 2.0, count)
    physics = flight([surface(0.35, 0.85, 25.0)] * 4, model, rebound)
    with_search, without = engine_over(engine, tiles), engine_of(engine, facets_of(tiles))
    assert with_search.pieces is not None and without.pieces is None
    found, expected = (fly_ensemble(each, physics, released(x, v)) for each in (with_search, without))
    assert same_bits(found, expected)
    assert (found.deposits.x[:, 0] > 20.0).mean() > 0.3


@BOTH
@pytest.mark.parametrize("before", [True, False], ids=["net before the pile", "net under the pile"])
def test_of_a_net_and_another_piece_on_one_segment_the_first_counts(engine, before):
    """The slope is only two facets, so that one segment leads from the start to both net and pile."""
    line = (TOP[2] - STEEP * TOP[0]) / (-FALL - STEEP)
    ground = slope(1)
    net = fence(ground, [(at := line - 1.0 if before else line + 1.0, 15.0), (at, 25.0)], 2.0, 1e9)
    physics = with_effects(flight(surface(0.0, 0.0, 10.0), "sliding"), net)
    over = engine_over(engine, joined(ground, muck_pile()))
    ends = fly(over, physics, np.array([10.0, 20.3, -7.0])).deposits
    assert ends.outcome[0] == (Outcome.CAUGHT if before else Outcome.STOPPED)
    assert ends.x[0, 0] == pytest.approx(min(at, line), abs=NEAR)


def test_terrain_without_overlapping_pieces_has_no_search():
    """The terrains are single slopes, slopes in tiles side by side, and a slope with a pile outside it."""
    for terrain in (slope(), joined(plane(np.arange(3.0), np.arange(3.0)), plane(np.arange(2.0, 5.0), np.arange(3.0)))):
        assert engine_over("reference", terrain).pieces is None
    assert engine_over("reference", joined(incline(30.0), muck_pile())).pieces is None


def test_the_check_of_the_campaign_sees_rocks_that_slide_below_another_piece():
    """Without the search, more than 100 of 250 rocks pass through the components that cut the ground of this case."""
    case = case_of("pieces", 3, 250)
    blind = engine_of("compiled", facets_of(case.terrain))
    assert len(fallen(case, fly_ensemble(blind, case.flight, released(case.x, case.v), threads=1))) > 100
    assert len(fallen(case, flown(case))) == 0
