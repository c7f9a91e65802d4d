"""Tests of what a node prepares when it is configured: restored terrain, limits, checks of the scene."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.live_ground import pit_scene
from live_sites.surveyed_hills import cloud, grid

from rpf3d_core.errors import InputError
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.store import WHOLE, Store
from rpf3d_core.live.survey import CloudSurvey
from rpf3d_ros.engine import configuration
from rpf3d_ros.engine.configuration import _restored, configuration_of
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.messages.stamps import SECOND

SURVEYED = """
terrain: {pit: {}}
sources: [{name: crest, points: [[0, 0, 0]]}]
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 30}}
areas_of_interest:
  - name: ramp
    polygons: [[482000, 7401000], [482100, 7401000], [482100, 7401100]]
"""

ORIGIN = (482_000.0, 7_401_000.0, 0.0)

SITE = """
site: pit
valid_s: 2
alarm_from: restrict
evidence:
  {sources_max_age_s: 20, terrain_max_age_s: 3600, clock_tolerance_s: 1, fewest_rocks: 400, most_unfinished: 0.02}
areas:
  live_area*: {watch: {reach_probability: 0.02}, restrict: {reach_probability: 0.1}}
"""


def at(origin, **others):
    return SimulatorParameters(map_origin=origin, **others)


@pytest.fixture
def restored(tmp_path):
    """Yield a function that restores terrain from a store with a survey and two patches, for a given `map_origin`."""
    store, workshop = Store(tmp_path, map_origin=ORIGIN, longest_edge=0.0), Workshop(reference=True)
    ground = workshop.whole(grid(), stamp_ns=SECOND)
    store.keep(ground, grid())
    for stamp in (2, 3):
        ground = workshop.patched(ground, grid(8, 8, 12.3, 9.2, seed=stamp), stamp_ns=stamp * SECOND)
        store.keep(ground, grid(8, 8, 12.3, 9.2, seed=stamp))
    assert store.flush(20.0)
    scene = pit_scene(tmp_path).model_copy(update={"areas_of_interest": ()})
    yield lambda origin=ORIGIN: _restored(store, scene, Workshop(reference=True), at(origin), 9 * SECOND)
    store.close(20.0)


def test_what_is_restored_knows_the_times_of_its_patches_and_those_that_cannot_be_read(restored, tmp_path):
    standing, report, before = restored()
    assert standing.ground.patches == len(before.patches_ns) == 2
    assert report == "restored, 8 seconds old" and max(before.patches_ns) <= before.read_ns
    last = sorted(tmp_path.glob("patch-*"))[-1]
    last.write_bytes(last.read_bytes()[:-9])
    standing, report, before = restored()
    assert (standing.ground.patches, len(before.patches_ns), before.unread) == (1, 1, 1)
    assert last.name in report


def test_a_store_that_cannot_be_read_says_so_and_since_when(restored, tmp_path):
    (tmp_path / WHOLE).write_bytes(b"no survey")
    standing, report, before = restored()
    assert standing is None and before.read_ns > 0
    assert before.unreadable == report and "could not be restored" in report


def test_a_terrain_of_a_map_with_another_origin_is_not_restored(restored):
    """Otherwise the terrain would be in coordinates of the old map, and the sources in coordinates of the new map."""
    standing, report, before = restored((482_000.0, 7_401_060.0, 0.0))
    assert standing is None and before.unreadable == report
    assert "with map_origin [482000.0, 7401000.0, 0.0], but map_origin is now [482000.0, 7401060.0" in report


def test_a_terrain_that_an_older_version_stored_without_an_origin_is_not_restored(tmp_path):
    store = Store(tmp_path)
    store.keep(Workshop(reference=True).whole(grid()), grid())
    assert store.flush(20.0)
    standing, report, _ = _restored(store, pit_scene(tmp_path), Workshop(reference=True), at(ORIGIN), 0)
    store.close(20.0)
    assert standing is None and "stored by an older version, without map_origin: publish the whole terrain" in report


@pytest.mark.parametrize(
    ("before", "now", "is_restored"),
    [
        (0.0, 0.0, True),
        (5.0, 5.0, True),
        (3.0, 5.0, True),
        (None, 0.0, True),
        (5.0, 0.0, False),
        (0.0, 5.0, False),
        (9.0, 5.0, False),
        (None, 5.0, False),
    ],
)
def test_a_terrain_stored_with_its_patches_obeys_the_longest_edge_of_now_or_is_not_restored(
    tmp_path, before, now, is_restored
):  # fmt: skip
    """Its triangles are not made again, so ground that a stricter limit leaves out would stay."""
    store = Store(tmp_path, most_patches=0, map_origin=ORIGIN, longest_edge=before)
    workshop = Workshop(reference=True)
    ground = workshop.patched(workshop.whole(grid()), grid(8, 8, 12.3, 9.2, seed=2), stamp_ns=2 * SECOND)
    store.keep(ground, grid(8, 8, 12.3, 9.2, seed=2), is_patch=True)
    assert store.flush(20.0)
    scene = pit_scene(tmp_path).model_copy(update={"areas_of_interest": ()})
    standing, report, _ = _restored(store, scene, Workshop(reference=True), at(ORIGIN, longest_edge=now), 9 * SECOND)
    store.close(20.0)
    assert (standing is not None) == is_restored
    assert is_restored or f"but longest_edge is now {now:g}: publish the whole terrain" in report


def test_configuring_that_fails_leaves_the_store_free_for_the_next_time(tmp_path, monkeypatch):
    def broken(scene, parameters):
        raise RuntimeError("broken")

    monkeypatch.setattr(configuration, "warm", broken)
    with pytest.raises(RuntimeError, match="broken"):
        configuration_of(SimulatorParameters(store=str(tmp_path)), {}, 0)
    Store(tmp_path).close(20.0)


@pytest.fixture
def configured(tmp_path, monkeypatch):
    """Return a function that configures a node without compiling; the node has no site file if not `site`.

    given : values of the scene, by name; parameters : of the node
    """
    monkeypatch.setattr(configuration, "warm", lambda scene, parameters: 0.0)
    path = tmp_path / "site.yaml"
    path.write_text(SITE)

    def configured(given=(), site=True, **parameters):
        of_node = SimulatorParameters(site_file=str(path) if site else "", **parameters)
        return configuration_of(of_node, dict(given), 0)

    return configured


def test_with_a_site_file_stamps_may_be_ahead_by_no_more_than_its_tolerance(configured):
    """Evidence of several regions has their oldest stamp, so a stamp far ahead of the clock could hide a fault."""
    assert configured().most_ahead == 1.0
    assert configured(most_ahead=0.5).most_ahead == 0.5
    assert configured(site=False).most_ahead == 10.0


FRAGMENTS = """
terrain: {pit: {}}
sources: [{name: crest, points: [[0, 0, 0]]}]
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 30}}
effects: {fragmentation: {least_ratio: 0.4, least_volume: 0.02, generations: 1}}
"""


def test_with_a_site_file_rocks_must_not_break_because_shares_of_fragments_are_no_shares_of_rocks(configured, tmp_path):
    """35,000 fragments of 200 rocks can dilute the share of rocks that reach the area until it is below each limit."""
    (tmp_path / "scene.yaml").write_text(FRAGMENTS)
    with pytest.raises(InputError, match=r"Leave fragmentation out of the live scene"):
        configured({"scene": str(tmp_path / "scene.yaml")})
    assert configured({"scene": str(tmp_path / "scene.yaml")}, site=False).scene.effects.fragmentation is not None


def test_a_pattern_that_misses_an_area_by_upper_case_only_is_refused(configured, tmp_path):
    """A machine below a source would have no limits, and the level would be normal."""
    (tmp_path / "site.yaml").write_text(SITE.replace("live_area*:", "Equipment*:"))
    with pytest.raises(InputError, match=r"limits for Equipment\*, which matches no area; it would match equipment if"):
        configured()
    limits = SITE[SITE.index("{watch:") :]
    (tmp_path / "site.yaml").write_text(SITE.replace("live_area*:", "Equipment*:") + f"  '*': {limits}")
    with pytest.raises(InputError, match=r"limits for Equipment\*, which matches no area"):
        configured()
    (tmp_path / "site.yaml").write_text(SITE.replace("live_area*:", "Equipment*:") + f"  equipment: {limits}")
    assert configured().thresholds is not None, "the area has limits of its own"


@pytest.mark.parametrize("pattern", ["R*", "'[A-Z]*'", "'*amp'", "nothing*"])
def test_a_pattern_that_matches_an_area_or_is_about_none_is_accepted(configured, tmp_path, pattern):
    (tmp_path / "site.yaml").write_text(SITE.replace("live_area*:", f"{pattern}:"))
    scene = FRAGMENTS.partition("effects:")[0] + (
        "areas_of_interest: [{name: Ramp, polygons: [[0, 0], [20, 0], [20, 20], [0, 20]]}]\n"
    )
    (tmp_path / "scene.yaml").write_text(scene)
    assert configured({"scene": str(tmp_path / "scene.yaml")}).thresholds is not None


def test_a_material_of_a_zone_is_refused_because_live_terrain_has_one_zone(configured, tmp_path):
    scene = FRAGMENTS.partition("effects:")[0]
    scene = scene.replace("default:", "face: {normal_restitution: 0.3, tangential_restitution: 0.8}, default:")
    (tmp_path / "scene.yaml").write_text(scene)
    with pytest.raises(InputError, match=r"`materials\.face` fits no zone .* terrain has only one zone, 'terrain'"):
        configured({"scene": str(tmp_path / "scene.yaml")}, site=False)


def test_a_gap_of_scattered_points_is_a_hole_if_the_parameter_says_how_long_a_triangle_may_be(configured):
    """By default a triangle may be ten times as long as the median: a gap of 6 m between points 1 m apart is ground."""
    points = cloud(1600, 0.0, 0.0, 40.0).points
    middle = np.abs(points[:, :2] - points[:, :2].mean(axis=0)).max(axis=1) < 3.0
    gap, centre = CloudSurvey(points[~middle]), np.array([[0.0, 0.0, 1e3]])

    def has_ground(**parameters):
        workshop = configured({"engine": "reference"}, **parameters).workshop
        return bool(workshop.whole(gap).engine.ground_below(centre)[0, 1] >= 0)

    assert has_ground() and has_ground(longest_edge=20.0)
    assert not has_ground(longest_edge=4.0)


def test_an_area_in_survey_coordinates_is_refused_when_configuring_with_the_frame_that_it_must_have(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(SURVEYED)
    with pytest.raises(InputError, match=r"'ramp' has coordinates up to 7401100 m, but must be in the map frame"):
        configuration_of(SimulatorParameters(map_origin=(482_000.0, 7_401_000.0, 0.0)), {"scene": str(scene)}, 0)


SPECK = "[0, 0], [0.001, 0], [0.001, 0.001]"
DEGREES = SURVEYED.replace("[482000, 7401000], [482100, 7401000], [482100, 7401100]", SPECK)


def test_an_area_that_is_a_speck_is_refused_because_its_corners_may_be_degrees(tmp_path):
    """Otherwise the node would watch the area at the origin of the map, which no rock reaches."""
    scene = tmp_path / "scene.yaml"
    scene.write_text(DEGREES)
    with pytest.raises(InputError, match=r"'ramp' encloses only 5e-07 m2, .* or in degrees or kilometres\?"):
        configuration_of(SimulatorParameters(), {"scene": str(scene)}, 0)


FENCED = """
engine: reference
terrain: {pit: {}}
sources: [{name: crest, points: [[0, 0, 0]]}]
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8, friction_angle_deg: 30}}
effects:
  barriers: {panels: [{name: fence, along: [[-400, -900], [-400, -700]], height: 3, capacity_kj: 500}]}
"""


def test_barriers_anywhere_in_the_map_do_not_keep_the_node_from_being_configured(tmp_path):
    """The artificial slope that is used to compile the loops needs no place below the barriers."""
    (tmp_path / "scene.yaml").write_text(FENCED)
    made = configuration_of(SimulatorParameters(), {"scene": str(tmp_path / "scene.yaml")}, 0)
    panel = made.scene.effects.barriers.panels[0]
    assert [tuple(point) for point in panel.along] == [(-400.0, -900.0), (-400.0, -700.0)]
