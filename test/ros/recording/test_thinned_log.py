"""Tests of what a recorder leaves out of a shift (rocks, hazard maps, repetitions) and what it always records."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Pose, PoseArray
from messages import recorded_messages as made

from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_messages import trajectory_markers
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.recording.files import Head
from rpf3d_ros.recording.message_log import MessageLog
from rpf3d_ros.recording.rock_entries import LINES, PATHS
from rpf3d_ros.recording.thinning import POINTS_A_ROCK, WHOLE, Thinning

SECOND = made.SECOND
ROCKS, MOST = 40, 10
AREA = (30.0, 34.0)
"""Northings (m) between which the haul ramp of `made.areas` lies; its eastings are 5 to 35 m."""


class Rows:
    """Stands in for a recording; keeps the name and the arguments of each method call in `calls`."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, kind):
        return lambda *about: self.calls.append((kind, *about))


class Recorder:
    """A thinned log with a clock `now_s` (s); keeps the drawn rows in order, and the entries in `kept`."""

    def __init__(self, thinning):
        self.now_s, self.rows, self.kept = 0.0, Rows(), []
        self.log = MessageLog(MapFrame(), "map", lambda: round(self.now_s * SECOND), thinning)

    def take(self, topic, message):
        return self.draw(self.log.received(topic, lambda: message))

    def draw(self, readings):
        """Draw the entries of readings; return the calls [(method, *arguments)] that drew them."""
        before = len(self.rows.calls)
        for reading in readings:
            for entry in reading.entries():
                entry.draw(self.rows)
                self.kept.append(entry)
        return self.rows.calls[before:]


def recorder(most=MOST, every=10.0):
    return Recorder(Thinning(rocks=most, maps_every=every))


def falling(reaching, rocks=ROCKS, points=80, second=1):
    """Return trajectory columns of rocks, of which those with the numbers in `reaching` reach the haul ramp."""
    rock = np.repeat(np.arange(rocks), points)
    along = np.tile(np.linspace(0.0, 1.0, points), rocks)
    columns = {"x": 6.0 + 28.0 * rock / rocks, "y": 29.0 * along, "z": 20.0 - along, "t": 4.0 * along, "rock": rock}
    columns["y"] = np.where(np.isin(rock, reaching), 31.0 / 29.0, 1.0) * columns["y"]
    return columns | {"speed": 3.0 + along, "energy": 700.0 * along + second}


def paths(second, reaching=(), **given):
    return cloud_of_columns(made.header(second), falling(reaching, second=second, **given))


def drawn(calls, kind, entity=None):
    return [call for call in calls if call[0] == kind and (entity is None or call[1] == entity)]


def easting_of(rocks):
    return {round(6.0 + 28.0 * number / ROCKS, 3) for number in rocks}


def eastings(points):
    return {round(float(x), 3) for x in points[:, 0]}


def test_all_rocks_that_reach_an_area_are_recorded_and_others_fill_up():
    node = recorder()
    node.take("areas/outlines", made.areas(1))
    calls = node.take(PATHS, paths(1, reaching=(7, 8, 30)))
    ((_, _, points, energy),) = drawn(calls, "points", PATHS)
    assert easting_of((7, 8, 30)) <= eastings(points)
    assert len(eastings(points)) == MOST
    assert len(points) == len(energy) == MOST * POINTS_A_ROCK


def test_more_rocks_than_asked_for_are_recorded_if_more_reach_an_area():
    node, reaching = recorder(), range(3, 33)
    node.take("areas/outlines", made.areas(1))
    ((_, _, points, _),) = drawn(node.take(PATHS, paths(1, reaching=reaching)), "points", PATHS)
    assert eastings(points) == easting_of(reaching)


def test_motion_lines_impacts_and_deposits_show_the_same_rocks():
    node, ends = recorder(), falling((5,), points=2)
    node.take("areas/outlines", made.areas(1))
    calls = node.take(PATHS, paths(1, reaching=(5,)))
    for topic in ("impacts", "deposits"):
        calls = [*calls, *node.take(topic, cloud_of_columns(made.header(1), ends))]
    (motion,), (lines,) = drawn(calls, "motion"), drawn(calls, "trajectories")
    shown = {topic: eastings(drawn(calls, "points", topic)[0][2]) for topic in (PATHS, "impacts", "deposits")}
    assert easting_of((5,)) <= shown[PATHS] and len(shown[PATHS]) == MOST
    assert shown["impacts"] == shown["deposits"] == shown[PATHS] == eastings(motion[1].positions[0])
    assert set().union(*(eastings(strip.points) for strip in lines[1])) == shown[PATHS]


def test_the_energies_are_those_of_all_impacts():
    (energies,) = drawn(recorder().take("impacts", cloud_of_columns(made.header(1), falling(()))), "energies")
    assert len(energies[1]) == ROCKS * 80


def test_lines_from_points_have_the_colours_of_the_published_lines():
    columns = falling((), rocks=5)
    (found,) = drawn(recorder().take(PATHS, cloud_of_columns(made.header(1), columns)), "trajectories")
    published = made.markers(trajectory_markers(made.header(1), columns, 200, POINTS_A_ROCK))
    whole = Recorder(WHOLE)
    (wanted,) = drawn(whole.take(LINES, published), "trajectories")
    for one, other in zip(found[1], wanted[1], strict=True):
        assert np.allclose(one.points, other.points, atol=1e-4)
        assert np.abs(one.colours.astype(int) - other.colours.astype(int)).max() <= 1


def unreadable():
    raise AssertionError("deserialized for nothing")


def test_published_lines_are_not_even_deserialized_where_their_points_follow():
    node = recorder()
    assert node.draw(node.log.received(LINES, unreadable)) == []
    assert len(drawn(node.take(PATHS, paths(1)), "trajectories")) == 1
    assert node.draw(node.log.rest()) == []


def test_published_lines_whose_points_do_not_follow_are_recorded_within_two_seconds():
    node = recorder()
    assert node.take(LINES, made.answers(1)[LINES]) == []
    node.now_s += 1.5
    assert len(drawn(node.draw(node.log.due()), "trajectories")) == 1


def test_published_lines_that_come_after_their_points_are_not_recorded_twice():
    node = recorder()
    answer = made.answers(1)
    node.take(PATHS, answer[PATHS])
    node.take(LINES, answer[LINES])
    assert node.draw(node.log.rest()) == []


def an_answer(node, second, **changes):
    """Let the recorder take an answer; return the names of the methods that draw its rows."""
    return [call[0] for topic, message in {**made.answers(second), **changes}.items()
            for call in node.take(topic, message)]  # fmt: skip


SHOWN = {"motion", "points", "trajectories", "energies", "hazard", "grid", "reach"}


@pytest.mark.parametrize("later", [1, 8])
def test_a_repeated_answer_is_recorded_once_whether_its_sources_are_the_same_or_new_ones(later):
    node, whole = recorder(every=0.5), Recorder(WHOLE)
    for one in (node, whole):
        one.take("areas/outlines", made.areas(1))
    counts = []
    for second in (1, later):
        node.now_s += 10.0
        counts.append([sum(kind in SHOWN for kind in an_answer(one, second)) for one in (node, whole)])
    (first, all_of_it), (again, all_again) = counts
    assert first == all_of_it > 0, "the first answer is recorded in full, its six rocks included"
    assert again == 0 < all_again


def test_the_figures_of_every_answer_are_recorded_and_so_are_its_sources():
    node = recorder()
    for second in (1, 2, 3):
        assert len(drawn(node.take("sources", PoseArray(header=made.header(second), poses=[Pose()])), "sources")) == 1
        assert an_answer(node, second).count("text") == 1


def test_rocks_of_the_same_sources_over_other_ground_are_recorded_again():
    node = recorder()
    node.take(PATHS, paths(1))
    moved = falling(())
    moved["z"] = moved["z"] + 0.5
    assert len(drawn(node.take(PATHS, cloud_of_columns(made.header(1), moved)), "points")) == 1


def test_rocks_are_chosen_again_when_an_area_has_moved():
    node, cloud = recorder(), paths(1, reaching=(7,))
    ((_, _, before, _),) = drawn(node.take(PATHS, cloud), "points", PATHS)
    node.take("areas/outlines", made.areas(1))
    ((_, _, after, _),) = drawn(node.take(PATHS, cloud), "points", PATHS)
    assert easting_of((7,)).isdisjoint(eastings(before)) and easting_of((7,)) <= eastings(after)


def test_an_answer_without_rocks_takes_the_last_ones_away_once():
    node, nothing = recorder(), {name: column[:0] for name, column in falling(()).items()}
    node.take(PATHS, paths(1))
    found = [node.take(PATHS, cloud_of_columns(made.header(second), nothing)) for second in (2, 3)]
    assert [[call[0] for call in calls] for calls in found] == [["clear", "trajectories"], []]


def test_what_is_refused_once_is_refused_again():
    bad = cloud_of_columns(made.header(1), falling(()) | {"t": np.tile([0.0, 2.0, 1.0, 3.0], 20 * ROCKS)})
    node = recorder()
    for _ in range(2):
        with pytest.raises(MessageRefused, match="goes back"):
            node.take(PATHS, bad)


def zones(number):
    """Return a message of hazard zones whose shape and stamp depend on `number`."""
    return made.hazard(made.header(number), {"0.1": np.full((1, 3, 3), float(number))})


def numbers_of(calls):
    return [int(call[2][0, 0, 0]) for call in drawn(calls, "hazard")]


def test_hazard_maps_are_recorded_at_the_stated_rate_and_the_newest_of_each_interval():
    node, found = recorder(every=10.0), []
    for second in range(0, 34, 2):
        node.now_s = float(second)
        found += numbers_of(node.take("hazard/zones", zones(second)))
    assert found == [0, 8, 18, 28]
    assert numbers_of(node.draw(node.log.rest())) == [32]


def test_a_map_that_waits_is_recorded_when_its_time_has_come_even_if_nothing_follows():
    node = recorder(every=10.0)
    node.take("hazard/zones", zones(0))
    node.now_s = 4.0
    node.take("hazard/zones", zones(4))
    assert node.draw(node.log.due()) == []
    node.now_s = 10.5
    assert numbers_of(node.draw(node.log.due())) == [4]


def test_at_a_change_of_level_the_maps_before_and_after_it_are_recorded():
    node, found = recorder(every=3600.0), []
    for second, level in enumerate(["normal", "normal", "normal", "evacuate", "evacuate", "evacuate"]):
        node.now_s = float(second)
        found.append(numbers_of(node.take("hazard/zones", zones(second))))
        found[-1] += numbers_of(node.take("alerts", made.alerts(second, level)))
    # The first alert counts as a change, too.
    assert found == [[0], [1], [], [3], [4], []]


def test_a_change_of_the_level_of_an_area_counts_as_well_and_new_words_do_not():
    node = recorder(every=3600.0)
    node.take("hazard/zones", zones(0))
    node.take("alerts", made.alerts(0, "watch"))
    node.take("hazard/zones", zones(1))
    worded, raised = made.alerts(2, "watch"), made.alerts(3, "watch")
    worded.status[0].message = "watch: 3 of 100 rocks"
    node.take("hazard/zones", zones(2))
    assert numbers_of(node.take("alerts", worded)) == []
    raised.status[1].values[0].value = "restrict"
    assert numbers_of(node.take("alerts", raised)) == [2]


def test_every_decision_is_recorded_with_its_words_however_fast_they_come():
    node = recorder(every=3600.0)
    for second in range(20):
        array = made.alerts(second, "watch")
        array.status[0].message = f"watch: {second} of 100 rocks"
        calls = node.take("alerts", array)
        assert len(drawn(calls, "alert")) == 1
        assert any(str(second) in call[2].message for call in drawn(calls, "text"))


def test_a_decision_that_a_heartbeat_repeats_is_not_recorded_again():
    node = recorder()
    assert node.take("alerts", made.alerts(1, "watch"))
    assert [node.take("alerts", made.alerts(1, "watch")) for _ in range(5)] == [[]] * 5


def test_a_new_file_begins_with_the_layers_that_are_not_recorded_again():
    node, head = recorder(every=0.0), Head()
    an_answer(node, 1)
    head.note(node.kept)
    again = Rows()
    for entry in head.entries():
        entry.draw(again)
    kinds = {(call[0], call[1]) if call[0] in ("points", "hazard") else call[0] for call in again.calls}
    assert {
        ("points", PATHS), ("points", "impacts"), ("points", "deposits"), ("hazard", "passed"), ("hazard", "stopped"),
        "trajectories", "reach", "grid",
    } <= kinds  # fmt: skip


def test_a_zone_that_is_gone_is_not_in_a_new_file():
    node, head = recorder(every=0.0), Head()
    node.take("hazard/zones", zones(1))
    node.take("hazard/zones", made.hazard(made.header(2), {"0.9": np.ones((1, 3, 3))}))
    head.note(node.kept)
    again = Rows()
    for entry in head.entries():
        entry.draw(again)
    shown = [call[:2] for call in again.calls if call[0] in ("hazard", "clear_hazard")]
    assert shown[-1] == ("hazard", "0.9") and ("hazard", "0.1") not in shown


@pytest.mark.parametrize(
    ("thinning", "words"),
    [
        (Thinning(rocks=12, maps_every=7.5), ("12 rocks", "every 7.5 s", "decision log, which is never thinned")),
        (Thinning(rocks=0, maps_every=7.5), ("not recorded again", "every 7.5 s")),
        (Thinning(rocks=12, maps_every=0.0), ("12 rocks", "when they change")),
        (WHOLE, ("as published",)),
    ],
)
def test_a_recording_states_what_it_leaves_out(thinning, words):
    (entry,) = Recorder(thinning).log.begin()
    rows = Rows()
    entry.draw(rows)
    ((kind, text),) = rows.calls
    assert kind == "about" and all(word in text for word in words)
    assert entry.keeps, "every file of a series states it"
