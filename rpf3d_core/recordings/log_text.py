"""Compose the texts of a recording: the log lines on scene and rocks, and the document."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.formats.words import scene_name
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome


class RecordedSource(Protocol):
    """The attributes that a source must have for a recording."""

    @property
    def name(self) -> str:
        """Name of the source."""


class RecordedOutputs(Protocol):
    """The attributes that the output settings of a scene must have for a recording."""

    @property
    def trajectories(self) -> int:
        """Largest number of rocks whose trajectories are shown."""


class RecordedRock(Protocol):
    """The attributes that the rocks of a scene must have for a recording."""

    @property
    def density(self) -> float:
        """Density (kg/m^3)."""


class RecordedMethod(Protocol):
    """The attributes that the contact method of a scene must have for a recording."""

    def describe(self) -> str:
        """Return a description of the contact method for the log."""


class RecordedScene(Protocol):
    """The attributes that a scene must have for a recording; `scene.model.Scene` has them."""

    @property
    def path(self) -> Path:
        """The scene file; its text is included in the recording if the file exists."""

    @property
    def seed(self) -> int:
        """Seed of the random numbers."""

    @property
    def gravity(self) -> float:
        """Gravity (m/s^2)."""

    @property
    def sources(self) -> Sequence[RecordedSource]:
        """The sources; `Deposits.source` is an index into this sequence."""

    @property
    def materials(self) -> Mapping[str, Any]:
        """Materials by the name of a zone, or by a pattern of zone names."""

    @property
    def rock(self) -> RecordedRock:
        """The rocks."""

    @property
    def method(self) -> RecordedMethod:
        """The method that finds contacts of rocks with the ground."""

    @property
    def outputs(self) -> RecordedOutputs:
        """Output settings."""


def sentences_of(summary: Mapping[str, Any]) -> dict[Outcome, str]:
    """Return the sentence that explains each outcome: from the summary if it has one, else the default sentence."""
    known = {name: entry["sentence"] for name, entry in summary.get("outcomes", {}).items() if "sentence" in entry}
    return OUTCOME_SENTENCES | {Outcome[name.upper()]: sentence for name, sentence in known.items()}


def scene_lines(scene: RecordedScene, terrain: Terrain, summary: Mapping[str, Any]) -> list[str]:
    """Return the log lines about a scene: name, seed, method, terrain, frame, mesh faults, materials, outcomes."""
    faults = summary.get("terrain", {}).get("faults", {})
    counted = ", ".join(f"{name} {value}" for name, value in faults.items() if isinstance(value, int) and value)
    outcomes = ", ".join(f"{name} {share['rocks']}" for name, share in summary.get("outcomes", {}).items())
    return [
        f"scene {scene.path.name}, seed {scene.seed}, method {scene.method.describe()}",
        f"terrain: {len(terrain.triangles)} triangles in the zones {', '.join(terrain.zones)}",
        frame_line(terrain.frame),
        *([f"mesh: {counted}"] if counted else []),
        *(material_line(name, material, summary.get("unknowns", {})) for name, material in scene.materials.items()),
        *([f"outcomes: {outcomes}"] if outcomes else []),
    ]


def material_line(name: str, material: Any, unknowns: Mapping[str, Any]) -> str:
    """Return the log line about a material; an unknown value is shown as the range of the parameter sets.

    The number that the scene has for an unknown value is only the middle of its prior. Each rock flies with the value
    of its parameter set.

    name : of the zone, or a pattern; material : a `scene.material.Material`
    unknowns : section `unknowns` of summary.json; {} without unknowns
    """
    ranges, paths = {}, unknowns.get("parameters", {})
    # Paths with `*` go first, so that a path with the name of the zone replaces them.
    for path in sorted(paths, key=lambda path: "*" not in path.split(".")):
        root, zone, *keys = path.split(".")
        if root == "materials" and keys and zone in ("*", name):
            found, inner = paths[path], ".".join(keys[1:])
            begin = f"{getattr(material, keys[0])}, {inner} unknown" if inner else "unknown"
            ranges[keys[0]] = f"{begin}, {found['low']:.3g} to {found['high']:.3g} in {unknowns['sets']} parameter sets"
    return f"material {name}: {material.model_copy(update=ranges) if ranges else material}"


def frame_line(frame: Frame) -> str:
    """Return the log line that states how to convert positions of the recording into the input's coordinates."""
    east, north, up = frame.origin
    turned = "" if frame.up == "z" else "; the input's y points up: its (x, y, z) is (x, z, -y) of the sum"
    return f"positions are local, z up; add the origin ({east:.10g}, {north:.10g}, {up:.10g}) m{turned}"


def outcome_line(
    names: Sequence[str], terrain: Terrain, deposits: Deposits, row: int, sentences: Mapping[Outcome, str]
) -> str:
    """Return the log line about the end of one rock: outcome, sentence, zone, time, path, impacts, top speed.

    names : of the sources; row : row of the rock in `deposits`; sentences : the sentence that explains each outcome
    """
    outcome, facet = Outcome(deposits.outcome[row]), int(deposits.facet[row])
    where = f", last on {terrain.zones[terrain.zone[facet]]}" if facet >= 0 else ", never on the ground"
    return (
        f"{rock_name(names, deposits, row)}: {outcome.name.lower()}, {sentences[outcome]}{where}; "
        f"{deposits.t[row]:.1f} s, {deposits.path[row]:.1f} m, {deposits.impacts[row]} impacts, "
        f"fastest {deposits.max_speed[row]:.1f} m/s"
    )


def rock_name(names: Sequence[str], deposits: Deposits, row: int) -> str:
    """Return the name of a rock in log and plots: its source, and its number in the source.

    names : of the sources; row : row of the rock in `deposits`
    """
    return f"{names[deposits.source[row]]} {deposits.rock[row]}"


def document(scene: RecordedScene, lines: Sequence[str], summary: Mapping[str, Any]) -> str:
    """Return the document of a recording in Markdown: log lines about the scene, scene file, summary."""
    parts = [f"# {scene_name(scene.path)}", "\n".join(f"- {line}" for line in lines)]
    if scene.path.is_file():
        parts.append(f"## Scene\n```yaml\n{scene.path.read_text(encoding='utf-8')}\n```")
    if summary:
        parts.append(f"## Summary\n```json\n{json.dumps(summary, indent=2)}\n```")
    return "\n\n".join(parts)
