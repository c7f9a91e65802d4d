"""Make the section of a report that lists the inputs: terrain, rocks, sources, models, materials, and their origin."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.formats.units import METRE
from rpf3d_core.report.elements import Element, Heading, Table, Text
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.words import UNKNOWN, given
from rpf3d_core.results.inputs import ASSUMED, CALIBRATED, ELSEWHERE, PARTLY, RANGES
from rpf3d_core.scene.material import BODY_KEYS, POINT_KEYS
from rpf3d_core.scene.releases import PLACES

GROUND = {
    ASSUMED: "NOT calibrated. Each coefficient is one assumed value.",
    RANGES: "NOT calibrated. Coefficients are ranges from books or estimates, marked below.",
    PARTLY: "PARTLY calibrated. Some coefficients marked below are a sample that a calibration on observed rocks left, "
    "others are ranges from books or estimates.",
    ELSEWHERE: "NOT calibrated for all sources. Coefficients marked below are a sample of a calibration, and rocks "
    "start away from the place of that calibration.",
    CALIBRATED: "Calibrated: coefficients marked below are a sample that a calibration on observed rocks left.",
}
SIZES = (("diameter", "m"), ("mass", "kg"), ("volume", "m3"))
DEGREES = "_deg"
"""Suffix of the keys of a material that are angles in degrees."""
IDLE = ("draw", "library", "stop_speed")
"""Keys of a material that are not in the table of coefficients."""
STATED = "stated in the scene"
FROM_FILES = "stated in the scene or in its files"
DEFAULT = "NOT stated: the default of rpf3d"
CONFIRMED = {
    "C": "read in the primary text", "CC": "read in an independent implementation", "S": "quoted by another text",
    "D": "derived in rpf3d", "UNCONFIRMED": "UNCONFIRMED",
}  # fmt: skip
"""Text on how a published figure was confirmed, by the mark in the library."""


def inputs_part(run: RunFiles) -> list[Element]:
    """Return the elements of the report's section on inputs."""
    return [
        Heading("Inputs and where they come from"),
        Text(f"Ground: {GROUND[run.inputs['ground']]}"),
        Table(("input", "value", "source"), list(_rows(run)), right=False),
        Heading("Coefficients of the ground", 3),
        Table(("material", "coefficient", "value", "source"), list(_coefficients(run)), right=False),
    ]


def _rows(run: RunFiles) -> Iterator[tuple[str, str, str]]:
    """Yield a row (input, value, source of the value) for terrain, rocks, sources, areas, models and effects."""
    scene, facts = run.inputs["scene"], run.summary["terrain"]
    yield "terrain", _terrain(scene["terrain"], facts), _stated(run, "terrain.files", "terrain.pit", "terrain.benches")
    yield "reference system", facts["crs"] or UNKNOWN, FROM_FILES if facts["crs"] else DEFAULT
    yield "upward axis", facts["up"], _stated(run, "terrain.up")
    yield from _rock(run, scene["rock"])
    for number, source in enumerate(scene["sources"]):
        yield from _source(run, number, source)
    for area in scene["areas_of_interest"]:
        outline = area["polygons"]
        yield f"area {area['name']}", outline if isinstance(outline, str) else f"{len(outline):,} corners", STATED
    settings = run.summary["scene"]
    for role in ("rebound", "ground"):
        yield from _model(run, role, settings[role], settings[f"{role}_parameters"])
    for name, values in settings["effects"].items():
        yield f"effect {name}", "acts", STATED
        yield from _parameters(run, f"effect {name}", f"effects.{name}", values)
    yield "stop speed", f"{given(settings['stop_speed'])} m/s", _source_of(run, "stop_speed")
    yield "gravity", f"{given(settings['gravity'])} m/s2", _stated(run, "gravity")


def _stated(run: RunFiles, *paths: str) -> str:
    """Return the origin of a value as text: STATED if the scene states it at any of the key paths, else DEFAULT."""
    return STATED if not set(paths).isdisjoint(run.inputs["given"]) else DEFAULT


def _model(run: RunFiles, role: str, name: str, values: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield the rows on a rebound or ground model and its parameters.

    role : "rebound" or "ground"; name : of the model; values : the parameters, by key
    """
    root = "contact" if f"contact.{name}" in run.inputs["given"] else role
    yield role, name, STATED if "." in name else _stated(run, f"{root}.{name}")
    yield from _parameters(run, role, f"{root}.{name}", values)


def _parameters(run: RunFiles, what: str, path: str, values: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield a row (what, parameter with value, origin of the value) for each parameter of a model or an effect.

    what : first cell of the rows; path : key path of the model or effect; values : the parameters, by key
    A path with more than one dot is that of an own model, whose name has dots.
    """
    own = path.count(".") > 1
    for key, value in values.items():
        if value is not None:
            at = f"{path}.{key}"
            shown = f"{key} {_range(run, at) or given(value)}".strip()
            parts = isinstance(value, list) and any(isinstance(item, dict) for item in value)
            default = "a default of the class" if own else "a default of rpf3d"
            yield what, shown, f"stated in the scene, or {default}" if own or parts else _source_of(run, at)


def _terrain(spec: dict[str, Any], facts: dict[str, Any]) -> str:
    files = ", ".join(f"{file['path']}{_read_in(file)}" for file in spec["files"] or ()) or _made(spec)
    berms = "".join(f"; berm {berm['name']} {given(berm['height'])} m high" for berm in spec["berms"])
    holes = facts["faults"].get("holes", 0)
    closed = facts["faults"].get("closed_seams", 0)
    seams = f", {closed:,} {'seam' if closed == 1 else 'seams'} closed" if closed else ""
    return f"{files}: {facts['triangles']:,} triangles, {holes:,} {'hole' if holes == 1 else 'holes'}{seams}{berms}"


def _read_in(file: dict[str, Any]) -> str:
    """Return the unit in which a terrain file is read as text, such as " (read in ft)"; "" for metres."""
    return f" (read in {file['unit']})" if file.get("unit") not in (None, METRE) else ""


def _made(spec: dict[str, Any]) -> str:
    """Return a description of a terrain that is not from files: a slope of benches, or a synthetic pit.

    spec : the section `terrain` of the scene
    """
    if benches := spec.get("benches"):
        dimensions = ", ".join(f"{name.replace('_', ' ')} {given(value)}" for name, value in benches.items())
        return f"slope of benches, a design ({dimensions})"
    return "synthetic pit of rpf3d, no site has it"


def _rock(run: RunFiles, rock: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield the rows on density, size and shape of the rocks; rock : the section `rock` of the scene."""
    sizes = (f"{name} {_size(run, f'rock.{name}', rock[name], unit)}" for name, unit in SIZES if rock[name] is not None)
    size = next(sizes, None)
    shape = "point" if rock["shape"] is None else given({k: v for k, v in rock["shape"].items() if k != "weights"})
    paths = [f"rock.{name}" for name, _ in SIZES]
    yield "rock density", f"{given(rock['density'])} kg/m3", _stated(run, "rock.density")
    yield "rock size", size or "that of its shape", STATED if size is None else _stated(run, *paths)
    yield "rock shape", shape, _stated(run, "rock.shape")
    yield "mass of the rocks flown", _masses(run), "follows from the sizes"


def _masses(run: RunFiles) -> str:
    """Return the range and the median of the masses of all rocks flown as text, without fragments."""
    mass = run.ends.mass[[piece == 0 for _, _, piece in run.ends.key]]
    low, middle, high = map(three_figures, (float(mass.min()), float(np.median(mass)), float(mass.max())))
    return f"{low} kg" if low == high else f"{low} to {high} kg, median {middle} kg"


def _size(run: RunFiles, path: str, value: Any, unit: str) -> str:
    """Return the size of rocks as text; for measured sizes: the file, the number of values and their range.

    path : key path of the size; value : its value in the scene; unit : such as m
    """
    found = run.inputs.get("measured", {}).get(path)  # earlier versions wrote no `measured`
    if found is None:
        return f"{given(value)} {unit}"
    where = given(value) if isinstance(value["measured"], str) else "measured, listed in the scene"
    return f"{where}: {found['number']:,} values from {found['min']:.6g} to {found['max']:.6g} {unit}"


def _source(run: RunFiles, number: int, source: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield the rows on place, sizes, number and velocity of the rocks of a source.

    number : index of the source in the scene, from 0; source : its values
    """
    kind = next(name for name in PLACES if source.get(name) is not None)
    place, what, at = source[kind], f"source {source['name']}", f"sources.{number}"
    where = f"{kind} of {len(place)} points" if isinstance(place, list) else f"{kind.replace('_', ' ')} {place}"
    height = "" if source["above_ground"] is None else f", {given(source['above_ground'])} m above the ground"
    speed = source["velocity"] if source["speed"] is None else source["speed"]
    yield what, where + height, STATED
    if any(source["spread"]):
        yield what, f"rocks up to {given(source['spread'])} m from there, along x, y and z", STATED
    for name, unit in SIZES:
        if source.get(name) is not None:
            yield what, f"{name} of its rocks {_size(run, f'{at}.{name}', source[name], unit)}", STATED
    flown = sum(name == source["name"] and piece == 0 for name, _, piece in run.ends.key)
    yield what, f"{flown:,} rocks flown", _stated(run, f"{at}.rocks", "rocks")
    yield what, f"{given(speed)} m/s{_direction(source)}", _stated(run, f"{at}.velocity", f"{at}.speed")


def _direction(source: dict[str, Any]) -> str:
    """Return the direction of the release speed of a source, and spreads of speed and direction, as text.

    source : its values in the scene
    """
    found = []
    if source["azimuth_deg"] is not None:
        found.append(f"towards {given(source['azimuth_deg'])} degrees clockwise from north")
    if source["elevation_deg"]:
        side = "above" if source["elevation_deg"] > 0.0 else "below"
        found.append(f"{given(abs(source['elevation_deg']))} degrees {side} the horizontal")
    if source["spread_deg"]:
        found.append(f"in a cone of {given(source['spread_deg'])} degrees to each side")
    if any(source["velocity_spread"]):
        found.append(f"vx, vy and vz up to {given(source['velocity_spread'])} m/s more or less")
    return "".join(f", {words}" for words in found)


def _coefficients(run: RunFiles) -> Iterator[tuple[str, str, str, str]]:
    """Yield a row (material, coefficient, value or range, origin of the value) for each coefficient of a material.

    Materials that no zone has are left out.
    """
    unused = run.inputs.get("unused_materials", ())  # earlier versions did not write it
    for name, material in run.inputs["scene"]["materials"].items():
        if name in unused:
            continue
        body = material["friction"] is not None or material["slip_friction"] is not None
        for key, value in material.items():
            if key not in (*IDLE, *(POINT_KEYS if body else BODY_KEYS)) and value is not None:
                path = f"materials.{name}.{key}"
                shown = _range(run, path) or given(value)
                yield name, _with_unit(key), shown, _source_of(run, path, material["library"], value)


def _with_unit(key: str) -> str:
    """Return a key of a material in words, such as "friction angle (degrees)"."""
    return f"{key.removesuffix(DEGREES).replace('_', ' ')}{' (degrees)' if key.endswith(DEGREES) else ''}"


def _range(run: RunFiles, path: str) -> str | None:
    """Return the range of the unknown that sets the value at a key path as text; None if no unknown sets the value.

    The range of a prior is given as in the scene, because parameter sets do not reach its ends. The range of a value
    from a calibration sample is that of the parameter sets.
    """
    key = _unknown_at(run, path)
    if key is None:
        return None
    if key not in run.inputs["sampled"]:
        prior = run.inputs["scene"]["unknowns"]["priors"][key]
        more = [f"{name} {given(prior[name])}" for name in ("mean", "sd") if prior[name] is not None]
        ends = f"{given(prior['min'])} to {given(prior['max'])}"
        return f"{ends} ({', '.join(more)})" if more else ends
    found = run.summary["unknowns"]["parameters"][key]
    return f"{found['low']:.3g} to {found['high']:.3g} (mean {found['mean']:.3g})"


def _unknown_at(run: RunFiles, path: str) -> str | None:
    """Return the key path of the unknown that sets the value at a key path; None if no unknown sets it."""
    keys = [key for key in run.summary.get("unknowns", {}).get("parameters", {}) if _stands_for(key, path)]
    return min(keys, key=lambda key: "*" in key.split("."), default=None)  # a key without `*` goes first, as in the run


def _source_of(run: RunFiles, path: str, library: str | None = None, value: Any = None) -> str:
    """Return the origin of the value at a key path as text: scene, default, library or calibration.

    library : library entry that the material names, or None
    value : value at the key path, to compare with the value of the library entry
    """
    unknown, coefficient = _unknown_at(run, path), path.rpartition(".")[2]
    entry = {} if library is None else run.inputs["library"][library]
    if unknown is None:
        of_entry = coefficient in entry.get("numbers", {}) and value == entry["numbers"][coefficient]
        return _published(library, entry) if of_entry else _stated(run, path)
    if unknown in run.inputs["sampled"]:
        return f"calibration sample {run.summary['unknowns']['sample']}"
    prior = run.inputs["scene"]["unknowns"]["priors"][unknown]
    if coefficient in entry.get("assumed", {}) and prior == entry["assumed"][coefficient]:
        return f"range assumed by rpf3d, because the entry {library} has none"
    of_entry = coefficient in entry.get("ranges", {}) and prior == entry["ranges"][coefficient]
    return _published(library, entry) if of_entry else "range stated in the scene"


def _published(library: str | None, entry: dict[str, Any]) -> str:
    """Return the published source of a library entry, how it was confirmed, and the entry's note, as text."""
    note = f"; {entry['note']}" if entry["note"] else ""
    return f"library {library}: {entry['source']} ({CONFIRMED[entry['confirmed']]}){note}"


def _stands_for(key: str, path: str) -> bool:
    """Return True if an unknown of a run sets the value at a key path, or a part of this value.

    key : key path of the unknown, in which `*` matches any key; path : key path of the value
    """
    ours, theirs = key.split("."), path.split(".")
    return len(ours) >= len(theirs) and all(a in ("*", b) for a, b in zip(ours, theirs, strict=False))
