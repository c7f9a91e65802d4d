"""Tests of rebound models and roughness in scene files: accepted values, and refusals that name the key."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights.models_by_name import models_called

from rpf3d_core.errors import SceneError
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.named import models_of

SMALL = """\
terrain: {pit: {}}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
sources: [{name: crest, points: [[0, 0, 1]]}]
"""
NINE = ", ".join(["0"] * 9)
ZEROS = f"[{', '.join(['[' + NINE + ']'] * 9)}]"
EYE = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
ANY_TERRAIN: Any = None
"""Placeholder: the models of these tests do not use the terrain."""


def scene_with(folder: Path, text: str):
    path = folder / "scene.yaml"
    path.write_text(SMALL + text + "\n")
    return read_scene(path)


def models_with(folder: Path, text: str):
    return models_of(scene_with(folder, text), ANY_TERRAIN)


@pytest.mark.parametrize(
    ("text", "name", "numbers"),
    [
        ("rebound: pfeiffer_bowen", "PfeifferBowen", (9.144, 6.096, 76.2)),
        ("rebound: {pfeiffer_bowen: {A: 5}}", "PfeifferBowen", (9.144, 5.0, 76.2)),
        ("rebound: velocity_scaled", "VelocityScaled", (9.144,)),
        ("rebound: {velocity_scaled: {K: 12}}", "VelocityScaled", (12.0,)),
        ("rebound: coulomb_limited", "CoulombLimited", ()),
        ("rebound: mass_scaled", "MassScaled", (1000.0, math.inf)),
        ("rebound: {mass_scaled: {C: 500, K: 9}}", "MassScaled", (500.0, 9.0)),
        ("rebound: v_half", "VHalf", (10.0,)),
        ("rebound: {angle_table: {law: wyllie}}", "Wyllie", ()),
    ],
)
def test_a_named_model_has_the_numbers_of_the_scene_or_its_defaults(tmp_path, text, name, numbers):
    model = models_with(tmp_path, text).rebound
    assert (type(model).__name__, tuple(model)) == (name, numbers)


def test_the_rows_of_a_table_become_columns(tmp_path):
    model = models_with(tmp_path, "rebound: {angle_table: {rows: [[10, 1.8, 0.6], [90, 0.2, 0.9]]}}").rebound
    assert [column.tolist() for column in model] == [[10.0, 90.0], [1.8, 0.2], [0.6, 0.9]]
    assert all(column.flags.c_contiguous for column in model)


def test_a_matrix_has_the_factor_of_its_covariance(tmp_path):
    rows = [["0"] * 9 for _ in range(9)]
    rows[0][0], rows[1][1], rows[0][1], rows[1][0] = "0.04", "0.02", "0.02", "0.02"
    covariance = "[" + ", ".join(f"[{', '.join(row)}]" for row in rows) + "]"
    model = models_with(tmp_path, f"rebound: {{stochastic_matrix: {{mean: {EYE}, covariance: {covariance}}}}}").rebound
    assert np.array_equal(model.mean, np.eye(3))
    np.testing.assert_allclose((model.root @ model.root.T)[:2, :2], [[0.04, 0.02], [0.02, 0.02]], rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "name", "numbers"),
    [
        ("effects: {roughness: {amplitude: 0.1}}", "CrspRoughness", (0.1, False)),
        ("effects: {roughness: {amplitude: 0.1, deviates: true}}", "CrspRoughness", (0.1, True)),
        ("effects: {roughness: {angle_sd_deg: 8}}", "RocfallRoughness", (math.radians(8.0),)),
        (
            "effects: {roughness: {angle_sd_deg: 8, lateral_sd_deg: 4}}",
            "SpreadRoughness",
            (math.radians(8.0), math.radians(4.0)),
        ),
    ],
)
def test_the_key_of_roughness_selects_its_law(tmp_path, text, name, numbers):
    effect = models_with(tmp_path, text).effects.head
    assert (type(effect).__name__, tuple(effect)) == (name, numbers)


def test_models_by_name_are_those_of_a_scene_that_says_no_more(tmp_path):
    assert models_called("v_half", "sliding") == models_with(tmp_path, "rebound: v_half\nground: sliding")


TABLE = "rebound: {{angle_table: {{rows: {}}}}}"
MATRIX = "rebound: {{stochastic_matrix: {{mean: {}, covariance: {}}}}}"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("rebound: {pfeiffer_bowen: {K: 0}}", "`rebound.pfeiffer_bowen.K` is 0, but must be a number above 0 (m/s)"),
        ("rebound: {pfeiffer_bowen: {k: 9}}", "`rebound.pfeiffer_bowen.k` is not a key of a scene"),
        ("rebound: {velocity_scaled: {K: -1}}", "`rebound.velocity_scaled.K` is -1, but must be a number above 0"),
        ("rebound: {mass_scaled: {C: 0}}", "`rebound.mass_scaled.C` is 0, but must be a number above 0 (kg)"),
        ("rebound: {mass_scaled: {K: 0}}", "`rebound.mass_scaled.K` is 0, but must be a number above 0 (m/s)"),
        ("rebound: {v_half: {speed: 51}}", "`rebound.v_half.speed` is 51, but must be a number above 0 and at most"),
        ("rebound: angle_table", "`rebound.angle_table` must have exactly one of rows, law, but has none of them"),
        (
            "rebound: {angle_table: {law: wyllie, rows: [[0, 1, 1]]}}",
            "`rebound.angle_table` must have exactly one of rows, law, but has rows and law",
        ),
        ("rebound: {angle_table: {law: willie}}", "`rebound.angle_table.law` is 'willie', but must be wyllie"),
        (TABLE.format("[]"), "`rebound.angle_table.rows` is [], but must be a list of [angle, R_n, R_t]"),
        (
            TABLE.format("[[10, 1, 0.5], [10, 1, 0.5]]"),
            "`rebound.angle_table.rows[1][0]` is 10, but angles must rise, and the one before is 10",
        ),
        (TABLE.format("[[91, 1, 0.5]]"), "`rebound.angle_table.rows[0][0]` is 91, but angle must be a number from 0"),
        (TABLE.format("[[9, 11, 0.5]]"), "`rebound.angle_table.rows[0][1]` is 11, but R_n must be a number from 0"),
        (TABLE.format("[[9, 1, 1.5]]"), "`rebound.angle_table.rows[0][2]` is 1.5, but R_t must be a number from 0"),
        ("rebound: stochastic_matrix", "`rebound.stochastic_matrix.mean` is missing; it must be three rows of three"),
        (f"rebound: {{stochastic_matrix: {{mean: {EYE}}}}}", "`rebound.stochastic_matrix.covariance` is missing"),
        (
            MATRIX.format(EYE, ZEROS.replace("[0, 0", "[0, 1", 1)),
            "`rebound.stochastic_matrix.covariance[0][1]` is 1, but a covariance is symmetric, and [1][0] is 0",
        ),
        (
            MATRIX.format(EYE, ZEROS.replace("[0, 0", "[-1, 0", 1)),
            "`rebound.stochastic_matrix.covariance` is no covariance: some sum of the coefficients would have",
        ),
        (MATRIX.format(EYE, "[[1]]"), "`rebound.stochastic_matrix.covariance` is [[1]], but must be nine rows of nine"),
        (MATRIX.format("[[1, 0]]", ZEROS), "`rebound.stochastic_matrix.mean[0]` is [1, 0], but must be a part of thr"),
        (TABLE.format("[[0, 1]]"), "`rebound.angle_table.rows[0]` is [0, 1], but must be a part of a list of [ang"),
        ("effects: {berm: {height: 2}}", "`effects.berm` is not a key of a scene; it belongs in `terrain.berms`"),
        ("rebound: {v_half: {}, constant: {}}", "`rebound` must have exactly one of constant, coulomb_limited, "),
        ("rebound: v_haf", "`rebound` is 'v_haf', but must be constant, coulomb_limited, thesis_literal, "),
        ("effects: {roughness: {}}", "`effects.roughness` must have exactly one of amplitude, angle_sd_deg, but"),
        ("effects: {roughness: }", "`effects.roughness` must have exactly one of amplitude, angle_sd_deg, but"),
        (
            "effects: {roughness: {amplitude: 0.1, angle_sd_deg: 8}}",
            "`effects.roughness` must have exactly one of amplitude, angle_sd_deg, but has amplitude and angle_sd_deg",
        ),
        ("effects: {roughness: {amplitude: -1}}", "`effects.roughness.amplitude` is -1, but must be a number >= 0 (m)"),
        (
            "effects: {roughness: {angle_sd_deg: 31}}",
            "`effects.roughness.angle_sd_deg` is 31, but must be a number from 0 to 30 (degrees)",
        ),
        (
            "effects: {roughness: {angle_sd_deg: 3, deviates: true}}",
            "`effects.roughness.deviates` is part of the law of `amplitude`, and there is none",
        ),
        (
            "effects: {roughness: {amplitude: 0.1, lateral_sd_deg: 3}}",
            "`effects.roughness.lateral_sd_deg` goes with `angle_sd_deg`, and there is none; `amplitude` has",
        ),
        ("effects: {roughness: {amplitude: 1, deviates: 1}}", "`effects.roughness.deviates` is 1, but must be true or"),
    ],
)
def test_a_wrong_parameter_is_refused_with_its_line_and_key(tmp_path, text, sentence):
    with pytest.raises(SceneError) as refused:
        scene_with(tmp_path, text)
    assert f"line 4: {sentence}" in str(refused.value)


def test_a_figure_that_is_not_confirmed_says_so_where_it_is_described():
    from rpf3d_core.scene.models.rebounds import MassScaledSpec

    assert MassScaledSpec.CONFIRMED == "UNCONFIRMED"
    assert "unconfirmed" in str(MassScaledSpec.model_fields["C"].description)
