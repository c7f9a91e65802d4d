"""The field observations of a scene: end points with their blocks, values at gates, and counts."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.columns import column_of, doubt_on_masses
from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.scene.calibration import CalibrationSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.observed import horizontal_direction
from rpf3d_core.setup.unknowns import unknowns_of
from rpf3d_core.terrain.frame import Frame

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Directions(NamedTuple):
    """The horizontal directions along and across the slope, in which stops are compared.

    axes : (2, 3) unit vectors in the local frame: along the slope, and across it to the left of this direction
    origin : (2,) m, added to distances along the axes; the sum is the distance in the input's coordinates
    """

    axes: FloatArray
    origin: FloatArray

    def places(self, x: FloatArray) -> FloatArray:
        """Return the coordinates (R, 2) m, along and across the slope, of local points (R, 3) m; `origin` is added."""
        return np.asarray(x @ self.axes.T + self.origin)


class Values(NamedTuple):
    """Values (N,) of one kind that were observed at a gate: speeds (m/s), heights (m) or energies (kJ).

    gate : name of the gate; kind : "speed", "height" or "energy"
    at : m, distance of the gate along the slope
    error : standard deviation of the measuring error, in the unit of the values
    """

    gate: str
    kind: str
    at: float
    observed: FloatArray
    error: float


class ObservedCount(NamedTuple):
    """Number of observed rocks that passed a gate, or stopped in or reached a place.

    place : name of the gate, area of interest or section; kind : passed, stopped or reached
    at : m, distance of the gate along the slope; None for an area or section
    rocks : number of these rocks; of : number of all observed rocks
    """

    place: str
    kind: str
    at: float | None
    rocks: int
    of: int


class Field(NamedTuple):
    """All field observations of a scene.

    stops : (N, 2) m, along and across, in the input's coordinates; (0, 2) if no end points were observed
    masses : (N,) kg, or None if unknown; shapes : (N,) numbers of the shapes from 0, or None if unknown
    values : values observed at gates; counted : counts of observed rocks
    doubt : a sentence on the unit of the masses, "" without doubt
    """

    stops: FloatArray
    masses: FloatArray | None
    shapes: IntArray | None
    values: tuple[Values, ...]
    counted: tuple[ObservedCount, ...]
    doubt: str = ""


def calibration_of(scene: Scene) -> CalibrationSpec:
    """Return the section `calibration` of a scene, or its defaults, with all unknowns that the calibration varies.

    These are the unknowns of the section, and the scene's other unknowns that the section does not replace.

    Raises
    ------
    InputError
        The scene has a sample of parameter sets, or names no unknowns; the message shows what to do.
    """
    if scene.unknowns is not None and scene.unknowns.sample is not None:
        raise InputError(f"{scene.path}: `unknowns.sample` gives the values of an earlier calibration, which a "
                         "calibration would ignore; calibrate the scene that it was made from, or remove `sample` and "
                         "`misfit` from `unknowns`")  # fmt: skip
    unknowns = unknowns_of(scene)
    if not unknowns:
        raise InputError(f"{scene.path}: names no unknowns; add `calibration: {{unknowns: {{materials.*.friction: "
                         "{min: 0.2, max: 1.2}}}`, with the key paths of this scene")  # fmt: skip
    spec = CalibrationSpec() if scene.calibration is None else scene.calibration
    return spec.model_copy(update={"unknowns": unknowns})


def directions_of(scene: Scene, frame: Frame) -> Directions:
    """Return the directions along and across the slope, from `observed.along` of the scene.

    If the scene has no section `observed`, the direction along the slope is the x axis of the input.
    """
    along = (1.0, 0.0, 0.0) if scene.observed is None else scene.observed.along
    first = frame.directions_to_local(horizontal_direction(along, frame.up))
    axes = np.stack([first, [-first[1], first[0], 0.0]])
    return Directions(axes=axes, origin=axes @ np.array(frame.origin))


def field_of(scene: Scene, frame: Frame) -> Field:
    """Return all observations of a scene.

    Raises
    ------
    InputError
        The scene has no observations, a file is damaged, or a column or a place is missing.
    """
    spec, directions = calibration_of(scene), directions_of(scene, frame)
    stops, masses, shapes, doubt = np.empty((0, 2)), None, None, ""
    if scene.observed is not None:
        points = read_points(scene.observed.points_file, frame.up, heights=False)
        stops = directions.places(frame.points_to_local(points))
        masses = _column(scene, spec.mass_column, "mass_column")
        shapes = _shape_numbers(scene, spec)
        if spec.mass_column is not None:
            doubt = doubt_on_masses(scene.observed.points_file, spec.mass_column)
    values, counted = tuple(_values_of(spec)), tuple(_counted_in(scene, spec))
    if not len(stops) and not values and not counted:
        raise InputError(f"{scene.path}: there is nothing to calibrate on; add `observed: {{points_file: ...}}`, or "
                         "`calibration: {gates: ..., shares: ...}`")  # fmt: skip
    return Field(stops=stops, masses=masses, shapes=shapes, values=values, counted=counted, doubt=doubt)


def _column(scene: Scene, column: int | str | None, key: str) -> FloatArray | None:
    """Return a column (N,) of the file of observed end points; None if the scene names no such column."""
    if column is None or scene.observed is None:
        return None
    return column_of(scene.observed.points_file, column, key)


def _shape_numbers(scene: Scene, spec: CalibrationSpec) -> IntArray | None:
    """Return the number of each block's shape (N,), from 0; None if the scene names no column of shapes.

    Raise InputError if a cell is not the number of a shape, from 1, in `rock.shape.files`.
    """
    column = _column(scene, spec.shape_column, "shape_column")
    if column is None:
        return None
    files = (scene.rock.shape.files or ()) if scene.rock.shape is not None else ()
    numbers = column.astype(np.int64)
    if (numbers != column).any() or numbers.min() < 1 or numbers.max() > len(files):
        raise InputError(f"{scene.path}: `calibration.shape_column` must hold numbers from 1 to {len(files)}, the "
                         "places in rock.shape.files")  # fmt: skip
    return numbers - 1


def _values_of(spec: CalibrationSpec) -> Iterator[Values]:
    """Yield the values observed at the gates of a scene: one item for each gate and kind of value, such as speeds."""
    for gate in spec.gates:
        each = (("speed", gate.speeds, gate.speed_error), ("height", gate.heights, gate.height_error),
                ("energy", gate.energies, gate.energy_error))  # fmt: skip
        for kind, observed, error in each:
            if observed:
                yield Values(gate=gate.name, kind=kind, at=gate.at, observed=np.array(observed), error=error)


def _counted_in(scene: Scene, spec: CalibrationSpec) -> Iterator[ObservedCount]:
    """Yield all counts of a scene: of rocks that passed a gate, stopped in a place or reached a place.

    Raise InputError if a place is neither an area of interest nor a section of `observed`.
    """
    for gate in spec.gates:
        if gate.passed is not None and gate.of is not None:
            yield ObservedCount(place=gate.name, kind="passed", at=gate.at, rocks=gate.passed, of=gate.of)
    areas = [area.name for area in scene.areas_of_interest]
    sections = {} if scene.observed is None else scene.observed.sections
    for share in spec.shares:
        if share.place not in areas and share.place not in sections:
            known = ", ".join([*areas, *sections]) or "none"
            raise InputError(f"{scene.path}: `calibration.shares` names {share.place!r}, which is neither an area of "
                             f"interest nor a section of `observed`; there are: {known}")  # fmt: skip
        if share.stopped is not None:
            yield ObservedCount(place=share.place, kind="stopped", at=None, rocks=share.stopped, of=share.of)
        elif share.reached is not None:
            yield ObservedCount(place=share.place, kind="reached", at=None, rocks=share.reached, of=share.of)
