"""Tests of site files: the example is valid, and faults are reported with line, key and what would be right."""

from pathlib import Path

import pytest
from live_sites.alert_evidence import EXAMPLE

from rpf3d_core.alerts.limits import limits_of
from rpf3d_core.alerts.site import read_site, site_digest, site_of, site_text
from rpf3d_core.errors import SceneError

TEXT = EXAMPLE.read_text()


def refusal(folder: Path, old: str, new: str) -> str:
    """Return the report on the example file with `old` replaced by `new`, without the name of the file."""
    assert old in TEXT
    path = folder / "site.yaml"
    path.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(SceneError) as caught:
        read_site(path)
    return str(caught.value).replace(f"{path}, ", "")


def test_the_example_is_a_site_and_every_key_of_it_is_explained() -> None:
    thresholds = read_site(EXAMPLE)
    assert list(thresholds.areas) == ["haul_ramp", "crusher", "equipment*", "live_area*"]
    assert limits_of(thresholds, "live_area") is thresholds.areas["live_area*"]
    ramp = thresholds.areas["haul_ramp"].evacuate
    assert ramp is not None and ramp.first_arrival_s is not None and ramp.first_arrival_s.seconds == 7.0
    head = TEXT.split("areas:")[0]
    keys = [line for line in head.splitlines() if line.partition("#")[0].strip()]
    assert [line for line in keys if "#" not in line] == []


def test_a_site_comes_back_from_its_text_with_the_same_digest() -> None:
    thresholds = read_site(EXAMPLE)
    again = site_of(site_text(thresholds))
    assert again == thresholds
    assert list(again.areas) == list(thresholds.areas)
    assert site_digest(again) == site_digest(thresholds)


REFUSALS = [
    ("    restrict: {reach_probability: 0.005}", "    restrict:",
     "`areas.crusher.restrict` has no value: give one, or remove the key"),
    ("reach_probability: 0.10", "reach_probability: 1", "`areas.haul_ramp.evacuate.reach_probability` is 1, which is"),
    ("alarm_from:", "alarm_form:", "line 7: `alarm_form` is not a key of a site file; did you mean `alarm_from`?"),
    ("valid_s: 10  ", "valid_s: .nan", "line 6: `valid_s` is nan, but must be a number above 0 (s), how long"),
    ("  fewest_rocks: 1000", "  # none", "`evidence.fewest_rocks` is missing; it must be a whole number of at least 1"),
    ("alarm_from: restrict", "alarm_from: normal", "`alarm_from` is 'normal', but must be watch, restrict or evacuate"),
    ("reach_probability: 0.10", "reach_probabilty: 0.10", "did you mean `reach_probability`?"),
    ("reach_probability: 0.10", "reach_probability: 10", "is 10, but must be a share above 0 and below 1 (-)"),
    ("reach_probability: 0.10", "reach_probability: 0.01",
     "`areas.haul_ramp.evacuate.reach_probability` is below that of restrict, so restrict would never be seen"),
    ("margin: 2", "margin: -2",
     "`areas.haul_ramp.evacuate.first_arrival_s.margin` is -2, but must be a number >= 0 (s)"),
    ("    evacuate:\n", "    evacute:\n",
     "`areas.haul_ramp.evacute` is not a key of a site file; did you mean `evacuate`?"),
    ("    restrict: {reach_probability: 0.005}", "    restrict: {}",
     "`areas.crusher.restrict` has no limit; give one or"),
    ("fewest_rocks: 1000", "fewest_rocks: 764", "give at least 765"),
    ("fewest_rocks: 1000", "fewest_rocks: 764\n  reach_probability_is: share", "give at least 765"),
    ("areas:\n", "areas: {}\nothers:\n", "`areas` has no area; name at least one"),
    ("crusher:", "haul_ramp:", "`areas.haul_ramp` is given twice, first in line"),
    ("site: example pit", "site: [", "not valid YAML"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "sentence"), REFUSALS, ids=[sentence[:40] for *_, sentence in REFUSALS])
def test_what_is_wrong_is_told_with_line_and_key_and_what_would_be_right(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    said = refusal(tmp_path, old, new)
    assert sentence in said
    assert "line" in said


def test_the_fewest_rocks_that_a_refusal_names_will_do(tmp_path: Path) -> None:
    (tmp_path / "site.yaml").write_text(TEXT.replace("fewest_rocks: 1000", "fewest_rocks: 765"))
    assert read_site(tmp_path / "site.yaml").evidence.fewest_rocks == 765


def test_a_site_without_limits_of_the_reach_probability_needs_some_rocks_too(tmp_path: Path) -> None:
    head = TEXT.partition("areas:")[0].replace("fewest_rocks: 1000", "fewest_rocks: 39")
    (tmp_path / "site.yaml").write_text(head + "areas: {ramp: {restrict: {p95_energy_j: 5000}}}\n")
    with pytest.raises(SceneError, match=r"is 39, but must be at least 40: .* up to 8\.9.* %"):
        read_site(tmp_path / "site.yaml")


@pytest.mark.parametrize(("content", "sentence"), [
    (None, "there is no such site file"), (b"- 1\n", "must hold a mapping of keys"),
    (b"\xff", "if this is a site file, save it as UTF-8"),
])  # fmt: skip
def test_a_file_that_is_no_site_is_refused(tmp_path: Path, content: bytes | None, sentence: str) -> None:
    if content is not None:
        (tmp_path / "site.yaml").write_bytes(content)
    with pytest.raises(SceneError, match=sentence):
        read_site(tmp_path / "site.yaml")


def test_an_area_without_levels_and_arrivals_out_of_order_are_refused(tmp_path: Path) -> None:
    said = refusal(tmp_path, "  crusher:", "  dump: {}\n  crusher:")
    assert "`areas.dump` names no level; give one or more of watch, restrict, evacuate" in said
    early, late = (f"{{first_arrival_s: {{evacuation: {seconds}, margin: 1}}}}" for seconds in (1, 2))
    times = (f"restrict: {early}", f"evacuate: {late}")
    said = refusal(tmp_path, "  crusher:", "\n    ".join(["  dump:", *times]) + "\n  crusher:")
    assert "`areas.dump.evacuate.first_arrival_s` is longer than that of restrict" in said


def test_an_alarm_from_a_level_without_limits_is_refused(tmp_path: Path) -> None:
    text = TEXT.split("areas:")[0].replace("alarm_from: restrict", "alarm_from: evacuate")
    path = tmp_path / "site.yaml"
    path.write_text(f"{text}areas:\n  ramp: {{restrict: {{reach_probability: 0.1}}}}\n")
    with pytest.raises(SceneError, match="`alarm_from` is evacuate, but no area has limits of this level or above"):
        read_site(path)
