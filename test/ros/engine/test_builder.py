"""Tests of the thread that builds terrain: no error ends it or hides that a part of the terrain is missing."""

import itertools
import threading
from functools import partial

import numpy as np
import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.live_ground import pit_scene

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.answers import EnsembleSize
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.standing import stand_on
from rpf3d_core.live.store import Store, read_last
from rpf3d_core.live.survey import CloudSurvey, GridSurvey
from rpf3d_ros.engine.builder import Builder
from rpf3d_ros.engine.flyer import Flyer
from rpf3d_ros.engine.survey_in_use import Arrival, SurveyInUse, survey_in_use
from rpf3d_ros.engine.waiting_sources import WaitingSources
from rpf3d_ros.engine.waiting_terrain import Moment, WaitingTerrain
from rpf3d_ros.messages.map_frame import rigid_transform

PATIENCE = 120.0
"""Time limit (s) of a wait for something that takes 1 s, or 30 s while the loops are compiled."""
wait = partial(wait_for, seconds=PATIENCE)


class BuilderReports:
    """Keeps what the builder and the flyer report."""

    def __init__(self):
        self.grounds, self.refused, self.errors, self.holes = [], [], [], []

    def stands(self, ground, what, holes=0):
        self.grounds.append(ground.digest)
        self.holes.append(holes)

    def terrain_refused(self, why):
        self.refused.append(why)

    def failed(self, error):
        self.errors.append(error)


class FullStore:
    """A terrain store that raises MemoryError for each terrain."""

    def keep(self, ground, survey, is_patch=False):
        raise MemoryError


def hill(height=0.0, count=21):
    y, x = np.mgrid[0:count, 0:count] * 2.0
    return GridSurvey(np.stack([x, y, 0.5 * x + height], axis=-1))


def small_patch():
    return GridSurvey(hill().points[5:10, 5:10] + (0.5, 0.5, 0.1))


def arrival(survey, data=b""):
    return Arrival(lambda: survey, 1, data)


@pytest.fixture
def made(tmp_path):
    """Yield a function that starts a builder with its flyer; end all these threads after the test.

    The function returns the queue of terrain, the flyer, and a `BuilderReports`.
    """
    threads = []

    def make(store=None, in_use=SurveyInUse(), now_ns=100, replaced=()):  # noqa: B008
        scene, reports, waiting = pit_scene(tmp_path), BuilderReports(), WaitingTerrain(8)
        scene = scene.model_copy(update={"areas_of_interest": ()})
        flyer = Flyer(ReleaseSpread(), EnsembleSize(100), WaitingSources(50.0, 10), itertools.count(1), reports)
        before = in_use, replaced
        builder = Builder(scene, Workshop(reference=True), waiting, flyer, reports, store, lambda: now_ns, *before)
        threads.extend((builder, flyer))
        return waiting, flyer, reports

    yield make
    assert all(thread.close(PATIENCE) for thread in threads)


def test_a_store_that_fails_does_not_end_the_thread(made):
    waiting, _, reports = made(FullStore())
    for height in (0.0, 1.0):
        count = len(reports.grounds)
        waiting.put_whole(Arrival(partial(hill, height), 1 + count))
        wait(lambda count=count: len(reports.grounds) > count)
    assert isinstance(wait(lambda: reports.errors)[0], MemoryError) and not reports.refused


def test_a_patch_that_is_refused_is_told_of_as_lost_until_the_next_whole_survey(made):
    waiting, _, reports = made()
    waiting.put_whole(arrival(hill()))
    wait(lambda: reports.grounds)
    waiting.put_patch(arrival(CloudSurvey(np.zeros((1, 3)))))
    wait(lambda: reports.refused)
    assert waiting.lost_patches == 1
    waiting.put_whole(Arrival(partial(hill, 1.0), 2))
    wait(lambda: len(reports.grounds) == 2)
    assert waiting.lost_patches == 0


def test_a_patch_that_leaves_nothing_of_the_ground_is_stored_as_a_patch(made, tmp_path):
    """Otherwise a latched survey would replace it silently after a restart."""
    store = Store(tmp_path / "store")
    waiting, flyer, reports = made(store)
    waiting.put_whole(arrival(hill(count=15)))
    wait(lambda: reports.grounds)
    waiting.put_patch(arrival(GridSurvey(hill(count=25).points - (5.0, 5.0, 0.0))))
    wait(lambda: len(reports.grounds) == 2 and len(waiting) == 0)
    last = wait(lambda: store.flush(0.0) and (found := read_last(store.folder)) and found.patches_ns(1) and found)
    store.close(PATIENCE)
    assert flyer.standing.ground.patches == 0 and len(last.pieces) == 1
    assert last.patches_ns(1) == (1,)


def test_the_same_mesh_again_is_made_ground_where_a_patch_has_failed_half_way(made, monkeypatch):
    waiting, flyer, reports = made()
    waiting.put_whole(arrival(hill(), b"mesh"))
    waiting.put_patch(arrival(GridSurvey(hill().points[12:18, 12:18] + (0.5, 0.5, 0.1))))
    wait(lambda: len(reports.grounds) == 2)

    def no_ground(*given):
        raise TerrainError("no ground")

    monkeypatch.setattr("rpf3d_ros.engine.builder.stand_after", no_ground)
    waiting.put_patch(arrival(small_patch()))
    wait(lambda: reports.refused)
    assert flyer.standing is None, "its arrays have changed"
    waiting.put_whole(arrival(hill(), b"mesh"))
    wait(lambda: flyer.standing is not None and len(waiting) == 0)
    assert waiting.lost_patches == 2, "the patch before it is gone, too"


def test_a_mesh_that_is_the_terrain_already_makes_it_no_younger(made):
    """A latched mesh is received again after a restart that restored the terrain from the store."""
    waiting, flyer, reports = made()
    waiting.put_whole(Arrival(hill, 1, b"mesh"))
    wait(lambda: len(reports.grounds) == 1)
    waiting.put_whole(Arrival(hill, 9, b"its bytes after another start"))
    wait(lambda: len(reports.grounds) == 2)
    assert flyer.standing.ground.stamp_ns == 1
    waiting.put_whole(Arrival(hill, 0, b"its bytes after another start"))
    wait(lambda: len(reports.grounds) == 3)
    assert flyer.standing.ground.stamp_ns == 0, "the clock was set back"
    waiting.put_whole(Arrival(hill, 5, b"its bytes after another start"))
    wait(lambda: len(reports.grounds) == 4)
    assert flyer.standing.ground.stamp_ns == 5, "0 is no age"
    waiting.put_whole(Arrival(hill, 9))
    wait(lambda: len(reports.grounds) == 5)
    assert flyer.standing.ground.stamp_ns == 9, "a cloud has a stamp of its own"


@pytest.mark.parametrize("data", [b"mesh", b""], ids=["a mesh", "a cloud of the same stamp"])
def test_a_survey_that_is_published_again_after_a_patch_takes_nothing_away(made, data):
    """A program may repeat a survey every minute; the patch is newer than the survey."""
    waiting, flyer, reports = made()
    waiting.put_whole(Arrival(hill, 1, data))
    wait(lambda: len(reports.grounds) == 1)
    waiting.put_patch(Arrival(small_patch, 2))
    wait(lambda: len(reports.grounds) == 2)
    waiting.put_patch(arrival(CloudSurvey(np.zeros((1, 3)))))
    wait(lambda: reports.refused)
    for stamp, count in ((3 if data else 1, 3), (4 if data else 1, 4)):
        waiting.put_whole(Arrival(hill, stamp, data))
        wait(lambda count=count: len(reports.grounds) == count)
        assert reports.grounds[-1] == reports.grounds[1] != reports.grounds[0]
        assert (flyer.standing.ground.patches, flyer.standing.ground.whole_ns) == (1, 1)
        assert waiting.lost_patches == 1
    waiting.put_whole(Arrival(partial(hill, 1.0), 5, b"another mesh" if data else b""))
    wait(lambda: len(reports.grounds) == 5 and waiting.lost_patches == 0)


def test_a_mesh_that_was_in_use_before_a_newer_survey_is_refused(made):
    """A server may repeat its mesh for ever, while a newer survey came on another topic."""
    waiting, flyer, reports = made()
    waiting.put_whole(Arrival(hill, 1, b"mesh"))
    wait(lambda: len(reports.grounds) == 1)
    waiting.put_whole(Arrival(partial(hill, 1.0), 2))
    wait(lambda: len(reports.grounds) == 2)
    waiting.put_whole(Arrival(hill, 3, b"mesh"))
    wait(lambda: reports.refused)
    assert "older than the terrain in use" in reports.refused[0] and waiting.refused_surveys == 1
    assert flyer.standing.ground.digest == reports.grounds[1]
    waiting.put_whole(Arrival(partial(hill, 1.0), 4))
    wait(lambda: len(reports.grounds) == 3)
    assert waiting.refused_surveys == 0


def facts_before(waiting, reports, *surveys):
    """Put surveys into use one after the other."""
    for count, survey in enumerate(surveys, 1):
        waiting.put_whole(survey)
        wait(lambda count=count: len(reports.grounds) == count)


def test_an_older_cloud_than_the_last_one_in_use_is_refused_also_after_a_restart(made):
    """A survey program that starts again may publish the cloud of yesterday, with its own stamp."""
    waiting, _, reports = made()
    facts_before(waiting, reports, Arrival(hill, 5), Arrival(partial(hill, 1.0), 8))
    waiting.put_whole(Arrival(hill, 5))
    wait(lambda: reports.refused)
    assert "older than that of the last cloud" in reports.refused[0] and waiting.refused_surveys == 1
    in_use = survey_in_use(None, {"whole": reports.grounds[1], "whole_ns": 8, "cloud_ns": 8})
    waiting, flyer, again = made(in_use=in_use)
    waiting.put_whole(Arrival(hill, 5))
    wait(lambda: again.refused)
    assert flyer.standing is None and not again.grounds
    waiting, _, back = made(in_use=in_use, now_ns=6)
    waiting.put_whole(Arrival(hill, 5))
    wait(lambda: back.refused)
    waiting.put_whole(Arrival(hill, 6))
    wait(lambda: back.grounds)
    assert len(back.refused) == 1, "the clock went back: the stamp of the former cloud is in the future"


def test_a_mesh_that_was_in_use_before_a_newer_survey_is_refused_after_a_restart_too(made):
    waiting, _, reports = made()
    facts_before(waiting, reports, Arrival(hill, 1, b"mesh"), Arrival(partial(hill, 1.0), 2, b"newer"))
    waiting, flyer, again = made(in_use=SurveyInUse(reports.grounds[1], 2), replaced=reports.grounds[:1])
    waiting.put_whole(Arrival(hill, 9, b"its bytes after another start"))
    wait(lambda: again.refused)
    assert "older than the terrain in use" in again.refused[0] and flyer.standing is None


def test_what_was_in_use_before_is_remembered_for_the_next_start(made, monkeypatch):
    monkeypatch.setattr("rpf3d_ros.engine.builder.SAVED", 2)
    builders, original = [], Builder.__init__
    monkeypatch.setattr(Builder, "__init__", lambda self, *args: builders.append(self) or original(self, *args))
    waiting, _, reports = made()
    meshes = [Arrival(partial(hill, float(k)), 1 + k, b"%d" % k) for k in range(4)]
    facts_before(waiting, reports, *meshes, Arrival(partial(hill, 9.0), 7), Arrival(partial(hill, 10.0), 8))
    facts = {"cloud_ns": 8, "cloud_digest": reports.grounds[5], "is_mesh": False}
    assert builders[0].to_remember() == {**facts, "replaced": reports.grounds[2:4]}, "clouds push out no mesh"


def test_a_cloud_that_a_mesh_has_replaced_does_not_return(made):
    waiting, flyer, reports = made()
    facts_before(waiting, reports, Arrival(hill, 5), Arrival(partial(hill, 1.0), 6, b"mesh"))
    facts = {"whole": reports.grounds[1], "whole_ns": 6, "cloud_ns": 5, "cloud_digest": reports.grounds[0]}
    for queue, flies, found in ((waiting, flyer, reports), made(in_use=survey_in_use(None, facts))):
        for count, stamp in enumerate((5, 0), 1):
            queue.put_whole(Arrival(hill, stamp))
            wait(lambda found=found, count=count: len(found.refused) == count)
        grounds = len(found.grounds)
        queue.put_whole(Arrival(partial(hill, 1.0), 9, b"mesh"))
        wait(lambda found=found, grounds=grounds: len(found.grounds) > grounds)
        wait(lambda flies=flies: flies.standing is not None)
        assert (found.grounds[-1], flies.standing.ground.whole_ns) == (reports.grounds[1], 6)


def test_a_repetition_with_an_older_stamp_lets_no_older_cloud_pass(made):
    waiting, _, reports = made()
    facts_before(waiting, reports, Arrival(hill, 8), Arrival(hill, 3))
    waiting.put_whole(Arrival(partial(hill, 1.0), 5))
    wait(lambda: reports.refused)
    assert "older than that of the last cloud" in reports.refused[0]


def test_after_the_clock_was_seen_to_go_back_former_meshes_and_older_clouds_are_still_refused(made, monkeypatch):
    builders, original = [], Builder.__init__
    monkeypatch.setattr(Builder, "__init__", lambda self, *args: builders.append(self) or original(self, *args))
    waiting, _, reports = made()
    facts_before(waiting, reports, Arrival(hill, 8), Arrival(partial(hill, 1.0), 9, b"a"), Arrival(hill, 9, b"b"))
    builders[0].clock_went_back(4)
    builders[0].clock_went_back(5)
    old = (Arrival(partial(hill, 1.0), 6, b"a"), Arrival(partial(hill, 2.0), 3))
    for count, survey in enumerate(old, 1):
        waiting.put_whole(survey)
        wait(lambda count=count: len(reports.refused) == count)
    waiting.put_whole(Arrival(partial(hill, 3.0), 4))
    wait(lambda: len(reports.grounds) == 4)
    assert len(reports.refused) == 2


def test_without_a_store_a_mesh_that_was_in_use_before_a_restart_gets_no_younger(made):
    waiting, _, reports = made()
    facts_before(waiting, reports, Arrival(hill, 3, b"mesh"))
    waiting, flyer, again = made(in_use=survey_in_use(None, {"whole": reports.grounds[0], "whole_ns": 3}))
    waiting.put_whole(Arrival(hill, 90, b"its bytes after another start"))
    wait(lambda: again.grounds)
    assert (flyer.standing.ground.whole_ns, flyer.standing.ground.stamp_ns) == (3, 3)


def test_a_cloud_of_a_newer_stamp_is_a_new_survey_though_its_points_are_the_same(made):
    waiting, flyer, reports = made()
    waiting.put_whole(Arrival(hill, 1))
    wait(lambda: len(reports.grounds) == 1)
    waiting.put_patch(Arrival(small_patch, 2))
    wait(lambda: len(reports.grounds) == 2)
    waiting.put_whole(Arrival(hill, 3))
    wait(lambda: len(reports.grounds) == 3)
    assert (flyer.standing.ground.patches, flyer.standing.ground.whole_ns) == (0, 3)


def test_a_survey_again_after_the_clock_was_set_back_lacks_the_patches_that_the_terrain_had(made):
    waiting, flyer, reports = made()
    waiting.put_whole(Arrival(hill, 10, b"mesh"))
    wait(lambda: len(reports.grounds) == 1)
    waiting.put_patch(Arrival(small_patch, 11))
    wait(lambda: len(reports.grounds) == 2)
    waiting.put_whole(Arrival(hill, 5, b"mesh"))
    wait(lambda: len(reports.grounds) == 3)
    assert (flyer.standing.ground.patches, flyer.standing.ground.whole_ns, waiting.lost_patches) == (0, 5, 1)


def test_a_survey_again_after_a_patch_that_replaced_the_terrain_does_not_replace_the_patch(made):
    waiting, _, reports = made()
    waiting.put_whole(Arrival(lambda: hill(count=15), 1, b"mesh"))
    wait(lambda: len(reports.grounds) == 1)
    waiting.put_patch(Arrival(lambda: GridSurvey(hill(count=25).points - (5.0, 5.0, 0.0)), 2))
    wait(lambda: len(reports.grounds) == 2)
    waiting.put_whole(Arrival(lambda: hill(count=15), 3, b"mesh"))
    wait(lambda: len(reports.grounds) == 3)
    assert reports.grounds[2] == reports.grounds[1]


def test_a_survey_again_after_a_restart_keeps_the_patches_of_the_store(made, tmp_path):
    store = Store(tmp_path / "store")
    waiting, _, reports = made(store)
    waiting.put_whole(Arrival(hill, 1, b"mesh"))
    wait(lambda: len(reports.grounds) == 1)
    waiting.put_patch(Arrival(small_patch, 2))
    wait(lambda: len(reports.grounds) == 2)
    last = wait(lambda: store.flush(0.0) and (found := read_last(store.folder)) and len(found.pieces) == 2 and found)
    store.close(PATIENCE)
    restored = last.ground(Workshop(reference=True))
    waiting, flyer, again = made(in_use=survey_in_use(restored, {}))
    flyer.hand_over(ready=stand_on(restored, pit_scene(tmp_path)))
    waiting.put_whole(Arrival(hill, 3, b"its bytes after another start"))
    wait(lambda: again.grounds)
    assert again.grounds == [reports.grounds[1]] and flyer.standing.ground.patches == 1


def test_the_same_mesh_after_its_frame_was_surveyed_again_is_new_ground(made):
    """The bytes of a mesh do not show where it lies if its frame is that of a drone."""
    waiting, flyer, reports = made()
    places = [rigid_transform("drone", (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, height)) for height in (0.0, 0.0, 2.0)]
    for number, place in enumerate(places, 1):
        survey = hill(place.translation[2])
        waiting.put_whole(Arrival(lambda survey=survey: survey, number, b"mesh", place))
        wait(lambda number=number: len(reports.grounds) == number)
    assert reports.grounds[0] == reports.grounds[1] != reports.grounds[2]
    assert flyer.standing.ground.stamp_ns == 3


def test_two_clouds_of_one_stamp_and_other_content_are_a_fault_until_a_later_stamp(made):
    waiting, flyer, reports = made()
    facts_before(waiting, reports, Arrival(hill, 5))
    waiting.put_whole(Arrival(partial(hill, 1.0), 5), Moment(2, 5))
    wait(lambda: reports.refused)
    assert "its stamp is that of the last cloud that was in use, but its content is different" in waiting.why_refused
    assert flyer.standing.ground.digest == reports.grounds[0]
    waiting.put_whole(Arrival(hill, 5), Moment(3, 5))
    wait(lambda: len(reports.grounds) == 2)
    assert waiting.why_refused, "the first survey again proves nothing"
    waiting.put_whole(Arrival(partial(hill, 2.0), 6), Moment(4, 6))
    wait(lambda: len(reports.grounds) == 3)
    assert not waiting.why_refused and len(reports.refused) == 1


def test_two_clouds_of_one_stamp_are_compared_also_if_both_have_waited(made):
    waiting, _, reports = made()
    begun = threading.Event()

    def slow():
        begun.wait(PATIENCE)
        return hill(9.0)

    waiting.put_whole(Arrival(slow, 4), Moment(1, 4))
    for number, survey in enumerate((hill(), hill(), hill(1.0)), 2):
        waiting.put_whole(Arrival(lambda survey=survey: survey, 5), Moment(number, 5))
    begun.set()
    wait(lambda: reports.refused)
    assert "its content is different" in waiting.why_refused


def test_holes_inside_patches_are_counted_until_the_next_whole_survey(made):
    waiting, _, reports = made()
    waiting.put_whole(Arrival(hill, 1))
    patch = GridSurvey(hill().points[3:12, 3:12] + (0.0, 0.0, 0.1))
    patch.points[4:6, 4] = np.nan
    waiting.put_patch(Arrival(lambda: patch, 2))
    waiting.put_patch(Arrival(small_patch, 3))
    wait(lambda: len(reports.holes) == 3)
    waiting.put_whole(Arrival(partial(hill, 1.0), 4))
    wait(lambda: len(reports.holes) == 4)
    assert reports.holes == [0, 2, 2, 0]
