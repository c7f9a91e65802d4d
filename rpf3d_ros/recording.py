"""Received messages as a rerun recording, in the map frame.

rerun comes through `recordings.log.import_rerun`, when a recording is opened: the simulator
does without it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.errors import InputError
from rpf3d_core.recordings.blueprint import point_of_view
from rpf3d_core.recordings.log import import_rerun
from rpf3d_core.recordings.shapes import coloured_mesh
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.health import OK, WARN, Health
from rpf3d_ros.marker_reading import Strip

APPLICATION = "rpf3d_live"
SOURCE_COLOUR = (255, 140, 0)
LINE_PIXELS, POINT_PIXELS, DEPOSIT_PIXELS = 0.7, 1.5, 3.0
"""Radii on the screen: a rock of 1 m cannot be seen in a pit of 1 km. rerun reads negative radii so."""

ARROW_LENGTH, LIFT = 3.0, 0.15
"""Metres: length of a source's arrow; height of hazard facets above the ground, which would hide them."""

NOWHERE = Terrain(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32), np.zeros(0, dtype=np.int32), ())
"""Stands for the terrain where the eye is placed by trajectories alone."""

FLUSH_TIMEOUT = 60.0
"""Seconds; the terrain of 2.3 million triangles takes 1.3 s to write."""


class Recording:
    """An open .rrd file: log what happened, then `flush`; rows up to the last flush survive a kill."""

    def __init__(self, path: Path) -> None:
        """Create or replace the file. Raises InputError where rerun is missing or the folder cannot be written."""
        rerun = import_rerun()
        if not path.parent.is_dir():
            raise InputError(f"{path}: there is no folder {path.parent} to write the recording into")
        self._rerun = rerun
        self._eye_is_set = False
        self._stream = rerun.RecordingStream(APPLICATION)
        try:
            self._stream.save(str(path), default_blueprint=_blueprint())
        except (OSError, RuntimeError) as error:
            raise InputError(f"{path}: the recording cannot be written: {error}") from error
        self._stream.log("/", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def at(self, stamp_ns: int, event: int) -> None:
        """Set the time (ns since the epoch) and the number of the event that all following rows belong to."""
        self._stream.set_time("ros_time", timestamp=np.datetime64(stamp_ns, "ns"))
        self._stream.set_time("event", sequence=event)

    def terrain(self, vertices: FloatArray, triangles: IntArray) -> None:
        """Log the ground, vertices (V, 3) m, as one zone."""
        zone = np.zeros(len(triangles), dtype=np.int32)
        mesh = coloured_mesh(Terrain(vertices, triangles, zone, ("terrain",)))
        self._stream.log(
            "terrain",
            self._rerun.Mesh3D(
                vertex_positions=mesh.vertices,
                triangle_indices=mesh.triangles,
                vertex_normals=mesh.normals,
                vertex_colors=mesh.colours,
            ),
        )

    def sources(self, positions: FloatArray, directions: FloatArray) -> None:
        """Log where rocks are released, (R, 3) m, and which way (R, 3)."""
        self._stream.log("sources", self._rerun.Points3D(positions, radii=-POINT_PIXELS, colors=SOURCE_COLOUR))
        arrows = self._rerun.Arrows3D(origins=positions, vectors=ARROW_LENGTH * directions, colors=SOURCE_COLOUR)
        self._stream.log("sources/direction", arrows)

    def trajectories(self, strips: list[Strip]) -> None:
        """Log the thinned trajectories as one row, piece by piece: rerun gives a strip one colour."""
        pieces = [np.stack([strip.points[:-1], strip.points[1:]], axis=1) for strip in strips]
        colours = [strip.colours[:-1] for strip in strips]
        lines = self._rerun.LineStrips3D(
            np.concatenate([np.empty((0, 2, 3)), *pieces]),
            radii=-LINE_PIXELS,
            colors=np.concatenate([np.empty((0, 4), dtype=np.uint8), *colours]),
        )
        self._stream.log("trajectories", lines)
        if strips and not self._eye_is_set:
            self._stream.send_blueprint(_blueprint(strips))
            self._eye_is_set = True

    def points(self, entity: str, positions: FloatArray, energy: FloatArray) -> None:
        """Log a cloud (N, 3) m coloured by energy (N,) J; the energies are logged beside it."""
        colours = speed_colours(energy, float(np.max(energy, initial=0.0)))
        pixels = DEPOSIT_PIXELS if entity == "deposits" else POINT_PIXELS
        cloud = self._rerun.Points3D(positions, radii=-pixels, colors=colours)
        self._stream.log(entity, cloud, self._rerun.AnyValues(energy_j=energy))

    def hazard(self, level: str, corners: FloatArray, colour: tuple[float, float, float, float]) -> None:
        """Log the facets of a level, corners (F, 3, 3) m, lifted a little so that the ground does not hide them."""
        lifted = corners.reshape(-1, 3) + np.array([0.0, 0.0, LIFT])
        triangles = np.arange(len(lifted)).reshape(-1, 3)
        mesh = self._rerun.Mesh3D(vertex_positions=lifted, triangle_indices=triangles, albedo_factor=list(colour))
        self._stream.log(level, mesh)

    def clear(self, entity: str) -> None:
        """Take what an earlier event left at an entity and below it off the screen."""
        self._stream.log(entity, self._rerun.Clear(recursive=True))

    def health(self, health: Health) -> None:
        """Log the state of a node's part."""
        levels = {OK: self._rerun.TextLogLevel.INFO, WARN: self._rerun.TextLogLevel.WARN}
        text = "; ".join([health.message, *(f"{key} {value}" for key, value in health.values.items())])
        level = levels.get(health.level, self._rerun.TextLogLevel.ERROR)
        self._stream.log("diagnostics", self._rerun.TextLog(f"{health.name}: {text}", level=level))

    def flush(self) -> None:
        """Write what has been logged to the file."""
        self._stream.flush(timeout_sec=FLUSH_TIMEOUT)

    def close(self) -> None:
        """Write the file's footer; nothing can be logged afterwards."""
        self.flush()
        self._stream.disconnect()


def _blueprint(strips: Sequence[Strip] = ()) -> Any:
    """3D above, diagnostics below, at the last event; the eye is put in front of the first trajectories."""
    rrb = import_rerun().blueprint
    eye = None
    if strips:
        target, position = point_of_view(NOWHERE, _as_samples(strips))
        eye = rrb.EyeControls3D(position=position, look_target=target, eye_up=(0.0, 0.0, 1.0))
    views = rrb.Vertical(
        rrb.Spatial3DView(origin="/", name="Map frame", eye_controls=eye, line_grid=False),
        rrb.TextLogView(origin="diagnostics", name="Diagnostics"),
        row_shares=[4, 1],
    )
    panels = (
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="event", play_state="following"),
    )
    return rrb.Blueprint(views, *panels)


def _as_samples(strips: Sequence[Strip]) -> PathSamples:
    """The points of strips as samples of as many rocks; times and velocities are not known."""
    x = np.concatenate([strip.points for strip in strips])
    row = np.repeat(np.arange(len(strips)), [len(strip.points) for strip in strips])
    return PathSamples(row=row, t=np.zeros(len(x)), x=x, v=np.zeros_like(x), mode=np.zeros(len(x), dtype=np.int64))
