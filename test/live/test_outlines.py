"""Tests of the outlines of areas: their identity, and which evidence belongs to a replaced outline."""

import numpy as np
from live_sites.alert_evidence import NOW, S, area, evidence
from live_sites.watched_road import ON_THE_SLOPE, ROAD, last_answer, slope, standing_over

from rpf3d_core.alerts.evidence import Outdated
from rpf3d_core.live import outlines
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.outlines import WatchedOutlines, outline_digest
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import stand_on
from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.scene.model import AreaSpec

A, B, C = "aa" * 32, "bb" * 32, "cc" * 32


def of_ramp(outline):
    """Return evidence of the ramp with an outline; evidence of another area if `outline` is empty."""
    return evidence(area(outline=outline)) if outline else evidence()._replace(areas=(area(name="road"),))


def test_equal_rings_have_equal_digests_and_others_have_not():
    rings = [ROAD, ROAD[:3] + 1.0]
    assert outline_digest(rings) == outline_digest([ring.copy() for ring in rings])
    others = [rings[:1], rings[::-1], [ROAD + 1e-6, rings[1]], [np.concatenate(rings)], []]
    assert len({outline_digest(each) for each in [rings, *others]}) == len(others) + 1


def test_evidence_for_the_present_outline_is_not_outdated_and_for_a_former_one_since_it_was_replaced():
    watched = WatchedOutlines()
    for second, outline in enumerate((A, B, B, C)):
        watched.watch({"ramp": outline}, NOW + second * S)
    assert watched.outdated([of_ramp(C)]) == ()
    assert watched.outdated([of_ramp(B)]) == (Outdated("ramp", NOW + 3 * S),)
    assert watched.outdated([of_ramp(C), of_ramp(A), of_ramp(B)]) == (Outdated("ramp", NOW + S),)
    watched.watch({"ramp": A}, NOW + 4 * S)
    assert watched.outdated([of_ramp(A)]) == (), "the area came back"
    watched.watch({"ramp": B}, NOW + 5 * S)
    made_since = of_ramp(A)._replace(at_ns=NOW + 4 * S)
    assert watched.outdated([made_since]) == (Outdated("ramp", NOW + 5 * S),), "answered after the area came back"
    assert watched.outdated([of_ramp(A)]) == (Outdated("ramp", NOW + S),), "nobody has answered since"


def test_evidence_without_a_new_area_is_outdated_since_the_area_is_watched():
    watched = WatchedOutlines()
    watched.watch({}, NOW)
    watched.watch({"ramp": A}, NOW + S)
    assert watched.outdated([of_ramp("")]) == (Outdated("ramp", NOW + S),)
    before_areas = evidence()._replace(areas=())
    assert watched.outdated([of_ramp(A), before_areas]) == (Outdated("ramp", NOW + S),)
    assert watched.outdated([before_areas._replace(faults=("no rock could fly",))]) == (), "that is the fault"
    watched.watch({}, NOW + 2 * S)
    assert watched.outdated([of_ramp(A)]) == ()


def test_evidence_for_a_former_place_grows_old_however_often_the_area_moves():
    """The age counts from the first change, not from the last 100 outlines, which a machine at 100 Hz passes in 1 s."""
    watched, answered = WatchedOutlines(), of_ramp(f"{0:064x}")
    for message in range(1000):
        watched.watch({"ramp": f"{message:064x}"}, NOW + message * S // 100)
    assert watched.outdated([answered]) == (Outdated("ramp", NOW + S // 100),)


def test_the_time_of_an_area_that_is_removed_and_set_again_counts_from_its_first_change():
    """Otherwise each removal would restart the time, and an area that comes and goes would never be outdated."""
    watched, answered = WatchedOutlines(), of_ramp(A)
    watched.watch({"ramp": A}, NOW)
    for second in range(1, 100):
        watched.watch({"ramp": B} if second % 2 else {}, NOW + second * S)
    assert watched.outdated([answered]) == (Outdated("ramp", NOW + S),)
    assert watched.outdated([of_ramp(B)._replace(at_ns=NOW + 98 * S)]) == (), "answered for the new place"
    since_removed = of_ramp("")._replace(at_ns=NOW + 98 * S)
    assert watched.outdated([since_removed]) == (Outdated("ramp", NOW + 99 * S),), "answered while there was no area"
    before = of_ramp("")._replace(at_ns=NOW - S)
    assert watched.outdated([before]) == (Outdated("ramp", NOW),), "answered before there was an area"
    watched.watch({}, NOW + 100 * S)
    assert watched.outdated([answered]) == (), "no area, no outline"
    watched.watch({"ramp": A}, NOW + 101 * S)
    assert watched.outdated([answered._replace(at_ns=NOW + 101 * S)]) == ()


def test_of_removed_areas_the_first_is_forgotten_first(monkeypatch):
    monkeypatch.setattr(outlines, "FORMER_AREAS", 2)
    watched = WatchedOutlines()
    watched.watch(dict.fromkeys(("ramp", "road", "shop"), A), NOW)
    for second, names in enumerate((("road", "shop"), ("shop",), ()), 1):
        watched.watch(dict.fromkeys(names, A), NOW + second * S)
    watched.watch(dict.fromkeys(("ramp", "road", "shop"), B), NOW + 9 * S)
    part = evidence()._replace(areas=tuple(area(name=name, outline=A) for name in ("ramp", "road", "shop")))
    since = {each.name: each.since_ns for each in watched.outdated([part._replace(at_ns=NOW)])}
    assert since == {"ramp": NOW + 9 * S, "road": NOW + 2 * S, "shop": NOW + 3 * S}


def test_an_outline_that_is_forgotten_was_replaced_when_the_watch_began_and_a_new_clock_begins_again(monkeypatch):
    monkeypatch.setattr(outlines, "REMEMBERED", 10)
    watched = WatchedOutlines()
    for second in range(30):
        watched.watch({"ramp": f"{second % 25:064x}"}, NOW + second * S)
    assert watched.outdated([of_ramp(f"{19:064x}")]) == (Outdated("ramp", NOW),)
    assert watched.outdated([of_ramp(f"{20:064x}")]) == (Outdated("ramp", NOW + 21 * S),)
    watched.restart(5)
    assert watched.outdated([of_ramp(A)]) == (Outdated("ramp", 5),)
    assert watched.described(of_ramp(A)).areas[0].outlined_ns == 5


def test_an_answer_names_the_outline_of_each_area_whatever_the_terrain():
    whole = standing_over(slope())
    cut = standing_over(slope()[10:])  # with another local frame
    assert whole.ground.terrain.frame.origin != cut.ground.terrain.frame.origin
    moved = ROAD + np.array([1.0, 0.0])
    digests = [
        last_answer(standing, [ON_THE_SLOPE], road=road).evidence[0].outline
        for standing, road in ((whole, ROAD), (cut, ROAD), (whole, moved))
    ]
    assert digests == [outline_digest([ROAD]), outline_digest([ROAD]), outline_digest([moved])]


def test_an_outline_of_the_scene_is_named_by_its_own_coordinates():
    square = [[44.0, 10.0], [52.0, 10.0], [52.0, 20.0], [44.0, 20.0]]
    scene = live_scene({"ground": "sliding"})
    found = []
    for points, shift in ((slope(), 0.0), (slope()[5:], 0.0), (slope(), 1.0)):
        corners = [[x + shift, y] for x, y in square]
        watched = scene.model_copy(update={"areas_of_interest": (AreaSpec(name="ramp", polygons=corners),)})
        found.append(stand_on(Workshop().whole(GridSurvey(points)), watched).area_digests["ramp"])
    assert found[0] == found[1] != found[2]
