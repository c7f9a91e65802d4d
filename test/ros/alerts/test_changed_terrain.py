"""Tests that answers for the previous terrain are a fault after the stated time, with a node without a network."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import NOW, S, area, evidence, site
from live_sites.watched_pit import shown_at, start_over_the_pit
from never_green import pit
from never_green.plan import Send, Truth
from never_green.stories import RADAR_A, patch_send

from rpf3d_ros.alerts.region_evidence import RegionEvidence
from rpf3d_ros.alerts.watched_terrain import WatchedTerrain

REMOVED = 2.0
"""Time (s) at which the bank that shelters the road is removed."""

TRUTH = Truth(
    sources=(), bank_until=REMOVED, areas=(pit.outline(pit.SHELTERED_ROAD),) * 2, area_since=0.0
)  # fmt: skip
TOPICS = (RADAR_A, "terrain/points", "terrain/update", "areas/polygon")
BEHIND_THE_BANK = pit.placed(10.0, 60.0, 31.0)
OTHERS = 5
"""Number of harmless walls; with the wall behind the bank, there are more than the node answers again."""


@pytest.fixture
def run(monkeypatch):
    """Yield a node that keeps the sources of four walls, has the pit with its bank, and watches the road behind it."""
    started = start_over_the_pit(monkeypatch, TRUTH, TOPICS)
    road = pit.outline(pit.SHELTERED_ROAD)
    started.deliver(Send(sent=0.2, at=0.2, topic="areas/polygon", kind="polygon", places=road))
    yield started
    started.node.close()


def report(run, at, *places):
    """Let the radar report each place (m) in a separate message, the first at the time `at` (s), one every 0.05 s."""
    for number, place in enumerate(places):
        sent = at + 0.05 * number
        run.deliver(Send(sent=sent, at=sent, topic=RADAR_A, kind="poses", places=place[None]))


def remove_the_bank(run):
    run.deliver(patch_send(TRUTH, REMOVED, ((32.0, 48.0), (40.0, 80.0))))


def test_a_wall_that_is_not_answered_over_the_changed_terrain_is_a_fault_until_its_sensor_reports_it_again(run):
    harmless = [pit.placed(60.0, 10.0 + 10.0 * number, 0.5) for number in range(OTHERS)]
    report(run, 0.5, BEHIND_THE_BANK, *harmless)
    assert shown_at(run, REMOVED) == "normal"
    remove_the_bank(run)
    assert shown_at(run, REMOVED + 0.5) == "normal", "the time for the answers"
    assert shown_at(run, REMOVED + 1.5) == "fault"
    faults = run.node.station.desk.alert.faults
    assert any(fault.startswith("the terrain changed") for fault in faults), faults
    report(run, run.at + 0.1, BEHIND_THE_BANK, *harmless)
    assert shown_at(run, run.at + 0.5) == "restrict"
    assert run.node.station.desk.alert.faults == ()


def test_where_every_wall_is_answered_again_a_changed_terrain_is_no_fault(run):
    report(run, 0.5, BEHIND_THE_BANK)
    assert shown_at(run, REMOVED) == "normal"
    remove_the_bank(run)
    assert run.watcher.shown(run.at) == "restrict"
    assert shown_at(run, REMOVED + 2.0) == "restrict" and run.node.station.desk.alert.faults == ()


def test_an_answer_is_late_from_the_first_change_of_its_terrain_on():
    watched, answer = WatchedTerrain(1.0), evidence(area(0), terrain_digest="a")
    for second, digest in enumerate("abc"):
        watched.watch(digest, NOW + second * S)
    assert watched.ends_ns([answer]) == [NOW + 2 * S]
    assert not watched.faults([answer], NOW + 2 * S - 1)
    (fault,) = watched.faults([answer], NOW + 2 * S)
    assert "raise evidence.changed_terrain_s" in fault
    assert watched.ends_ns([evidence(area(0), terrain_digest="c")]) == []
    assert watched.ends_ns([answer._replace(areas=())]) == [], "its sources have no answer: that is a fault of its own"
    watched.restart(NOW + 9 * S)
    assert watched.ends_ns([answer]) == [NOW + 10 * S]


def test_an_answer_of_few_rocks_over_the_new_terrain_does_not_count_as_the_answer_over_it():
    """It cannot lower a level, nor show that no level is reached, but it would end the wait for an answer that can."""
    regions = RegionEvidence(site(changed_terrain_s=1.0, fewest_rocks=1000).evidence)
    regions.watch({}, "a", NOW)
    regions.note("wall", RADAR_A, evidence(area(0), terrain_digest="a"))
    regions.watch({}, "b", NOW)

    def late(now_ns, **answer):
        regions.note("wall", RADAR_A, evidence(area(0, **answer), terrain_digest="b", now=now_ns))
        return [fault for fault in regions.fresh(now_ns).faults if fault.startswith("the terrain changed")]

    assert not late(NOW + S // 2, flown=3)
    assert regions.fresh(NOW + S // 2).complete_until_ns == NOW + S
    assert late(NOW + S, flown=3) and late(NOW + 2 * S, flown=3)
    assert not late(NOW + 3 * S) and not late(NOW + 4 * S, flown=3), "the terrain has not changed since"


def test_a_message_without_sources_is_an_answer_over_the_new_terrain_although_no_rock_flies():
    regions = RegionEvidence(site(changed_terrain_s=1.0).evidence)
    for second, digest in enumerate("ab"):
        regions.watch({}, digest, NOW + second * S)
        nothing = evidence(area(0, flown=0), terrain_digest=digest, now=NOW + second * S, sources=0)
        regions.note("wall", RADAR_A, nothing)
    assert regions.fresh(NOW + 3 * S).faults == ()
