"""Numbers of a scene that are far out of scale are warned of, with the unit that they may be in."""

from pathlib import Path

import pytest

from rpf3d_core.scene.reading import scene_of_text
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of

ROCK = "rock: {density: 2700, diameter: 0.8}"
SCENE = """\
terrain: {{pit: {{triangles: 6000}}}}
materials: {{default: {{normal_restitution: {R_n}, tangential_restitution: 0.8{more}}}}}
sources: [{{name: crest, points: [[0, 0, 0]]{source}}}]
{rock}
{rest}
"""


def warned(rest: str = "", rock: str = ROCK, source: str = "", more: str = "", R_n: str = "0.4") -> str:
    text = SCENE.format(rest=rest, rock=rock, source=source, more=more, R_n=R_n)
    return "\n".join(warnings_of(scene_of_text(text, Path("scene.yaml"))))


def net(capacity: float) -> str:
    return ("effects: {barriers: {panels: [{name: net, along: [[0, 0], [9, 0]], height: 3, capacity_kj: "
            f"{capacity}}}]}}}}")  # fmt: skip


def test_a_scene_in_the_right_units_has_no_warning() -> None:
    assert warned(net(10_000), source=", velocity: [0, -20, 0]", more=", stop_speed: 0.2") == ""


def test_a_capacity_in_joules() -> None:
    found = warned(net(500_000))
    assert found.startswith("`effects.barriers.panels[0].capacity_kj` of 'net' is 500,000 kJ; the strongest nets are")
    assert found.endswith("is it in J (500 kJ)?")


@pytest.mark.parametrize(
    ("density", "told"),
    [
        (27_000, "27,000 kg/m3, more than any ore; is it in N/m3 (2,750 kg/m3)?"),
        (2_700_000, "2,700,000 kg/m3, more than any ore; is it in g/m3 (2,700 kg/m3)?"),
        (27, "27 kg/m3; is it in t/m3, or in kN/m3 (2,750 kg/m3)?"),
        (2.7, "2.7 kg/m3; is it in t/m3?"),
        (5_200, ""),
        (7_500, ""),
    ],
)
def test_a_density_in_another_unit(density: float, told: str) -> None:
    assert warned(rock=f"rock: {{density: {density}, diameter: 0.8}}") == (told and f"`rock.density` is {told}")


def test_the_speed_of_a_source_in_kilometres_an_hour() -> None:
    found = warned(source=", velocity: [0, -60, 0]")
    assert found.startswith("`sources[0].velocity` of 'crest' reaches 60 m/s")
    assert found.endswith("is it in km/h (16.7 m/s)?")
    assert "`sources[0].speed`" in warned(source=", speed: 50, azimuth_deg: 90")


def test_a_stop_speed_that_is_no_standstill() -> None:
    assert warned("stop_speed: 5").startswith("`stop_speed` is 5 m/s: a rock counts as stopped")
    assert warned(more=", stop_speed: 4").startswith("`materials.default.stop_speed` is 4 m/s")
    assert warned("stop_speed: 3", more=", stop_speed: 1000") == "", "as in r.stone, and of water"


def test_a_standard_deviation_in_percent() -> None:
    found = warned(rock="rock: {diameter: {mean: 0.8, sd: 30, min: 0.3, max: 2}}")
    assert found.startswith("`rock.diameter.sd` is 30, far more than the range from min 0.3 to max 2")
    assert found.endswith("is it in percent of the mean (0.24)?")
    assert "`materials.default.normal_restitution.sd`" in warned(R_n="{mean: 0.4, sd: 10, min: 0.2, max: 0.6}")
    lognormal = "rock: {diameter: {lognormal: {mean: 0.8, sd: 30, min: 0.3, max: 2}}}"
    assert "`rock.diameter.lognormal.sd` is 30" in warned(rock=lognormal)
    assert warned(rock="rock: {diameter: {mean: 0.8, sd: 0.3, min: 0.3, max: 2}}") == ""
