"""Report the observations of a scene: stops, values at gates, counts, and warnings on places outside the terrain."""

from collections.abc import Iterator

from rpf3d_core.calibration.data_checks import check_field, check_stops, without_ground
from rpf3d_core.calibration.field_warnings import field_warnings
from rpf3d_core.calibration.observations import Directions, Field, directions_of, field_of
from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import plain
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.setup.unknowns import unknowns_of

NAMED = 5
"""Largest number of stops that a warning names."""


def observations_in_words(prepared: Prepared) -> tuple[tuple[str, ...], list[str]]:
    """Return lines of text on the observations that `rpf3d calibrate` reads, and a list of warnings about them.

    Without a calibration in the scene, there are no lines, and only warnings on observed stops outside the terrain. If
    `rpf3d calibrate` would refuse the observations, there are no lines, and the one warning states the reason.
    """
    if prepared.scene.calibration is None:
        return (), list(_stops_outside(prepared))
    try:
        field = field_of(prepared.scene, prepared.terrain.frame)
        directions = directions_of(prepared.scene, prepared.terrain.frame)
        check_field(prepared.scene, field)
        check_stops(prepared, directions, field)
    except InputError as fault:
        return (), [f"rpf3d calibrate would refuse this scene (the exit code is for rpf3d run): {fault}"]
    warnings = [*_stops_outside(prepared), *_gates_outside(prepared, field, directions)]
    return tuple(_lines(field)), [*warnings, *field_warnings(prepared, field)]


def unknowns_in_words(scene: Scene) -> str:
    """Return the unknowns that `rpf3d calibrate` fits, with their priors; empty if the scene has no calibration."""
    if scene.calibration is None:
        return ""
    return "; ".join(f"{name} ({prior.describe()})" for name, prior in unknowns_of(scene).items()) or "none named"


def _lines(field: Field) -> Iterator[str]:
    """Yield a line of text for the observed stops, for the values at each gate, and for each count."""
    if len(field.stops):
        (along, across), (end, side) = field.stops.min(axis=0), field.stops.max(axis=0)
        spans = f"along {plain(along)} .. {plain(end)} m, across {plain(across)} .. {plain(side)} m"
        yield f"{len(field.stops):,} observed stops, {spans}{_masses(field)}"
    for one in field.values:
        low, high = one.observed.min(), one.observed.max()
        yield f"gate {one.gate} at {plain(one.at)} m: {len(one.observed):,} x {one.kind}, {low:g} to {high:g}"
    for count in field.counted:
        yield f"{count.place}: {count.rocks:,} of {count.of:,} observed rocks {count.kind}"


def _masses(field: Field) -> str:
    if field.masses is None:
        return ""
    return f", masses {field.masses.min():g} to {field.masses.max():g} kg"


def _stops_outside(prepared: Prepared) -> Iterator[str]:
    """Yield a warning if observed stops lie outside the terrain in plan, or over a hole."""
    scene: Scene = prepared.scene
    if scene.observed is None:
        return
    points = read_points(scene.observed.points_file, scene.terrain.up, heights=False)
    outside = without_ground(prepared, prepared.terrain.frame.points_to_local(points))
    if not len(outside):
        return
    named = ", ".join(f"{i} at ({', '.join(plain(value) for value in points[i - 1].tolist())})"
                      for i in outside[:NAMED])  # fmt: skip
    more = f" and {len(outside) - NAMED:,} more" if len(outside) > NAMED else ""
    yield (f"{len(outside):,} of {len(points):,} observed stops lie outside the terrain, where no simulated rock can "
           f"stop: number {named}{more}; extend the terrain, or correct the coordinates")  # fmt: skip


def _gates_outside(prepared: Prepared, field: Field, directions: Directions) -> Iterator[str]:
    """Yield a warning for each gate whose place along `observed.along` lies outside the terrain."""
    along = directions.places(prepared.terrain.vertices)[:, 0]
    low, high = float(along.min()), float(along.max())
    gates = {one.gate: one.at for one in field.values}
    gates |= {one.place: one.at for one in field.counted if one.at is not None}
    for name, at in gates.items():
        if not low <= at <= high:
            yield (f"gate {name!r} is at {plain(at)} m, but the terrain reaches from {plain(low)} to {plain(high)} m "
                   "along the slope: no rock passes it")  # fmt: skip
