"""Tests that sources far from the place of the sample's calibration cause a note but do not change a level."""

from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from live_sites.alert_evidence import NOW, S, evidence, site
from live_sites.unknown_slope import SETS, standing_with
from live_sites.watched_road import LIMITS, ON_THE_SLOPE, ROAD, WANTED, slope, standing_over

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Level
from rpf3d_core.live.answers import Answer, EnsembleSize, answers
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.standing import PreparedTerrain, stand_after, stand_on
from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.live.triggers import trigger_of
from rpf3d_core.results.overconfidence import ELSEWHERE_HELD
from rpf3d_core.unknowns.parameter_sets import parameter_sets, write_parameter_sets
from rpf3d_core.unknowns.places import Surroundings

HERE = Surroundings(west=5.0, south=15.0, east=25.0, north=30.0)
"""A place of 20 m by 15 m around the source; its diagonal, 25 m, is the distance within which sources are near."""
FAR_AWAY = (10.0, 120.0, 31.0)


def standing_of(folder: Path, place: Surroundings | None) -> PreparedTerrain:
    """Return the prepared slope of a scene whose sample was calibrated in `place`; None: the sample has no place."""
    column = np.linspace(0.2, 0.7, SETS)[:, None]
    sample = parameter_sets(["materials.default.normal_restitution"], column)
    write_parameter_sets(folder / "posterior.parquet", replace(sample, place=place))
    return standing_with(folder, "0.4", ", sample: posterior.parquet")


def first_answer(standing: PreparedTerrain, places, cluster: float = 10.0, origin=(0.0, 0.0, 0.0)) -> Answer:
    at = np.array(places, dtype=float)
    trigger = trigger_of(at, np.zeros_like(at), None, NOW - S)
    size, spread = EnsembleSize(100, least=WANTED, cluster=cluster), ReleaseSpread(position=1.0, map_origin=origin)
    return next(answers(standing, trigger, spread, {"road": [ROAD]}, size, lambda stage: False, count(1)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def standing(folder):
    return standing_of(folder, HERE)


def test_only_sources_away_from_the_place_are_reported(standing):
    assert first_answer(standing, [ON_THE_SLOPE]).elsewhere == ""
    sentence = first_answer(standing, [FAR_AWAY]).elsewhere
    assert sentence.startswith("1 of 1 sources are away from the place where the sample was calibrated")
    assert ELSEWHERE_HELD in sentence and "calibrate here" in sentence


def test_many_sources_at_the_place_do_not_hide_one_elsewhere_but_5_percent_of_a_cluster_do_not_count(standing):
    """A cluster is a square of 10 m; with an infinite square all sources are one cluster."""
    near = [(10.0, 20.0 + 0.1 * i, 31.0) for i in range(20)]
    assert first_answer(standing, [*near, FAR_AWAY]).elsewhere.startswith("1 of 21 sources")
    assert first_answer(standing, [*near, FAR_AWAY], cluster=np.inf).elsewhere == "", "1 of 21 is 4.8 %"
    assert first_answer(standing, [*near[1:], FAR_AWAY], cluster=np.inf).elsewhere.startswith("1 of 20 sources")


def test_the_place_is_in_survey_coordinates(folder):
    east, north = 500_000.0, 4_500_000.0
    surveyed = Surroundings(*(end + shift for end, shift in zip(HERE, (east, north, east, north), strict=True)))
    standing = standing_of(folder, surveyed)
    assert first_answer(standing, [ON_THE_SLOPE], origin=(east, north, 900.0)).elsewhere == ""
    assert first_answer(standing, [FAR_AWAY], origin=(east, north, 900.0)).elsewhere != ""
    assert "is map_origin right?" in first_answer(standing, [ON_THE_SLOPE]).elsewhere


def test_a_sample_that_does_not_know_its_place_and_a_scene_without_sample_say_nothing(folder, tmp_path):
    assert first_answer(standing_of(folder, None), [FAR_AWAY]).elsewhere == ""
    assert first_answer(standing_with(tmp_path), [FAR_AWAY]).elsewhere == ""
    assert first_answer(standing_over(slope()), [FAR_AWAY]).elsewhere == ""


def test_a_message_without_sources_says_nothing(standing):
    assert first_answer(standing, np.empty((0, 3))).elsewhere == ""


def test_a_patch_keeps_the_place(folder):
    workshop = Workshop()
    whole = stand_on(workshop.whole(GridSurvey(slope())), standing_of(folder, HERE).scene)
    _ = whole.cells
    patched = stand_after(whole, workshop.patched(whole.ground, GridSurvey(slope()[100:140, 50:70])))
    assert first_answer(patched, [FAR_AWAY]).elsewhere != ""


def test_the_note_is_a_reason_and_leaves_level_and_faults(standing):
    answer = first_answer(standing, [FAR_AWAY])
    told = evidence(*answer.evidence, sources=answer.sources, unfinished=answer.unfinished)
    thresholds = site({"road": LIMITS}, fewest_rocks=WANTED)
    noted = told._replace(notes=(answer.elsewhere,))
    without, with_note = (decide(None, one, thresholds, NOW) for one in (told, noted))
    assert with_note.evident == without.evident > Level.NORMAL
    assert (with_note.level, with_note.faults) == (without.level, without.faults)
    assert with_note.reasons == (*without.reasons, answer.elsewhere)
