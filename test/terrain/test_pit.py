"""Tests that the synthetic pit is a valid mesh and has the chosen shape."""

from functools import cache

import numpy as np
import pytest

from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain

SMOOTH = {"roughness": 0.0, "spills": 0}
NO_BERMS = {"bench_widths": (0.0, 0.0), "face_angle_deg": 48.0}
VARIANTS = [
    Pit(triangles=2_000),
    Pit(triangles=20_000, roughness=1.0),
    Pit(triangles=150_000),
    Pit(triangles=30_000, ramp_width=0.0),
    Pit(triangles=30_000, **NO_BERMS),
    Pit(triangles=30_000, **NO_BERMS, ramp_width=0.0),
    Pit(triangles=30_000, waste_benches=1, ore_benches=0),
    Pit(triangles=30_000, floor_radius=120.0, elongation=1.2, waste_benches=6, ore_benches=10),
    Pit(triangles=30_000, floor_radius=800.0, waste_benches=40, ore_benches=20, ramp_grade=0.12),
]
EXACT = 1e-6
"""Largest error (m) of heights that are sums of a few numbers below 1000."""
ANGLE_DEG = 0.5
"""Largest error (degrees) of a face angle, due to chords between columns 6 m apart."""
TAPERED_SHARE = 0.08
"""Largest share of face area next to the ramp, where a berm tapers out and facets join face and ramp edge."""
GRADE = 0.002
"""Largest error (-) of the ramp's grade: it is stretched by less than 0.1 % to end at a column, and drifts outwards."""
RAMP_WIDTH_M, BENCH_WIDTH_M = 0.5, 0.1
"""Largest errors (m) of the widths of ramp and benches, which are measured between chords."""
COUNT = 0.03
"""Largest relative error of the number of triangles, as `pit_terrain` states it."""


def told(pit: Pit) -> str:
    """Return the test id of a pit: its values that differ from the defaults."""
    return "-".join(f"{name}={value}" for name, value in vars(pit).items() if value != getattr(Pit, name, None))


@cache
def made(pit: Pit) -> Terrain:
    return pit_terrain(pit)


def facet_vectors(terrain: Terrain) -> np.ndarray:
    """Return the normals (F, 3) m2 of facets, with twice the area as length."""
    a, b, c = (terrain.vertices[terrain.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def in_zone(terrain: Terrain, pattern: str) -> np.ndarray:
    chosen = [i for i, name in enumerate(terrain.zones) if name == pattern or name.startswith(pattern + "_")]
    return np.isin(terrain.zone, chosen)


def boundary(triangles: np.ndarray) -> np.ndarray:
    """Return the edges (E, 2) of only one triangle, with the inside on their left; assert consistent winding."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    code, other = edges @ [1 << 32, 1], edges @ [1, 1 << 32]
    assert len(np.unique(code)) == len(code), "two facets use an edge in the same direction"
    return edges[~np.isin(code, other)]


def widths(terrain: Terrain, mask: np.ndarray) -> np.ndarray:
    """Return (E,) m the width in plan of the facets `mask`, from each boundary edge to the opposite boundary."""
    edges = boundary(terrain.triangles[mask])
    start, end = terrain.vertices[edges[:, 0], :2], terrain.vertices[edges[:, 1], :2]
    along = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    middle, across = 0.5 * (start + end), np.stack([-along[:, 1], along[:, 0]], axis=1)
    found = np.full(len(edges), np.inf)
    for k in range(len(edges)):
        s, e = start - middle[k], end - middle[k]
        side_s, side_e = s @ along[k], e @ along[k]
        hits = (side_s > 0.0) != (side_e > 0.0)
        share = side_s[hits] / (side_s[hits] - side_e[hits])
        way = (s[hits] + share[:, None] * (e[hits] - s[hits])) @ across[k]
        found[k] = way[way > EXACT].min(initial=np.inf)
    return found


@pytest.mark.parametrize("pit", VARIANTS, ids=told)
def test_the_only_open_edges_are_one_line_around_the_rim(pit):
    terrain = made(pit)
    rim = boundary(terrain.triangles)
    follows = dict(rim.tolist())
    vertex, steps = int(rim[0, 0]), 0
    while steps == 0 or vertex != rim[0, 0]:
        vertex, steps = follows[vertex], steps + 1
    assert steps == len(rim)
    assert not np.isin(rim, terrain.triangles[~in_zone(terrain, "ground")]).any()


@pytest.mark.parametrize("pit", VARIANTS, ids=told)
def test_it_is_a_disc_whose_vertices_are_all_used_once(pit):
    terrain = made(pit)
    v, f, rim = len(terrain.vertices), len(terrain.triangles), len(boundary(terrain.triangles))
    assert len(np.unique(terrain.triangles)) == v
    assert len(np.unique(terrain.vertices, axis=0)) == v
    assert v - (3 * f + rim) // 2 + f == 1  # Euler's number of a disc


@pytest.mark.parametrize("pit", VARIANTS, ids=told)
def test_every_facet_faces_up_and_has_area(pit):
    normal = facet_vectors(made(pit))
    assert normal[:, 2].min() > 0.02


@pytest.mark.parametrize("pit", VARIANTS, ids=told)
def test_the_number_of_triangles_is_within_three_percent(pit):
    assert len(made(pit).triangles) == pytest.approx(pit.triangles, rel=COUNT)


@pytest.mark.long
@pytest.mark.parametrize(("triangles", "area"), [(150_000, 18.1), (2_332_287, 1.17)])
def test_the_two_meshes_of_the_thesis_have_facets_of_about_20_and_1_square_metres(triangles, area):
    terrain = pit_terrain(Pit(triangles=triangles))
    assert len(terrain.triangles) == pytest.approx(triangles, rel=COUNT)
    assert np.linalg.norm(facet_vectors(terrain), axis=1).mean() / 2.0 == pytest.approx(area, rel=0.03)


def test_every_zone_is_there_with_benches_numbered_from_the_top():
    terrain = made(Pit())
    assert terrain.zones == (*(f"bench_{k}" for k in range(1, 22)), "face", "ramp", "floor", "spill", "ground")
    assert set(np.unique(terrain.zone)) == set(range(len(terrain.zones)))


def test_benches_lie_at_their_levels_12_m_apart_in_waste_and_18_m_in_ore():
    pit = Pit(triangles=60_000, **SMOOTH)
    terrain = made(pit)
    for number in range(1, 22):
        depth = 12.0 * min(number, 12) + 18.0 * max(number - 12, 0)
        facets = terrain.triangles[terrain.zone == terrain.zones.index(f"bench_{number}")]
        height = terrain.vertices[facets, 2]
        on_level = np.isclose(height, -depth, atol=EXACT).all(axis=1)
        assert on_level.mean() > 0.97  # where a berm tapers out, a few facets reach up to the ramp's edge
    assert terrain.vertices[:, 2].min() == pytest.approx(-(12 * 12 + 10 * 18), abs=EXACT)


def test_benches_are_7_to_9_metres_wide_and_narrower_only_where_they_taper_into_the_ramp():
    pit = Pit(triangles=60_000, **SMOOTH)
    terrain = made(pit)
    for number in (1, 4, 9, 15, 21):
        across = widths(terrain, terrain.zone == terrain.zones.index(f"bench_{number}"))
        across = across[np.isfinite(across)]
        assert across.max() < 9.1 + BENCH_WIDTH_M
        assert np.mean(across > 7.0 - BENCH_WIDTH_M) > 0.8


@pytest.mark.parametrize(("triangles", "more"), [(150_000, {}), (600_000, {}), (100_000, NO_BERMS)])
def test_faces_stand_at_the_face_angle(triangles, more):
    pit = Pit(triangles=triangles, **SMOOTH, **more)
    terrain = made(pit)
    normal = facet_vectors(terrain)[in_zone(terrain, "face")]
    area = np.linalg.norm(normal, axis=1)
    angle = np.degrees(np.arccos(normal[:, 2] / area))
    right = np.abs(angle - pit.face_angle_deg) < ANGLE_DEG
    assert area[right].sum() / area.sum() > 1.0 - TAPERED_SHARE


def test_faces_stay_at_the_face_angle_on_average_when_they_are_rough():
    terrain = made(Pit())
    normal = facet_vectors(terrain)[in_zone(terrain, "face")]
    mean = normal.sum(axis=0)[2] / np.linalg.norm(normal, axis=1).sum()
    assert np.degrees(np.arccos(mean)) == pytest.approx(70.0, abs=1.0)


def test_the_ramp_runs_in_one_piece_from_floor_to_crest():
    terrain = made(Pit(triangles=60_000, **SMOOTH))
    ramp = in_zone(terrain, "ramp")
    follows = dict(boundary(terrain.triangles[ramp]).tolist())
    start = vertex = next(iter(follows))
    steps = 0
    while steps == 0 or vertex != start:
        vertex, steps = follows[vertex], steps + 1
    assert steps == len(follows)
    height = terrain.vertices[np.unique(terrain.triangles[ramp]), 2]
    assert (height.min(), height.max()) == pytest.approx((-324.0, 0.0), abs=EXACT)


def test_the_ramp_climbs_one_in_ten():
    terrain = made(Pit(triangles=60_000, **SMOOTH))
    normal = facet_vectors(terrain)[in_zone(terrain, "ramp")]
    grade = np.hypot(normal[:, 0], normal[:, 1]) / normal[:, 2]
    assert np.average(grade, weights=normal[:, 2]) == pytest.approx(0.10, abs=GRADE)
    assert grade.max() < 0.115  # on the inside of the tightest bend


def test_the_ramp_is_32_metres_wide_all_along():
    terrain = made(Pit(triangles=60_000, **SMOOTH))
    across = widths(terrain, in_zone(terrain, "ramp"))
    inside = across[across < 100.0]  # not the two ends, which look along the ramp
    assert len(inside) > 0.97 * len(across)
    assert (np.quantile(inside, 0.02), np.quantile(inside, 0.98)) == pytest.approx((32.0, 32.0), abs=RAMP_WIDTH_M)


def test_a_pit_without_berms_or_ramp_has_no_such_zones_in_use():
    terrain = made(Pit(triangles=30_000, **NO_BERMS, ramp_width=0.0))
    assert terrain.zones == ("face", "ramp", "floor", "spill", "ground")
    assert not in_zone(terrain, "ramp").any()
    assert not in_zone(terrain, "spill").any()


def test_the_level_of_the_thesis_sources_lies_on_the_top_face_of_the_west_wall():
    terrain = made(Pit())
    corners = terrain.frame.points_to_input(terrain.vertices)[terrain.triangles]
    west = (corners[:, :, 0].max(axis=1) < -500.0) & (np.abs(corners[:, :, 1]).max(axis=1) < 100.0)
    level = west & (corners[:, :, 2].min(axis=1) < 1687.0) & (corners[:, :, 2].max(axis=1) > 1687.0)
    face = level & in_zone(terrain, "face")
    assert face.sum() > 20
    assert facet_vectors(terrain)[face, 0].min() > 0.0  # it looks east, into the pit


def test_the_same_pit_gives_the_same_bits():
    once, again = pit_terrain(Pit(triangles=20_000)), pit_terrain(Pit(triangles=20_000))
    assert once.vertices.tobytes() == again.vertices.tobytes()
    assert once.triangles.tobytes() == again.triangles.tobytes()
    assert once.zone.tobytes() == again.zone.tobytes()


def test_another_seed_changes_heights_but_not_the_plan():
    one, two = made(Pit(triangles=20_000, seed=1)), made(Pit(triangles=20_000, seed=2))
    assert np.array_equal(one.vertices[:, :2], two.vertices[:, :2])
    assert np.array_equal(one.triangles, two.triangles)
    assert np.mean(one.vertices[:, 2] != two.vertices[:, 2]) > 0.99
    assert not np.array_equal(one.zone, two.zone)  # spills lie elsewhere


def test_roughness_is_the_standard_deviation_asked_for_and_less_on_the_ramp():
    rough, smooth = made(Pit(triangles=400_000, spills=0, roughness=0.3)), made(Pit(triangles=400_000, **SMOOTH))
    lift = rough.vertices[:, 2] - smooth.vertices[:, 2]
    only = {name: np.unique(smooth.triangles[in_zone(smooth, name)]) for name in ("bench", "face", "ramp", "floor")}
    flat = np.setdiff1d(only["bench"], np.concatenate([only["face"], only["ramp"]]))
    assert lift[flat].std() == pytest.approx(0.3, rel=0.1)
    graded = np.setdiff1d(only["ramp"], only["face"])
    assert lift[graded].std() == pytest.approx(0.1, rel=0.15)


def test_roughness_belongs_to_the_place_and_not_to_the_mesh():
    coarse, fine = made(Pit(triangles=20_000)), made(Pit(triangles=150_000))
    middles = [t.vertices[np.hypot(*t.vertices[:, :2].T) < EXACT, 2] for t in (coarse, fine)]
    assert middles[0] == pytest.approx(middles[1], abs=EXACT)
    assert abs(middles[0][0] + 324.0) > EXACT


def test_spills_lie_on_benches_against_faces_and_no_steeper_than_loose_rock():
    pit = Pit(triangles=600_000, roughness=0.0)
    terrain = made(pit)
    normal = facet_vectors(terrain)[in_zone(terrain, "spill")]
    slope = np.degrees(np.arccos(normal[:, 2] / np.linalg.norm(normal, axis=1)))
    assert len(slope) > 3_000
    assert np.mean(slope < pit.repose_deg + 1.0) > 0.85  # the others join the cone to the face behind it
    smooth = made(Pit(triangles=600_000, **SMOOTH))
    lift = terrain.vertices[:, 2] - smooth.vertices[:, 2]
    assert lift.min() > -EXACT
    assert 4.0 < lift.max() < 9.1
    under = np.unique(smooth.zone[in_zone(terrain, "spill")])
    assert "ramp" not in {smooth.zones[zone] for zone in under}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"triangles": 100}, "triangles"),
        ({"triangles": 6_000_000}, "triangles"),
        ({"triangles": 2_500.5}, "triangles"),
        ({"seed": -1}, "seed"),
        ({"face_angle_deg": 90.0}, "face_angle_deg"),
        ({"face_angle_deg": float("nan")}, "face_angle_deg"),
        ({"roughness": float("inf")}, "roughness"),
        ({"bench_widths": (9.0, 7.0)}, "bench_widths"),
        ({"bench_widths": (0.0, 7.0)}, "bench_widths"),
        ({"ramp_width": 5.0}, "ramp_width"),
        ({"waste_benches": 0, "ore_benches": 0}, "waste_benches"),
    ],
)
def test_a_parameter_out_of_range_is_refused_by_name(change, named):
    with pytest.raises(TerrainError, match=named):
        Pit(**change)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"triangles": 2_000, "waste_benches": 60, "ore_benches": 0, "floor_radius": 600.0}, "triangles"),
        ({"elongation": 2.0, "rim_width": 2000.0}, "folds"),
        ({"elongation": 1.64, "floor_radius": 103.0, "face_angle_deg": 36.0, "waste_bench_height": 24.0}, "folds"),
        ({"floor_radius": 100.0, "elongation": 1.1, "ramp_grade": 0.05, "ore_bench_height": 50.0}, "ramp|folds"),
    ],
)
def test_a_plan_that_cannot_be_drawn_is_refused(change, named):
    with pytest.raises(TerrainError, match=named):
        pit_terrain(Pit(**change))
