"""The part of a report on inputs: terrain, materials, rocks, sources, models, with where each value comes from."""

from collections.abc import Iterator
from typing import Any

from rpf3d_core.report.blocks import Block, Heading, Table, Text
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.words import UNKNOWN, given
from rpf3d_core.results.inputs import ASSUMED, CALIBRATED, PARTLY, RANGES

GROUND = {
    ASSUMED: "NOT calibrated. Each coefficient is one assumed value.",
    RANGES: "NOT calibrated. Coefficients are ranges from books or estimates, marked below.",
    PARTLY: "PARTLY calibrated. Some coefficients marked below are a sample that a calibration on observed rocks left, "
    "others are ranges from books or estimates.",
    CALIBRATED: "Calibrated: coefficients marked below are a sample that a calibration on observed rocks left.",
}
SIZES = (("diameter", "m"), ("mass", "kg"), ("volume", "m3"))
PLACES = ("points", "points_file", "line", "polygon", "zone")
IDLE = ("draw", "library", "stop_speed")
"""Keys of a material that are no coefficients."""
STATED = "stated in the scene"
DEFAULT = "NOT stated: the default of rpf3d"
CONFIRMED = {
    "C": "read in the primary text", "CC": "read in an independent implementation", "S": "quoted by another text",
    "D": "derived in rpf3d", "UNCONFIRMED": "UNCONFIRMED",
}  # fmt: skip
"""How far a published figure is confirmed, in words, by the mark of the library."""


def inputs_part(run: RunFiles) -> list[Block]:
    """Return the section on inputs."""
    return [
        Heading("Inputs and where they come from"),
        Text(f"Ground: {GROUND[run.inputs['ground']]}"),
        Table(("input", "value", "source"), list(_rows(run)), right=False),
        Heading("Coefficients of the ground", 3),
        Table(("material", "coefficient", "value", "source"), list(_coefficients(run)), right=False),
    ]


def _rows(run: RunFiles) -> Iterator[tuple[str, str, str]]:
    """Yield the rows on terrain, rocks, sources, models and effects."""
    scene, facts = run.inputs["scene"], run.summary["terrain"]
    yield "terrain", _terrain(scene["terrain"], facts), STATED
    yield "coordinates", f"reference system {facts['crs'] or UNKNOWN}, {facts['up']} is up", STATED
    yield "rocks", _rock(scene["rock"]), "stated in the scene, or 1 m and 2,700 kg/m3 by default"
    for source in scene["sources"]:
        yield f"source {source['name']}", _source(source), STATED
    settings = run.summary["scene"]
    yield "rebound", f"{settings['rebound']} {given(settings['rebound_parameters'])}".strip(), "model of rpf3d"
    yield "ground", f"{settings['ground']} {given(settings['ground_parameters'])}".strip(), "model of rpf3d"
    for name, values in settings["effects"].items():
        for key, value in (values or {"": "with its defaults"}).items():
            if value is not None:
                path = f"effects.{name}.{key}"
                yield f"effect {name}", f"{key} {_range(run, path) or given(value)}".strip(), _source_of(run, path)
    yield "stop speed, gravity", f"{given(settings['stop_speed'])} m/s, {given(settings['gravity'])} m/s2", STATED


def _terrain(spec: dict[str, Any], facts: dict[str, Any]) -> str:
    files = ", ".join(file["path"] for file in spec["files"] or ()) or "synthetic pit of rpf3d, no site has it"
    berms = "".join(f"; berm {berm['name']} {given(berm['height'])} m high" for berm in spec["berms"])
    holes = facts["faults"].get("holes", 0)
    return f"{files}: {facts['triangles']:,} triangles, {holes:,} holes{berms}"


def _rock(rock: dict[str, Any]) -> str:
    """Return density, size and shape of the rocks as text."""
    size = next(
        (f"{name} {given(rock[name])} {unit}" for name, unit in SIZES if rock[name] is not None), "size of its files"
    )
    shape = "point" if rock["shape"] is None else given({k: v for k, v in rock["shape"].items() if k != "weights"})
    return f"density {given(rock['density'])} kg/m3, {size}, shape {shape}"


def _source(source: dict[str, Any]) -> str:
    """Return place, number and velocity of the rocks of a source as text."""
    kind = next(name for name in PLACES if source[name] is not None)
    place = source[kind]
    where = f"{kind} of {len(place)} points" if isinstance(place, list) else f"{kind.replace('_', ' ')} {place}"
    height = "" if source["above_ground"] is None else f", {given(source['above_ground'])} m above the ground"
    speed = source["velocity"] if source["speed"] is None else source["speed"]
    return f"{where}{height}, {source['rocks']:,} rocks or its share of the scene's, {given(speed)} m/s"


def _coefficients(run: RunFiles) -> Iterator[tuple[str, str, str, str]]:
    """Yield a row for each coefficient of each material, with its range and source."""
    for name, material in run.inputs["scene"]["materials"].items():
        for key, value in material.items():
            if key not in IDLE and value is not None:
                path = f"materials.{name}.{key}"
                shown = _range(run, path) or given(value)
                source = _source_of(run, path, material["library"], value)
                if key == "friction_angle_deg" and name in run.summary["scene"]["materials_with_default_friction"]:
                    source = DEFAULT
                yield name, key.replace("_", " "), shown, source


def _range(run: RunFiles, path: str) -> str | None:
    """Return the range of an unknown as text, from the parameter sets that flew; None for a value that is known."""
    key = _unknown_at(run, path)
    if key is None:
        return None
    found = run.summary["unknowns"]["parameters"][key]
    return f"{found['low']:.3g} to {found['high']:.3g} (mean {found['mean']:.3g})"


def _unknown_at(run: RunFiles, path: str) -> str | None:
    """Return the key path of the unknown that gives the value at a key path; None for a value that is known."""
    keys = [key for key in run.summary.get("unknowns", {}).get("parameters", {}) if _stands_for(key, path)]
    return min(keys, key=lambda key: "*" in key.split("."), default=None)  # a path without `*` wins, as in the run


def _source_of(run: RunFiles, path: str, library: str | None = None, value: Any = None) -> str:
    """Return where the value at a key path comes from; library : entry that the material names, or None."""
    unknown, coefficient = _unknown_at(run, path), path.rpartition(".")[2]
    entry = {} if library is None else run.inputs["library"][library]
    if unknown is None:
        of_entry = coefficient in entry.get("numbers", {}) and value == entry["numbers"][coefficient]
        return _published(library, entry) if of_entry else STATED
    if unknown in run.inputs["sampled"]:
        return f"calibration sample {run.summary['unknowns']['sample']}"
    prior = run.inputs["scene"]["unknowns"]["priors"][unknown]
    of_entry = coefficient in entry.get("ranges", {}) and prior == entry["ranges"][coefficient]
    return _published(library, entry) if of_entry else "range stated in the scene"


def _published(library: str | None, entry: dict[str, Any]) -> str:
    """Return the published source of an entry of the library, and how far it is confirmed."""
    note = f"; {entry['note']}" if entry["note"] else ""
    return f"library {library}: {entry['source']} ({CONFIRMED[entry['confirmed']]}){note}"


def _stands_for(key: str, path: str) -> bool:
    """True if the key path of a parameter, in which `*` stands for any key, leads to a value or to a part of it."""
    ours, theirs = key.split("."), path.split(".")
    return len(ours) >= len(theirs) and all(a in ("*", b) for a, b in zip(ours, theirs, strict=False))
