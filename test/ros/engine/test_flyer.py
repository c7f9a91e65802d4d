"""Tests of the thread that answers triggers: what it does first, what ends a refinement, and what it reports."""

import itertools
import threading
import time
from functools import partial

import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.live_ground import over_the_wall, pit_ground, pit_scene

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.answers import EnsembleSize, answers
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.standing import stand_on
from rpf3d_core.live.triggers import trigger_of
from rpf3d_ros.engine.answered_sources import AnsweredSources
from rpf3d_ros.engine.flyer import Flyer
from rpf3d_ros.engine.waiting_sources import WaitingSources

PATIENCE = 120.0
"""Time limit (s) of a wait for something that takes 1 s, or 30 s while the loops are compiled."""
wait = partial(wait_for, seconds=PATIENCE)
ENDLESS = "target: {half_width: 1.0e-9, most_rocks: 100000000}"
LONG = "target: {half_width: 1.0e-9, most_rocks: 50000}"
SHORT = "target: {half_width: 1.0e-9, most_rocks: 400}"


class FlyerReports:
    """Keeps what the flyer reports.

    stops_at : number of the answer (from 1) at which the flyer's thread waits until the test sets `goes_on`
    """

    def __init__(self):
        self.answers, self.refused, self.missing, self.errors = [], [], [], []
        self.stops_at, self.goes_on = 0, threading.Event()

    def answered(self, answer):
        self.answers.append((answer.trigger.stamp_ns, answer.rocks, answer.standing.ground.digest, answer.complete))
        if len(self.answers) == self.stops_at:
            self.goes_on.wait(PATIENCE)

    def unanswerable(self, trigger, why):
        self.refused.append((trigger.stamp_ns, why))

    def groundless(self, trigger):
        self.missing.append(trigger.stamp_ns)

    def failed(self, error, trigger=None):
        self.errors.append(error)


@pytest.fixture
def made(tmp_path):
    """Yield a function that starts a flyer; end all flyers after the test.

    The function returns the flyer, its `FlyerReports`, and the prepared terrain of the pit.
    """
    flyers = []

    def make(more=SHORT, age_s=0.0):
        scene, reports = pit_scene(tmp_path, more), FlyerReports()
        sources, spread = WaitingSources(50.0, 10), ReleaseSpread(above_ground=2.0)
        answered = AnsweredSources(age_s, 40)
        flyer = Flyer(spread, EnsembleSize(100), sources, itertools.count(1), reports, answered)
        flyers.append(flyer)
        return flyer, reports, stand_on(pit_ground(scene), scene)

    yield make
    assert all(flyer.close(PATIENCE) for flyer in flyers)


def complete(reports, stamp):
    return lambda: any(answer[0] == stamp and answer[3] for answer in reports.answers)


def at_rest(flyer, reports, stamp):
    """Return a function that is true when the flyer is idle and its last answer is the complete one to `stamp`."""

    def rests():
        with flyer._changed:  # its thread waits for work, so it has not taken a trigger out of the queue
            waits = bool(flyer._changed._waiters) and not flyer._has_work()
        return waits and reports.answers and reports.answers[-1][0] == stamp and reports.answers[-1][3]

    return rests


def test_a_trigger_without_ground_waits_for_it_and_is_answered_then(made):
    flyer, reports, standing = made()
    flyer.activate()
    flyer.submit(over_the_wall(3, stamp_ns=5))
    assert wait(lambda: reports.missing) == [5]
    flyer.hand_over(ready=standing)
    wait(complete(reports, 5))
    assert [answer[:2] for answer in reports.answers] == [(5, 102), (5, 204)]


def test_new_ground_is_answered_with_the_last_trigger(made):
    flyer, reports, standing = made()
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    wait(complete(reports, 5))
    other = stand_on(pit_ground(standing.scene), standing.scene)
    object.__setattr__(other.ground, "digest", "another")
    count = len(reports.answers)
    flyer.hand_over(ready=other)
    wait(lambda: len(reports.answers) == 2 * count)
    assert {answer[2] for answer in reports.answers[count:]} == {"another"}


def test_a_newer_trigger_ends_a_refinement_that_would_never_end(made):
    flyer, reports, standing = made(ENDLESS)
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    wait(lambda: len(reports.answers) > 2)
    flyer.submit(over_the_wall(3, stamp_ns=6))
    wait(lambda: reports.answers[-1][0] == 6)
    flyer.deactivate()


@pytest.mark.parametrize(("age_s", "ended"), [(30.0, True), (0.0, False)], ids=["fresh", "too old"])
def test_a_refinement_that_another_wall_interrupts_is_made_up_for_and_the_newest_comes_last(made, age_s, ended):
    flyer, reports, standing = made(LONG, age_s)
    reports.stops_at = 1
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5, topic="sources"))
    wait(lambda: reports.answers)
    flyer.submit(over_the_wall(1, stamp_ns=6, topic="source_cloud"))
    reports.goes_on.set()
    wait(at_rest(flyer, reports, 6))
    assert complete(reports, 5)() is ended


def test_a_refinement_that_its_own_wall_interrupts_is_given_up(made):
    flyer, reports, standing = made(LONG, 30.0)
    reports.stops_at = 1
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    wait(lambda: reports.answers)
    flyer.submit(over_the_wall(3, stamp_ns=6))
    reports.goes_on.set()
    wait(at_rest(flyer, reports, 6))
    assert not complete(reports, 5)()


def test_who_begins_again_tells_nothing_less_sure_than_before_unless_the_question_is_another(made):
    flyer, reports, standing = made(LONG, 30.0)
    reports.stops_at = 3
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5, topic="sources"))
    wait(lambda: len(reports.answers) == 3)
    flyer.submit(over_the_wall(1, stamp_ns=6, topic="source_cloud"))
    reports.goes_on.set()
    wait(at_rest(flyer, reports, 6))
    rocks = {stamp: [answer[1] for answer in reports.answers if answer[0] == stamp] for stamp in (5, 6)}
    assert all(told == sorted(told) for told in rocks.values()), rocks
    del reports.answers[:]
    flyer.set_areas("areas/polygon", {"live_area": [over_the_wall(3).positions[:, :2]]})
    wait(at_rest(flyer, reports, 6))
    assert min(answer[1] for answer in reports.answers if answer[0] == 6) < 200


def test_a_wall_that_finds_no_room_is_answered_once_there_is_time(made):
    flyer, reports, standing = made(SHORT, 30.0)
    far = over_the_wall(1, stamp_ns=0)
    walls = [trigger_of(far.positions, far.velocities, None, i, f"radar {i}") for i in range(12)]
    flyer.hand_over(ready=standing)
    pushed_out = [flyer.submit(trigger) for trigger in walls]
    assert [trigger.stamp_ns for trigger in pushed_out if trigger is not None] == [0, 1]
    flyer.activate()
    wait(at_rest(flyer, reports, 11))
    assert all(complete(reports, stamp)() for stamp in range(12))


def test_a_first_answer_is_given_whatever_comes_meanwhile(made):
    flyer, reports, standing = made(ENDLESS)
    flyer.activate()
    flyer.hand_over(ready=standing)
    stop = threading.Event()

    def flood():
        for stamp in itertools.count(10):
            if stop.is_set():
                return
            flyer.submit(over_the_wall(3, stamp_ns=stamp))
            time.sleep(1e-3)

    thread = threading.Thread(target=flood)
    thread.start()
    wait(lambda: len(reports.answers) > 5)
    stop.set()
    thread.join()
    flyer.deactivate()


def test_a_refused_change_of_ground_is_told_to_who_made_it_and_changes_nothing(made):
    flyer, reports, standing = made()
    flyer.activate()
    flyer.hand_over(ready=standing)

    def refuse(ground):
        raise TerrainError("no terrain")

    with pytest.raises(TerrainError, match="no terrain"):
        flyer.hand_over(change=refuse)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    wait(complete(reports, 5))


def test_a_refinement_goes_on_after_a_change_that_was_refused(made):
    flyer, reports, standing = made(ENDLESS)
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    wait(lambda: len(reports.answers) > 2)

    def refuse(ground):
        raise TerrainError("no terrain")

    with pytest.raises(TerrainError):
        flyer.hand_over(change=refuse)
    count = len(reports.answers)
    wait(lambda: len(reports.answers) > count)
    flyer.deactivate()


def test_after_a_change_that_failed_half_way_nothing_is_flown_over_it_and_that_is_told(made):
    flyer, reports, standing = made(ENDLESS)
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    wait(lambda: len(reports.answers) > 1)
    with pytest.raises(ZeroDivisionError):
        flyer.hand_over(change=lambda standing: 1 / 0)
    count = len(reports.answers)
    assert wait(lambda: reports.missing) == [5] and flyer.standing is None
    time.sleep(0.2)
    assert len(reports.answers) == count


def test_what_is_in_flight_when_its_trigger_is_forgotten_is_not_answered(made, monkeypatch):
    flyer, reports, standing = made()
    flying, go_on = threading.Event(), threading.Event()

    def slow(*given):
        flying.set()
        go_on.wait(PATIENCE)
        yield from answers(*given)

    monkeypatch.setattr("rpf3d_ros.engine.flyer.answers", slow)
    flyer.hand_over(ready=standing)
    flyer.activate()
    flyer.submit(over_the_wall(3, stamp_ns=5))
    assert flying.wait(PATIENCE)
    flyer.deactivate()
    flyer.activate()
    go_on.set()
    flyer.submit(over_the_wall(3, stamp_ns=6))
    wait(complete(reports, 6))
    assert {answer[0] for answer in reports.answers} == {6}


def test_a_thread_whose_listener_fails_goes_on(made, monkeypatch, capsys):
    flyer, reports, standing = made()
    flyer.activate()
    flyer.hand_over(ready=standing)
    told = threading.Event()

    def fail(error, trigger=None):
        told.set()
        return error.nothing

    monkeypatch.setattr(reports, "failed", fail)
    monkeypatch.setattr("rpf3d_ros.engine.flyer.answers", lambda *args: 1 / 0)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    assert told.wait(PATIENCE)
    monkeypatch.undo()
    flyer.submit(over_the_wall(3, stamp_ns=6))
    wait(complete(reports, 6))


def test_a_change_without_ground_is_refused(made):
    flyer, _, _ = made()
    with pytest.raises(Exception, match="no terrain yet"):
        flyer.hand_over(change=lambda standing: standing)


def test_sources_that_cannot_be_released_are_told_of_and_the_next_are_answered(made):
    flyer, reports, standing = made()
    flyer.activate()
    flyer.hand_over(ready=standing)
    good = over_the_wall(3, stamp_ns=6)
    flyer.submit(trigger_of(good.positions + 1e5, good.velocities, None, 5))
    wait(lambda: reports.refused)
    flyer.submit(good)
    wait(complete(reports, 6))
    assert reports.refused[0][0] == 5 and "off the terrain" in reports.refused[0][1]


def test_an_inactive_flyer_answers_nothing_and_forgets_what_waits(made):
    flyer, reports, standing = made()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    time.sleep(0.2)
    assert not reports.answers
    flyer.activate()
    wait(complete(reports, 5))
    flyer.deactivate()
    count = len(reports.answers)
    flyer.submit(over_the_wall(3, stamp_ns=6))
    flyer.deactivate()
    flyer.activate()
    time.sleep(0.2)
    assert len(reports.answers) == count


def test_after_walls_have_taken_turns_the_newest_trigger_is_refined(made):
    flyer, reports, standing = made()
    far = over_the_wall(1, stamp_ns=5)
    near = trigger_of(-far.positions * (1, 1, -1), -far.velocities, None, 6)
    flyer.hand_over(ready=standing)
    flyer.submit(far)
    flyer.submit(near)
    flyer.activate()
    wait(at_rest(flyer, reports, 6))
    assert reports.answers[-1][0] == 6 and any(answer[0] == 5 for answer in reports.answers)


@pytest.mark.parametrize(("age_s", "again"), [(30.0, {5, 6}), (0.0, {6})], ids=["fresh", "too old"])
def test_a_change_of_areas_is_answered_for_every_wall_that_is_not_too_old_the_newest_last(made, age_s, again):
    flyer, reports, standing = made(age_s=age_s)
    far = over_the_wall(1, stamp_ns=5)
    flyer.hand_over(ready=standing)
    flyer.submit(far)
    flyer.submit(trigger_of(-far.positions * (1, 1, -1), -far.velocities, None, 6))
    flyer.activate()
    wait(at_rest(flyer, reports, 6))
    del reports.answers[:]
    flyer.set_areas("areas/polygon", {"live_area": [over_the_wall(3).positions[:, :2]]})
    wait(at_rest(flyer, reports, 6))
    assert {answer[0] for answer in reports.answers} == again and reports.answers[-1][0] == 6


def test_live_areas_are_in_the_next_answer(made):
    flyer, reports, standing = made()
    flyer.activate()
    flyer.hand_over(ready=standing)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    wait(complete(reports, 5))
    count = len(reports.answers)
    flyer.set_areas("areas/polygon", {"live_area": [over_the_wall(3).positions[:, :2]]})
    wait(lambda: len(reports.answers) > count and reports.answers[-1][3])
    assert not reports.errors


def test_an_error_that_nobody_has_foreseen_is_told_and_the_next_trigger_is_answered(made, monkeypatch):
    flyer, reports, standing = made()
    flyer.activate()
    flyer.hand_over(ready=standing)
    monkeypatch.setattr("rpf3d_ros.engine.flyer.answers", lambda *args: 1 / 0)
    flyer.submit(over_the_wall(3, stamp_ns=5))
    assert isinstance(wait(lambda: reports.errors)[0], ZeroDivisionError)
    monkeypatch.undo()
    flyer.submit(over_the_wall(3, stamp_ns=6))
    wait(complete(reports, 6))
