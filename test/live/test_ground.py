"""Tests of a terrain that is built from a whole survey."""

import gc
import threading

import numpy as np
import pytest
from live_sites.surveyed_hills import cloud, edge_counts, grid, mesh

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.errors import TerrainError
from rpf3d_core.live.ground import WELD, ZONE, Workshop
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.terrain.survey import mesh_terrain

ROUNDING = 1e-10
"""Largest error of normals if local origins differ: coordinates of 5 km, triangles of some centimetres."""


def as_from_a_file(survey):
    """Return the facets and buckets that the general code, not the code for surveys, makes of a mesh."""
    vertices, triangles = survey.vertices, survey.triangles
    facets = facets_of(mesh_terrain(vertices, triangles, ZONE, WELD))
    return facets, bucket_locator(facets)


def equal(ground, facets, buckets):
    arrays = [(ground.facets.geometry, facets.geometry), (ground.facets.zone, facets.zone)]
    arrays += [(getattr(ground.locator, name), getattr(buckets, name)) for name in ("starts", "ids", "boxes")]
    arrays += list(zip(ground.locator.slabs, buckets.slabs, strict=True))
    return all(np.array_equal(a, b) for a, b in arrays) and ground.facets[4:] == facets[4:]


def holed(survey):
    survey.points[10:14, 20:25] = np.nan
    survey.points[3, 3, 2] = np.nan
    return survey


def soup(survey):
    corners = survey.vertices[survey.triangles].reshape(-1, 3)
    return MeshSurvey(corners, np.arange(len(corners)).reshape(-1, 3))


def boulders(survey, turned):
    """Return the mesh with an overhang and three closed components above it; turned : whether it is wound downwards."""
    survey.vertices.reshape(40, 44, 3)[18:22, 20] += (1.6, 0.0, 5.0)
    ball = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    vertices, triangles = [survey.vertices], [survey.triangles[:, ::-1] if turned else survey.triangles]
    for k in range(3):
        triangles.append((faces[:, ::-1] if k % 2 else faces) + len(survey.vertices) + 4 * k)
        vertices.append(ball + survey.vertices[500 + 300 * k] + np.array([0, 0, 9.0]))
    return MeshSurvey(np.concatenate(vertices), np.concatenate(triangles))


def wound(survey, some):
    triangles = survey.triangles.copy()
    triangles[some] = triangles[some][:, ::-1]
    return MeshSurvey(survey.vertices, triangles)


@pytest.mark.parametrize("rows", [2, 40, 200])
@pytest.mark.parametrize("turned", [0.0, 2.0])
def test_a_grid_becomes_the_bits_of_a_terrain_that_was_read_as_a_mesh(rows, turned):
    survey = grid(rows, turned=turned)
    assert equal(Workshop().whole(survey), *as_from_a_file(mesh(survey)))


def test_so_does_a_grid_with_holes_and_one_whose_rows_run_the_other_way():
    for survey in (holed(grid()), GridSurvey(grid().points[::-1].copy())):
        assert equal(Workshop().whole(survey), *as_from_a_file(mesh(survey)))
        assert (Workshop().whole(survey).facets.normals[:, 2] > 0.0).all()


@pytest.mark.parametrize(
    "change",
    [lambda m: m, soup, lambda m: wound(m, slice(None)), lambda m: wound(m, slice(0, 400, 7))],
    ids=["sound", "a soup", "all down", "some down"],
)
def test_so_does_a_mesh_whatever_is_wrong_with_it(change):
    survey = change(mesh(grid()))
    ground = Workshop().whole(survey)
    assert equal(ground, *as_from_a_file(survey))
    assert len(ground.terrain.vertices) == 40 * 44
    assert (ground.facets.normals[:, 2] > 0.0).all()


@pytest.mark.parametrize("turned", [False, True])
def test_so_does_a_mesh_with_overhangs_and_closed_pieces_each_turned_to_its_free_side(turned):
    survey = boulders(mesh(grid()), turned)
    ground = Workshop().whole(survey)
    assert equal(ground, *as_from_a_file(survey))
    assert (ground.facets.normals[:, 2] < 0.0).any()


def test_two_sides_of_a_seam_within_the_tolerance_are_welded():
    left, right = mesh(grid(columns=10)), mesh(grid(columns=10, east=9.0))
    seam = left.vertices.reshape(40, 10, 3)[:, -1]
    right.vertices.reshape(40, 10, 3)[:, 0] = seam + np.array([0.0, 0.0, 0.5 * WELD])
    both = MeshSurvey(
        np.concatenate([left.vertices, right.vertices]),
        np.concatenate([left.triangles, right.triangles + len(left.vertices)]),
    )
    assert len(Workshop().whole(both).terrain.vertices) == 40 * 19


def test_a_cloud_is_cut_in_plan_and_a_gap_of_the_survey_is_a_hole():
    points = cloud(4000, 0.0, 0.0, 40.0).points
    whole = Workshop(longest_edge=4.0).whole(CloudSurvey(points))
    middle = np.abs(points[:, :2] - points[:, :2].mean(axis=0)).max(axis=1) < 8.0
    ground = Workshop(longest_edge=4.0).whole(CloudSurvey(points[~middle]))
    assert edge_counts(ground)[0] > edge_counts(whole)[0] + 10
    centre = np.array([[0.0, 0.0, 1e3]])
    assert ground.engine.ground_below(centre)[0, 1] < 0 <= whole.engine.ground_below(centre)[0, 1]
    assert (ground.facets.normals[:, 2] > 0.0).all()


def without_rows(first=12, last=26):
    """A grid of 40 rows whose rows without returns were left out by its scanner, and the middle of this gap."""
    points = grid().points
    gap = points[first:last].reshape(-1, 3).mean(axis=0)
    return GridSurvey(np.delete(points, slice(first, last), axis=0)), gap


@pytest.mark.parametrize("turned", [False, True])
def test_rows_that_were_left_out_of_a_grid_are_a_gap_if_the_user_limits_the_edges(turned):
    survey, (x, y, _) = without_rows()
    if turned:
        survey = GridSurvey(survey.points[::-1].swapaxes(0, 1))
    default, cut = Workshop().whole(survey), Workshop(longest_edge=4.0).whole(survey)
    over_the_gap = np.array([[x, y, 1e3]]) - (*default.terrain.frame.origin[:2], 0.0)
    assert cut.engine.ground_below(over_the_gap)[0, 1] < 0 <= default.engine.ground_below(over_the_gap)[0, 1]
    assert len(cut.facets.zone) == len(default.facets.zone) - 2 * (grid().points.shape[1] - 1)
    assert (cut.facets.normals[:, 2] > 0.0).all()


def test_a_limit_of_edges_that_no_edge_of_a_grid_exceeds_changes_no_bit():
    one, other = Workshop().whole(holed(grid())), Workshop(longest_edge=4.0).whole(holed(grid()))
    assert np.array_equal(one.facets.geometry, other.facets.geometry)


def test_a_single_triangle_of_a_grid_with_a_long_edge_is_left_out():
    y, x = np.mgrid[0:3, 0:3].astype(float)
    x[0, 0] = -1.5
    points = np.stack([x, y, np.zeros((3, 3))], axis=-1)
    assert len(Workshop(longest_edge=2.0).whole(GridSurvey(points)).facets.zone) == 6, "both have the diagonal"
    x[0, 0], x[0, 1] = 0.0, 2.5
    points = np.stack([x, y, np.zeros((3, 3))], axis=-1)
    assert len(Workshop(longest_edge=2.0).whole(GridSurvey(points)).facets.zone) == 7


def test_a_patch_with_a_gap_leaves_the_ground_in_the_gap_as_it_was():
    patch, (x, y, _) = without_rows()
    raised = GridSurvey(patch.points[4:-4, 8:-8] + (0.0, 0.0, 1.0))
    for longest, expected in ((None, 1.0), (4.0, 0.0)):
        workshop = Workshop(longest_edge=longest)
        ground = workshop.whole(grid())
        over_the_gap = np.array([[x, y, 1e3]]) - (*ground.terrain.frame.origin[:2], 0.0)
        before = ground.engine.ground_below(over_the_gap)[0, 0]
        after = workshop.patched(ground, raised).engine.ground_below(over_the_gap)[0, 0]
        assert (before - after > 0.2) == bool(expected)


def test_a_grid_whose_edges_are_all_too_long_is_refused():
    with pytest.raises(TerrainError, match="longest_edge"):
        Workshop(longest_edge=0.1).whole(grid())


def test_a_cloud_with_doubles_and_holes_is_the_cloud_without():
    points = cloud(500, 0.0, 0.0, 20.0).points
    more = np.concatenate([points, points[:50] + np.array([0.0, 0.0, 3.0]), np.full((5, 3), np.nan)])
    one, other = Workshop().whole(CloudSurvey(points)), Workshop().whole(CloudSurvey(more))
    assert len(one.facets.zone) == len(other.facets.zone)
    assert np.allclose(one.facets.normals, other.facets.normals, atol=ROUNDING, rtol=0.0)


@pytest.mark.parametrize(
    ("survey", "reason"),
    [
        (GridSurvey(np.full((5, 5, 3), np.nan)), "no square of four points"),
        (GridSurvey(grid().points[:1]), "no square of four points"),
        (GridSurvey(np.where(np.arange(3) == 2, np.inf, grid().points)), "NaN or infinite"),
        (MeshSurvey(np.zeros((3, 3)), np.array([[0, 1, 2]])), "no facet has an area"),
        (MeshSurvey(np.eye(3), np.array([[0, 1, 3]])), "a vertex that does not exist"),
        (MeshSurvey(np.eye(3), np.array([[0, 1, -1]])), "a vertex that does not exist"),
        (MeshSurvey(np.array([[0, 0, 0], [1, 0, np.nan], [0, 1, 0]]), np.array([[0, 1, 2]])), "NaN or infinite"),
        (MeshSurvey(np.eye(3), np.empty((0, 3), int)), "no triangles"),
        (CloudSurvey(np.eye(3)[:2]), "at least three"),
        (CloudSurvey(np.repeat(np.arange(9.0)[:, None], 3, axis=1)), "no triangle"),
    ],
)
def test_what_is_no_terrain_is_refused_with_a_reason(survey, reason):
    with pytest.raises(TerrainError, match=reason):
        Workshop().whole(survey)


@pytest.mark.parametrize("kind", [GridSurvey, CloudSurvey])
def test_fifty_million_points_are_refused_by_name_of_the_limit_before_memory_is_taken(kind):
    shape = (5_000, 10_000, 3) if kind is GridSurvey else (50_000_000, 3)
    workshop = Workshop()
    with pytest.raises(TerrainError, match=r"50,000,000 points; at most 5,000,000"):
        workshop.whole(kind(np.broadcast_to(np.zeros(3), shape)))
    assert workshop.size == 0


def test_a_limit_of_ones_own_holds_to_the_point():
    survey = grid(10, 10)
    Workshop(most_points=100).whole(survey)
    with pytest.raises(TerrainError, match="at most 99 "):
        Workshop(most_points=99).whole(survey)


@pytest.mark.long
def test_a_ground_in_use_is_never_written_to_and_memory_is_used_again():
    workshop = Workshop()
    running = workshop.whole(grid())
    before = running.facets.geometry.copy(), running.locator.ids.copy()
    sizes = []
    for k in range(6):
        workshop.whole(grid(seed=k + 1))
        gc.collect()
        sizes.append(workshop.size)
    assert np.array_equal(running.facets.geometry, before[0])
    assert np.array_equal(running.locator.ids, before[1])
    assert len(set(sizes)) == 1


def test_two_grounds_in_use_both_keep_their_memory_while_a_third_is_made():
    workshop = Workshop()
    grounds = [workshop.whole(grid(seed=k)) for k in range(3)]
    for k, ground in enumerate(grounds):
        assert equal(ground, *as_from_a_file(mesh(grid(seed=k))))


def test_the_digest_tells_surveys_apart_and_the_same_survey_again():
    workshop = Workshop()
    one, same, other = (workshop.whole(grid(seed=k)).digest for k in (0, 0, 1))
    assert one == same != other
    assert len(one) == 64
    assert workshop.whole(mesh(grid())).digest != one


def test_a_sound_mesh_is_not_sorted_whatever_it_overhangs(monkeypatch):
    monkeypatch.setattr("rpf3d_core.terrain.mesh.mesh_ready.mesh_terrain", None)
    Workshop().whole(boulders(mesh(grid()), True))
    with pytest.raises(TypeError):
        Workshop().whole(wound(mesh(grid()), slice(0, 400, 7)))


def test_whole_grounds_are_made_while_another_is_patched():
    workshop = Workshop()
    running, bits = workshop.whole(grid()), []
    alone = Workshop()
    expected = alone.whole(grid())
    patches = [grid(8, 8, 5.0 + k, 9.3, seed=k) for k in range(20)]
    for patch in patches:
        expected = alone.patched(expected, patch)

    def make():
        for k in range(20):
            ground = workshop.whole(grid(seed=k))  # must stay valid until it is copied
            bits.append(ground.facets.geometry.copy())

    threads = [threading.Thread(target=make) for _ in range(2)]
    for thread in threads:
        thread.start()
    for patch in patches:
        running = workshop.patched(running, patch)
    for thread in threads:
        thread.join()
    assert np.array_equal(running.facets.geometry, expected.facets.geometry)
    alone_bits = [Workshop().whole(grid(seed=k)).facets.geometry for k in range(20)]
    assert all(any(np.array_equal(made, one) for one in alone_bits) for made in bits)
    assert len(bits) == 40


def test_a_ground_can_be_made_on_another_thread_than_it_is_flown_on():
    made = []
    workshop = Workshop()
    thread = threading.Thread(target=lambda: made.append(workshop.whole(grid(), stamp_ns=7)))
    thread.start()
    thread.join()
    assert made[0].stamp_ns == 7
    assert made[0].engine.ground_below(made[0].terrain.vertices[900][None] + (0, 0, 5))[0, 0] == pytest.approx(5.0)


def test_a_patch_does_not_renew_the_whole_survey():
    workshop = Workshop()
    patched = workshop.patched(workshop.whole(grid(), stamp_ns=7), grid(10, 12, 12.37, 9.21), stamp_ns=9)
    assert (patched.stamp_ns, patched.whole_ns) == (9, 7)
    assert workshop.whole(grid(), stamp_ns=11).whole_ns == 11
