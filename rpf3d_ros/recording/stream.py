"""Draw terrain, sources, answers and alerts into an open recording of rerun, to a file or to a viewer.

`recordings.log.import_rerun` imports rerun when a recording is opened: the simulator does not need rerun.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.recordings.log import import_rerun
from rpf3d_core.recordings.shapes import coloured_mesh
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.health import OK, WARN, Health
from rpf3d_ros.messages.marker_reading import Colour, Strip
from rpf3d_ros.messages.moving_rocks import FRAME, RockPositions
from rpf3d_ros.recording import file_writer
from rpf3d_ros.recording.views import STATE_COLOURS, blueprint, extent_of

APPLICATION = "rpf3d_live"
SOURCE_COLOUR, UPDATE_COLOUR, AREA_COLOUR, ROCK_COLOUR = (255, 140, 0), (60, 130, 200), (230, 60, 200), (20, 20, 20)
LINE_PIXELS, POINT_PIXELS, DEPOSIT_PIXELS, OUTLINE_PIXELS, ROCK_PIXELS = 0.7, 1.5, 3.0, 2.0, 4.0
"""Sizes on the screen (pixels) of lines and points; with sizes in metres, a rock of 1 m would be invisible in a pit.

Rerun interprets negative radii as radii on the screen.
"""

ARROW_LENGTH, LIFT = 3.0, 0.15
"""Length of a source's arrow (m); height of hazard facets above the ground, which would hide them (m)."""

UNKNOWN, PERCENT = 255, 100
"""Value of a grid cell (one byte) whose reach probability is unknown; largest percentage."""

FARTHER = 1.5
"""Factor by which trajectories must extend farther than those for which the eye was last placed, to move the eye."""

FLUSH_TIMEOUT = 60.0
"""Timeout of a flush (s); the terrain of 2.3 million triangles takes 1.3 s to write."""

JOULE_PER_KJ = 1000.0
MILLISECONDS_A_FRAME = round(1000 * FRAME)


class Recording:
    """An open rerun recording of a live node.

    Set the time with `at`, add rows, then call `flush`; flushed rows are kept if the process is killed. There is one
    method for each kind of row; `RecordingEntry.draw` calls one of them.
    """

    def __init__(self, stream: Any, in_file: bool = False) -> None:
        """Write the rows that never change: the coordinate system and the styles.

        stream : a rerun.RecordingStream that already has its sink: the file or the viewer that receives the rows
        in_file : True if the sink is a file
        """
        self._rerun, self._stream, self._in_file = import_rerun(), stream, in_file
        self._extent_in_view = 0.0
        self._stamp_ns, self._event = 0, 0
        self._frames, self._lanes = 0, set[str]()
        self._log("/", self._rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._style()

    def about(self, text: str) -> None:
        """Add the text (Markdown) that states what the recording leaves out."""
        document = self._rerun.TextDocument(text, media_type=self._rerun.MediaType.MARKDOWN)
        self._log("about", document, static=True)

    def at(self, stamp_ns: int, event: int) -> None:
        """Set the time (ns since the epoch) and the number of the event for all following rows."""
        self._stamp_ns, self._event = stamp_ns, event
        self._stream.set_time("ros_time", timestamp=np.datetime64(stamp_ns, "ns"))
        self._stream.set_time("event", sequence=event)

    def terrain(self, vertices: FloatArray, triangles: IntArray) -> None:
        """Add the terrain as one zone, and delete the patches of the previous terrain from the screen.

        vertices : (V, 3) m; triangles : (T, 3) indices of vertices
        """
        zone = np.zeros(len(triangles), dtype=np.int32)
        mesh = coloured_mesh(Terrain(vertices=vertices, triangles=triangles, zone=zone, zones=("terrain",)))
        self.clear("terrain/updates")
        self._log(
            "terrain",
            self._rerun.Mesh3D(
                vertex_positions=mesh.vertices,
                triangle_indices=mesh.triangles,
                vertex_normals=mesh.normals,
                vertex_colors=mesh.colours,
            ),
        )

    def update(self, number: int, points: FloatArray) -> None:
        """Add a patch of the terrain as points (N, 3) m; number : a patch with the same number is replaced."""
        self._log(f"terrain/updates/{number}", self._points(points, UPDATE_COLOUR, POINT_PIXELS))

    def sources(self, positions: FloatArray, directions: FloatArray, sensor: str = "") -> None:
        """Add the sources of one message; S = 0 means that no rock is moving.

        positions : (S, 3) m, release points; directions : (S, 3) (-), unit vectors of motion, 0 if unknown
        sensor : topic of the sensor that reports the sources; "" for the default topics and for clicked points
        """
        entity = _under("sources", sensor)
        self._log(entity, self._points(positions, SOURCE_COLOUR, DEPOSIT_PIXELS))
        arrows = self._rerun.Arrows3D(origins=positions, vectors=ARROW_LENGTH * directions, colors=SOURCE_COLOUR)
        self._log(f"{entity}/direction", arrows)

    def area(self, name: str, corners: FloatArray) -> None:
        """Add the outline of an area of interest; corners : (N, 3) m, N = 1 draws a point, N = 0 no outline."""
        outline = [np.vstack([corners, corners[:1]])] if len(corners) else []
        self._log(_under("areas", name), self._rerun.LineStrips3D(outline, radii=-OUTLINE_PIXELS, colors=AREA_COLOUR))

    def area_outline(self, name: str, lines: list[FloatArray]) -> None:
        """Add the outlines of an area of interest on the ground, lines (T, 3) m; the outline of `area` stays, too."""
        strips = [_lifted(line) for line in lines]
        entity = _outline_of_area(name)
        self._log(entity, self._rerun.LineStrips3D(strips, radii=-OUTLINE_PIXELS, colors=AREA_COLOUR, labels=[name]))

    def clear_area(self, name: str) -> None:
        """Delete the outlines that `area_outline` has added for an area of interest from the screen."""
        self.clear(_outline_of_area(name))

    def places(self, name: str, positions: FloatArray) -> None:
        """Add the places (N, 3) m of machines, such as vehicles, as points; name : name of their area of interest."""
        self._log(_under("areas", name), self._points(positions, AREA_COLOUR, DEPOSIT_PIXELS))

    def trajectories(self, strips: list[Strip]) -> None:
        """Add the trajectories, as separate segments, because a line of rerun has only one colour.

        If the trajectories extend more than FARTHER times as far as those for which the viewer's eye was last placed,
        the eye moves to show all of them.
        """
        pieces = [np.stack([strip.points[:-1], strip.points[1:]], axis=1) for strip in strips]
        colours = [strip.colours[:-1] for strip in strips]
        lines = self._rerun.LineStrips3D(
            np.concatenate([np.empty((0, 2, 3)), *pieces]),
            radii=-LINE_PIXELS,
            colors=np.concatenate([np.empty((0, 4), dtype=np.uint8), *colours]),
        )
        self._log("trajectories", lines)
        if (extent := extent_of(strips)) > FARTHER * self._extent_in_view:
            self._stream.send_blueprint(blueprint(strips))
            self._extent_in_view = extent

    def motion(self, motion: RockPositions) -> None:
        """Add the motion of rocks, one row for each moment, so that the viewer can play it.

        The motion is on two timelines: simulated time, and ROS time, which begins at the stamp of the event. A frame is
        the picture of one moment. On both timelines, the times of frames are multiples of the frame step, so frames of
        this event replace frames of an earlier event at the same times. If the earlier event had more frames, frames
        without rocks follow.
        """
        rocks, frames = motion.positions.shape[1], len(motion.times)
        self._frames = max(self._frames, frames)
        steps = MILLISECONDS_A_FRAME * np.arange(self._frames, dtype="timedelta64[ms]")
        first = np.datetime64(self._stamp_ns // (1_000_000 * MILLISECONDS_A_FRAME) * MILLISECONDS_A_FRAME, "ms")
        timelines = [
            self._rerun.TimeColumn("sim_time", duration=steps.astype("timedelta64[ns]")),
            self._rerun.TimeColumn("ros_time", timestamp=(first + steps).astype("datetime64[ns]")),
            self._rerun.TimeColumn("event", sequence=np.full(self._frames, self._event)),
        ]
        lengths = [rocks] * frames + [0] * (self._frames - frames)
        rows = self._rerun.Points3D.columns(positions=motion.positions.reshape(-1, 3)).partition(lengths)
        if lengths:
            self._stream.send_columns("trajectories/rocks", timelines, rows)

    def points(self, entity: str, positions: FloatArray, energy: FloatArray) -> None:
        """Add points (N, 3) m, such as impacts, coloured by energy (N,) J; entity : name in the recording."""
        self._coloured(entity, positions, energy, float(np.max(energy, initial=0.0)), {"energy_j": energy})

    def energies(self, energy: FloatArray) -> None:
        """Add the largest value and the 95th percentile of energies at impacts, (N,) J, to the plots, in kJ."""
        if len(energy):
            for name, value in (("largest", energy.max()), ("p95", np.percentile(energy, 95))):
                self._log(f"energy/{name}", self._rerun.Scalars(float(value) / JOULE_PER_KJ))

    def reach(self, positions: FloatArray, reach: FloatArray, columns: dict[str, NDArray[Any]]) -> None:
        """Add the map cells that rocks reached, (N, 3) m, coloured by the share of rocks (N,) that reach each cell.

        columns : further columns, name -> (N,)
        """
        self._coloured("hazard/points", positions, reach, 1.0, {"reach_probability": reach, **columns})

    def grid(self, percent: NDArray[np.int8]) -> None:
        """Add the map of reach probability (H, W) in percent, -1 for unknown values.

        The first row is the southernmost row, and the first column the westernmost column.
        """
        classes = np.where(percent < 0, UNKNOWN, percent).astype(np.uint8)
        self._log("plan/reach_probability", self._rerun.SegmentationImage(classes[::-1], opacity=1.0))

    def hazard(self, level: str, corners: FloatArray, colour: Colour) -> None:
        """Add the facets of a hazard zone, corners (F, 3, 3) m, lifted so that the ground does not hide them.

        level : name of the zone; colour : red, green, blue, opacity, 0 to 1
        """
        lifted = _lifted(corners.reshape(-1, 3))
        triangles = np.arange(len(lifted)).reshape(-1, 3)
        mesh = self._rerun.Mesh3D(vertex_positions=lifted, triangle_indices=triangles, albedo_factor=list(colour))
        self._log(_under("hazard", level), mesh)

    def outline(self, level: str, lines: list[FloatArray], colour: Colour) -> None:
        """Add the outline of a hazard zone: lines (T, 3) m, lifted so that the ground does not hide them.

        level : name of the zone; colour : red, green, blue, opacity, 0 to 1
        """
        solid = [int(255 * share) for share in colour[:3]]
        strips = self._rerun.LineStrips3D([_lifted(line) for line in lines], radii=-OUTLINE_PIXELS, colors=solid)
        self._log(_under("hazard", level) + "/outline", strips)

    def clear(self, entity: str) -> None:
        """Delete an entity of the recording, and all entities below it, from the screen."""
        self._log(entity, self._rerun.Clear(recursive=True))

    def clear_hazard(self, level: str) -> None:
        """Delete the facets and the outline of a hazard zone from the screen."""
        self.clear(_under("hazard", level))

    def alert(self, level: int) -> None:
        """Add the alert level of the site to the plot of the level; level : from 0 for normal to 4 for fault."""
        self._log("alert_level", self._rerun.Scalars(float(level)))

    def alert_state(self, name: str, state: str | None) -> None:
        """Add the state of the site, the alarm or an area to its lane, a bar over time.

        name : site, alarm or area/<name>; state : a key of STATE_COLOURS, None to end the bar
        """
        lane = _under("alert_state", name)
        if lane not in self._lanes:
            self._lanes.add(lane)
            states, colours = list(STATE_COLOURS), list(STATE_COLOURS.values())
            self._log(lane, self._rerun.StateConfiguration(values=states, labels=states, colors=colours), static=True)
        self._log(lane, self._rerun.StateChange(state=[state]))

    def text(self, entity: str, health: Health) -> None:
        """Add the state of a part of a node as a line of text; entity : name of the log in the recording."""
        levels = {OK: self._rerun.TextLogLevel.INFO, WARN: self._rerun.TextLogLevel.WARN}
        text = "; ".join([health.message, *(f"{key} {value}" for key, value in health.values.items())])
        level = levels.get(health.level, self._rerun.TextLogLevel.ERROR)
        self._log(entity, self._rerun.TextLog(f"{health.name}: {text}", level=level))

    def flush(self, seconds: float = FLUSH_TIMEOUT) -> None:
        """Wait until all added rows are written. Raises RuntimeError if this fails or takes more than `seconds`."""
        if self._in_file:
            file_writer.flush(self._stream, seconds)
        else:
            self._stream.flush(timeout_sec=seconds)

    def close(self) -> None:
        """Complete the file; nothing can be added afterwards. Raises RuntimeError if this fails."""
        file_writer.close(self._stream, FLUSH_TIMEOUT)

    def leave(self) -> None:
        """Disconnect from a viewer without a flush; a hung viewer may block this call."""
        self._stream.disconnect()

    def _style(self) -> None:
        """Write the styles of rocks, plots and lanes (bars of states), which never change."""
        rr = self._rerun
        rocks = rr.Points3D.from_fields(colors=[ROCK_COLOUR], radii=[-ROCK_PIXELS])
        self._log("trajectories/rocks", rocks, static=True)
        self._log("plan", _colours_of_percentages(rr), static=True)
        step = rr.components.InterpolationMode.StepAfter
        self._log("alert_level", rr.SeriesLines(names=["level"], widths=[2.0], interpolation_mode=step), static=True)
        for name in ("largest", "p95"):
            self._log(f"energy/{name}", rr.SeriesPoints(names=[name], marker_sizes=[4.0]), static=True)
            self._log(f"energy/{name}", rr.SeriesLines(names=[name], interpolation_mode=step), static=True)

    def _coloured(
        self, entity: str, positions: FloatArray, values: FloatArray, top: float, columns: dict[str, NDArray[Any]]
    ) -> None:
        pixels = DEPOSIT_PIXELS if entity == "deposits" else POINT_PIXELS
        cloud = self._rerun.Points3D(positions, radii=-pixels, colors=speed_colours(values, top))
        self._log(entity, cloud, self._rerun.AnyValues(**columns))

    def _points(self, positions: FloatArray, colour: tuple[int, int, int], pixels: float) -> Any:
        return self._rerun.Points3D(positions, radii=-pixels, colors=colour)

    def _log(self, entity: str, *rows: Any, static: bool = False) -> None:
        self._stream.log(entity, *rows, static=static)


def file_recording(path: Path) -> Recording:
    """Return a recording to a file, which is created or replaced.

    Raises InputError if rerun is missing, OSError if the folder is missing or the file cannot be created.
    """
    rerun = import_rerun()
    if not path.parent.is_dir():
        raise FileNotFoundError(f"there is no folder {path.parent} to write the recording into")
    stream = rerun.RecordingStream(APPLICATION)
    try:
        stream.save(str(path), default_blueprint=blueprint())
    except RuntimeError as error:
        raise OSError(str(error)) from error
    return Recording(stream, in_file=True)


def _colours_of_percentages(rr: Any) -> Any:
    """Return rerun's colours and labels for the percentages 0 to 100 and for unknown values, which are transparent."""
    colours = speed_colours(np.arange(PERCENT + 1.0), float(PERCENT)).tolist()
    known = [(percent, f"{percent} %", (*colour, 255)) for percent, colour in enumerate(colours)]
    return rr.AnnotationContext([*known, (UNKNOWN, "unknown", (0, 0, 0, 0))])


def _under(root: str, name: str) -> str:
    """Return the name of a part of the recording below `root`; special characters of a received name are escaped."""
    return str(import_rerun().new_entity_path([root, *filter(None, name.split("/"))]))


def _outline_of_area(name: str) -> str:
    return f"{_under('areas', name)}/outline"


def _lifted(points: FloatArray) -> FloatArray:
    return points + np.array([0.0, 0.0, LIFT])
