"""Tests that a slope of benches is a valid mesh with the chosen dimensions, also with vertical faces."""

import math
from pathlib import Path

import numpy as np
import pytest

import rpf3d_core as rpf3d
from rpf3d_core.errors import TerrainError
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.benches.profile import FADE, profile_of
from rpf3d_core.terrain.benches.slope import benches_terrain, brow_of
from rpf3d_core.terrain.clipping import areas_of, normals_of
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.faults import fault_report
from rpf3d_core.terrain.mesh.winding import repair_winding
from rpf3d_core.values import STANDARD_GRAVITY

EXACT = 1e-9
"""Largest error (m) of lengths that are sums of a few numbers below 1000."""
ROUGH = Benches(face_angle_deg=90.0, roughness=0.2, number=2, width=40.0)
SHAPES = [
    Benches(), Benches(face_angle_deg=90.0), Benches(spacing=0.7, face_angle_deg=55.0), Benches(number=1),
    Benches(berm=0.0), ROUGH, Benches(roughness=1.0, spacing=0.5),
]  # fmt: skip
SCENE = """\
terrain: {terrain}
materials: {{default: {{normal_restitution: 0.3, tangential_restitution: 0.7}}}}
sources: [{{name: top, rocks: 40, {source}}}]
outputs: {{pictures: false, recording: false}}
"""


def written(folder: Path, terrain: str, source: str = "crest: 1, above_ground: 0.5, velocity: [2, 0, 0]") -> Path:
    (folder / "scene.yaml").write_text(SCENE.format(terrain=terrain, source=source))
    return folder / "scene.yaml"


def area_of(terrain: Terrain, zone: str) -> float:
    facets = terrain.zone == terrain.zones.index(zone)
    return float(areas_of(terrain.vertices[terrain.triangles[facets]]).sum())


@pytest.mark.parametrize("benches", SHAPES, ids=str)
def test_a_slope_is_one_sheet_without_holes_or_faults(benches: Benches) -> None:
    terrain = benches_terrain(benches)
    edges = edges_of(terrain.triangles, len(terrain.vertices))
    report = fault_report(terrain, repair_winding(terrain.vertices, terrain.triangles, edges), edges, ())
    assert (report.zero_area_facets, report.flipped_facets, report.non_manifold_edges, report.holes) == (0, 0, 0, 0)
    assert len(terrain.triangles) == benches.triangles
    rim = terrain.vertices[np.concatenate([edges.low[edges.uses == 1], edges.high[edges.uses == 1]])]
    low, high = terrain.vertices[:, :2].min(axis=0), terrain.vertices[:, :2].max(axis=0)
    on_rim = (np.abs(np.abs(rim[:, 1]) - 0.5 * benches.width) < EXACT) | (np.abs(rim[:, 0] - low[0]) < EXACT)
    assert (on_rim | (np.abs(rim[:, 0] - high[0]) < EXACT)).all()


@pytest.mark.parametrize("spacing", [0.0, 0.7, 3.0])
@pytest.mark.parametrize("angle", [45.0, 70.0, 90.0])
def test_zones_have_the_areas_of_the_design(spacing: float, angle: float) -> None:
    terrain = benches_terrain(Benches(height=12.0, face_angle_deg=angle, berm=6.5, width=30.0, spacing=spacing))
    assert terrain.zones == ("crest", "face_1", "berm_1", "face_2", "berm_2", "face_3", "floor")
    for face in ("face_1", "face_2", "face_3"):
        assert area_of(terrain, face) == pytest.approx(30.0 * 12.0 / math.sin(math.radians(angle)))
    for berm in ("berm_1", "berm_2"):
        assert area_of(terrain, berm) == pytest.approx(30.0 * 6.5)
    assert terrain.vertices[:, 2].max() == pytest.approx(36.0)
    assert terrain.vertices[:, 2].min() == pytest.approx(0.0, abs=EXACT)


def test_vertical_faces_are_exactly_vertical_and_face_away_from_the_slope() -> None:
    terrain = benches_terrain(Benches(face_angle_deg=90.0, spacing=1.0))
    faces = [number for number, name in enumerate(terrain.zones) if name.startswith("face_")]
    normals = normals_of(terrain.vertices[terrain.triangles[np.isin(terrain.zone, faces)]])
    assert (normals[:, 0] > 0.0).all()
    assert not normals[:, 1:].any()


@pytest.mark.parametrize("angle", [45.0, 70.0, 90.0])
@pytest.mark.parametrize(("roughness", "spacing"), [(0.15, 0.5), (0.3, 0.25), (1.0, 0.25), (1.0, 1.0)])
def test_a_rough_slope_nowhere_crosses_itself(angle: float, roughness: float, spacing: float) -> None:
    """Strips of the mesh would fold over if relief moved an edge; all pairs of segments of a profile are compared.

    Relief grows over FADE metres from an edge, so it tilts the first strip below a brow by about its height over FADE.
    """
    benches = Benches(
        face_angle_deg=angle, roughness=roughness, spacing=spacing, number=2, width=30.0, berm=5.0, crest=3.0, floor=5.0
    )
    columns = benches_terrain(benches).vertices.reshape(-1, benches.cells(benches.width) + 1, 3).transpose(1, 0, 2)
    assert not any(crosses_itself(column[:, [0, 2]]) for column in columns[::4])
    edge = profile_of(benches).edges[1]
    first = columns[:, edge + 1] - columns[:, edge]
    tilt = np.arctan2(-first[:, 2], first[:, 0]) - math.radians(angle)
    assert np.sqrt(np.mean(tilt**2)) < math.atan(2.0 * roughness / FADE)


def crosses_itself(points: np.ndarray) -> bool:
    """Return True if two segments of a polyline (P, 2) that are not neighbours cross."""
    a, b = points[:-1], points[1:]
    side = np.sign(cross((b - a)[:, None], a[None] - a[:, None])) * np.sign(
        cross((b - a)[:, None], b[None] - a[:, None])
    )
    apart = np.abs(np.subtract.outer(np.arange(len(a)), np.arange(len(a)))) > 1
    return bool(((side < 0) & (side.T < 0) & apart).any())


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def test_berms_of_a_rough_slope_have_the_width_of_the_design() -> None:
    terrain = benches_terrain(ROUGH)
    berm = terrain.vertices[terrain.triangles[terrain.zone == terrain.zones.index("berm_1")]].reshape(-1, 3)
    assert np.ptp(berm[:, 0]) == pytest.approx(ROUGH.berm)
    assert np.std(berm[:, 2]) > 0.05


def test_roughness_is_that_of_the_same_place_on_finer_meshes_and_depends_on_the_seed() -> None:
    coarse, fine, other = (
        benches_terrain(Benches(roughness=0.2, spacing=spacing, seed=seed, berm=8.0, floor=60.0, width=60.0))
        for spacing, seed in ((2.0, 1), (1.0, 1), (2.0, 2))
    )
    on_berm = [t.vertices[np.unique(t.triangles[t.zone == t.zones.index("berm_1")])] for t in (coarse, fine, other)]
    heights = [{(round(x, 6), round(y, 6)): z for x, y, z in points.tolist()} for points in on_berm]
    shared = heights[0].keys() & heights[1].keys()
    assert len(shared) == len(heights[0])
    assert all(heights[0][place] == pytest.approx(heights[1][place], abs=EXACT) for place in shared)
    assert max(abs(heights[0][place] - heights[2][place]) for place in shared) > 0.1


def test_a_brow_is_on_the_upper_edge_of_its_face() -> None:
    terrain = benches_terrain(ROUGH)
    for face, x in ((1, 0.0), (2, ROUGH.berm)):
        brow = brow_of(ROUGH, face)
        assert brow[[0, -1], 1].tolist() == [-10.0, 10.0]
        assert (brow[:, 0] == x).all()
        edge = terrain.vertices[np.abs(terrain.vertices[:, 0] - x) < EXACT]
        inner = brow[1:-1]
        nearest = np.abs(edge[None] - inner[:, None]).sum(axis=2).min(axis=1)
        assert (nearest < EXACT).all()


@pytest.mark.parametrize("engine", ["reference", "compiled"])
def test_a_rock_from_a_vertical_face_lands_where_its_parabola_says(tmp_path: Path, engine: str) -> None:
    scene = written(tmp_path, "{benches: {height: 12, face_angle_deg: 90, berm: 9, number: 2}}")
    impacts = rpf3d.simulate(scene, engine=engine).flights.impacts
    first = impacts.x[np.unique(impacts.row, return_index=True)[1]]
    fall = math.sqrt(2.0 * 12.5 / STANDARD_GRAVITY)
    assert len(first) == 40
    np.testing.assert_allclose(first[:, 0], 2.0 * fall, atol=1e-6)
    np.testing.assert_allclose(first[:, 2], 12.0, atol=1e-6)
    assert np.ptp(first[:, 1]) > 30.0


@pytest.mark.parametrize("angle", [65.0, 90.0])
def test_both_engines_give_the_same_bits_on_rough_benches(tmp_path: Path, angle: float) -> None:
    benches = f"{{benches: {{face_angle_deg: {angle}, roughness: 0.2, number: 2, width: 40}}}}"
    scene = written(tmp_path, benches, "crest: 2, velocity: [1, 0, 0], above_ground: 0.4")
    runs = [rpf3d.simulate(scene, engine=engine) for engine in ("reference", "compiled")]
    one, two = (run.flights.deposits.x for run in runs)
    assert np.array_equal(one, two)
    stopped = runs[0].flights.deposits
    assert stopped.release[:, 2] == pytest.approx(np.full(40, 15.0 + 0.4), abs=1e-6), "edges stay in place"


def test_a_berm_of_the_scene_is_raised_on_a_berm_of_the_slope(tmp_path: Path) -> None:
    berm = "{name: windrow, along: [[12.5, -40], [12.5, 40]], height: 1, width: 2}"
    scene = written(tmp_path, f"{{benches: {{}}, berms: [{berm}]}}")
    run = rpf3d.simulate(scene, engine="reference")
    assert area_of(run.terrain, "berm_windrow") > 80.0 * 2.0
    assert area_of(run.terrain, "berm_1") < 8.0 * 100.0 - 80.0 * 2.0 + 1.0


def test_key_paths_lead_to_the_parameters_of_benches(tmp_path: Path) -> None:
    scene = with_values(read_scene(written(tmp_path, "{benches: {berm: 6}}")), {"terrain.benches.face_angle_deg": 80})
    assert scene.terrain.benches == Benches(berm=6.0, face_angle_deg=80.0)
    with pytest.raises(rpf3d.InputError, match="did you mean `face_angle_deg`"):
        with_values(scene, {"terrain.benches.face_angle": 80})


@pytest.mark.parametrize(
    ("terrain", "source", "sentence"),
    [
        ("{benches: {height: 0}}", "crest: 1", "benches: height is 0.0; it must lie between 1 and 200"),
        ("{benches: {face_angle_deg: 91}}", "crest: 1", "face_angle_deg is 91.0; it must lie between 20 and 90"),
        ("{benches: {spacing: 0.001}}", "crest: 1", "triangles, and 5,000,000 is the most"),
        ("{benches: {berms: 3}}", "crest: 1", "`terrain.benches.berms` is not a key of a scene; did you mean `berm`?"),
        ("{benches: {}, pit: {}}", "crest: 1", "must have exactly one of files, pit, benches"),
        ("{benches: {}, up: y}", "crest: 1", "`terrain.up` is y, but the slope of `benches` has z up"),
        ("{benches: {}, berms: [{name: '1', along: [[1, 0], [2, 0]], height: 1, width: 2}]}", "crest: 1",
         "`terrain.berms[0].name` is '1', which is also the number of a berm"),
        ("{benches: {}}", "crest: 4", "`sources[0].crest` is 4, but the slope has 3 faces"),
        ("{pit: {}}", "crest: 1", "`sources[0].crest` is the number of a face of `terrain.benches`"),
    ],
)  # fmt: skip
def test_what_is_no_slope_is_refused_by_name(tmp_path: Path, terrain: str, source: str, sentence: str) -> None:
    with pytest.raises(rpf3d.InputError) as caught:
        read_scene(written(tmp_path, terrain, source))
    assert sentence in str(caught.value)


def test_a_slope_refuses_values_from_a_program_too() -> None:
    with pytest.raises(TerrainError, match=r"number is 1\.5; it must be a whole number"):
        Benches(number=1.5)  # type: ignore[arg-type]
