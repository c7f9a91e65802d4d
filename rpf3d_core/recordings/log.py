"""Write a recording (.rrd) of a run, to replay the run in the rerun viewer.

All positions are in the terrain's local frame, z up, because rerun stores float32. In float32 a survey coordinate of
4,500,000 m has steps of 0.5 m; a coordinate in a local frame of 10 km has steps of 1 mm. The origin to add is in the
log, the document and the name of the 3D view. rerun is imported only when a recording is written, because a run without
a recording does not need it.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.colours import OUTCOME_COLOURS, speed_colours
from rpf3d_core.ensemble.flights import Deposits, Flights, FloatArray, IntArray
from rpf3d_core.ensemble.paths import PathSamples, displayed_rows, positions_at, sample_paths
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.recordings.areas import log_areas
from rpf3d_core.recordings.blueprint import TIMELINE, blueprint
from rpf3d_core.recordings.hazard import log_hazard
from rpf3d_core.recordings.log_text import RecordedScene, document, outcome_line, rock_name, scene_lines, sentences_of
from rpf3d_core.recordings.obstacles import log_obstacles
from rpf3d_core.recordings.shapes import coloured_mesh, strips_by_speed
from rpf3d_core.recordings.tumbling import log_blocks
from rpf3d_core.results.orientations import blocks_of
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.values import DEPOSITED, Outcome

APPLICATION = "rpf3d"
FRAMES = 500
"""Number of moments for which the positions of moving rocks are recorded, evenly spaced until the last rock ends."""

SERIES_ROCKS = 20
"""Largest number of rocks with plots of speed and energy, because more lines cannot be distinguished."""

LOGGED_ROCKS = 10_000
"""Largest number of rocks with a log line on their outcome; the last line states how many more rocks there are."""

ROCK_COLOUR = (255, 140, 0)
ROCK_PIXELS, DEPOSIT_PIXELS = 4.0, 3.0
"""Radii of rocks in the viewer, in pixels: in metres, a rock of 1 m could not be seen in a pit of 1 km.

rerun interprets negative radii as pixels on the screen.
"""


class RecordedGround(NamedTuple):
    """The terrain of a recording, with everything that stands or is marked on it.

    obstacles : barriers and trees of the scene; areas : outline rings (N, 2) m of each area of interest, local frame
    """

    terrain: Terrain
    obstacles: Obstacles = NO_OBSTACLES
    areas: Mapping[str, Sequence[FloatArray]] = MappingProxyType({})


def write_recording(
    path: Path,
    scene: RecordedScene,
    ground: RecordedGround,
    flights: Flights,
    summary: Mapping[str, Any] | None = None,
    maps: HazardMaps | None = None,
) -> None:
    """Write run.rrd, the recording of a run: terrain, trajectories, moving rocks, plots, log, documents, view layout.

    Obstacles and areas of interest are shown as well, if `ground` has them.

    Up to `tumbling.SHOWN_BLOCKS` (48) rocks with a shape are shown as blocks that move and turn.

    Parameters
    ----------
    summary : mapping, optional
        Content of summary.json, for the log and the document.
    maps : HazardMaps, optional
        Hazard maps of the run; with them, the recording also has the hazard of the facets and the bench table.

    Raises
    ------
    InputError
        rerun is not installed.
    OSError
        The file could not be written.
    """
    rr = import_rerun()
    terrain = ground.terrain
    names, blocks = [source.name for source in scene.sources], blocks_of(scene, flights.deposits)
    rows = displayed_rows(flights.paths, scene.outputs.trajectories)
    samples = sample_paths(flights.paths, rows, gravity=scene.gravity)
    shown = displayed_rows(flights.paths, SERIES_ROCKS)
    most = (flights.deposits.max_speed, flights.deposits.max_energy)
    fastest, most_energy = (float(values[shown].max(initial=0.0)) for values in most)
    layout = blueprint(terrain, samples, fastest, most_energy, hazard=maps is not None)
    recording, stream = begin_recording(APPLICATION, layout)
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    log_terrain(recording, terrain)
    log_obstacles(recording, ground.obstacles)
    log_areas(recording, terrain, ground.areas)
    if maps is not None:
        log_hazard(recording, terrain, maps)
    log_trajectories(recording, samples)
    log_ends(recording, flights.deposits)
    log_moving_rocks(recording, flights, rows, scene.gravity)
    log_blocks(recording, blocks, flights, scene.rock.density, scene.gravity)
    log_series(recording, names, flights, scene.gravity)
    log_scene(recording, scene, terrain, summary or {})
    log_outcomes(recording, names, terrain, flights.deposits, sentences_of(summary or {}))
    end_recording(recording, stream, path)


def begin_recording(application: str, layout: Any) -> tuple[Any, Any]:
    """Return a new recording, and the stream that collects its content in memory.

    The stream is used because rerun, when it writes a file itself, waits without end if writing fails, for example on a
    full disk.

    application : name of the program for the viewer
    layout : the blueprint that a viewer shows. The layout is made active. With a layout that is only the default,
        rerun's web viewer would often show its own layout, because it chooses a layout when the first data arrive.
    """
    recording = import_rerun().RecordingStream(application)
    stream = recording.binary_stream()
    recording.send_blueprint(layout, make_active=True)
    return recording, stream


def end_recording(recording: Any, stream: Any, path: Path) -> None:
    """Write the content of a recording to a file, and close the recording; raise OSError if writing fails.

    recording, stream : from `begin_recording`
    """
    content = stream.read()
    recording.disconnect()
    path.write_bytes(content)


def import_rerun() -> Any:
    """Import and return the package rerun; if rerun is missing, raise an InputError with the command to install it."""
    try:
        import rerun
    except ImportError as fault:
        raise InputError("recordings need rerun: pip install 'rerun-sdk>=0.41,<0.42'") from fault
    return rerun


def log_terrain(recording: Any, terrain: Terrain) -> None:
    """Write the terrain to a recording as `world/terrain`, coloured by zone."""
    rr = import_rerun()
    mesh = coloured_mesh(terrain)
    recording.log(
        "world/terrain",
        rr.Mesh3D(
            vertex_positions=mesh.vertices,
            triangle_indices=mesh.triangles,
            vertex_normals=mesh.normals,
            vertex_colors=mesh.colours,
        ),
        static=True,
    )


def log_trajectories(recording: Any, samples: PathSamples) -> None:
    """Write sampled trajectories to a recording as `world/trajectories`, coloured by speed."""
    rr = import_rerun()
    fastest = float(samples.speed.max(initial=0.0))
    strips, speed = strips_by_speed(samples, fastest)
    colours = speed_colours(speed, fastest)
    recording.log("world/trajectories", rr.LineStrips3D(strips, colors=colours, radii=[-0.7]), static=True)


def log_ends(recording: Any, deposits: Deposits) -> None:
    """Write release points to a recording as `world/releases`, and end points, coloured by outcome, as `world/ends`."""
    rr = import_rerun()
    colours = np.array([OUTCOME_COLOURS[outcome] for outcome in Outcome], dtype=np.uint8)[deposits.outcome]
    recording.log("world/ends", rr.Points3D(deposits.x, colors=colours, radii=[-DEPOSIT_PIXELS]), static=True)
    releases = rr.Points3D(deposits.release, colors=[(20, 20, 20)], radii=[-DEPOSIT_PIXELS / 2])
    recording.log("world/releases", releases, static=True)


def log_moving_rocks(recording: Any, flights: Flights, rows: IntArray, gravity: float) -> None:
    """Write moving rocks to a recording, as `world/rocks`: their positions at FRAMES (500) evenly spaced moments.

    rows : (N,) rows of the rocks in `Deposits`; gravity : m/s^2
    """
    if len(rows) == 0:
        return
    rr = import_rerun()
    times = np.linspace(0.0, float(flights.deposits.t[rows].max()), FRAMES)
    positions = np.stack([positions_at(flights.paths, int(row), times, gravity) for row in rows], axis=1)
    recording.log("world/rocks", rr.Points3D.from_fields(colors=[ROCK_COLOUR], radii=[-ROCK_PIXELS]), static=True)
    columns = rr.Points3D.columns(positions=positions.reshape(-1, 3)).partition([len(rows)] * len(times))
    recording.send_columns("world/rocks", [rr.TimeColumn(TIMELINE, duration=times)], columns)


def log_series(recording: Any, names: Sequence[str], flights: Flights, gravity: float) -> None:
    """Write plots over time of speed (m/s) and translational kinetic energy (J), as `speed/...` and `energy/...`.

    Plots are written for at most SERIES_ROCKS (20) rocks.

    names : of the sources; gravity : m/s^2
    """
    rr = import_rerun()
    deposits = flights.deposits
    for row in displayed_rows(flights.paths, SERIES_ROCKS):
        samples = sample_paths(flights.paths, [row], gravity=gravity)
        name = rock_name(names, deposits, int(row))
        for quantity, values in (("speed", samples.speed), ("energy", 0.5 * deposits.mass[row] * samples.speed**2)):
            entity = f"{quantity}/{deposits.source[row]}/{deposits.rock[row]}"
            recording.log(entity, rr.SeriesLines(names=[name]), static=True)
            _send(recording, entity, samples.t, rr.Scalars.columns(scalars=values))


def log_scene(recording: Any, scene: RecordedScene, terrain: Terrain, summary: Mapping[str, Any]) -> None:
    """Write facts about the scene as log lines at time 0, and the scene file and summary as a document."""
    rr = import_rerun()
    lines = scene_lines(scene, terrain, summary)
    levels = [rr.TextLogLevel.INFO] * len(lines)
    _send(recording, "log/scene", np.zeros(len(lines)), rr.TextLog.columns(text=lines, level=levels))
    text = document(scene, lines, summary)
    recording.log("document", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def log_outcomes(
    recording: Any, names: Sequence[str], terrain: Terrain, deposits: Deposits, sentences: Mapping[Outcome, str]
) -> None:
    """Write a log line about the end of each rock: outcome, sentence, zone and figures.

    There are lines for at most LOGGED_ROCKS (10,000) rocks, then one line with the number of further rocks.

    names : of the sources; sentences : the sentence that explains each outcome
    """
    rr = import_rerun()
    order = np.argsort(deposits.t[:LOGGED_ROCKS], kind="stable")
    lines = [outcome_line(names, terrain, deposits, int(row), sentences) for row in order]
    levels = ["INFO" if deposits.outcome[row] in DEPOSITED else "WARN" for row in order]
    times = deposits.t[order]
    if len(deposits.t) > LOGGED_ROCKS:
        lines.append(f"{len(deposits.t) - LOGGED_ROCKS} more rocks are in deposits.csv only")
        levels, times = [*levels, "WARN"], np.append(times, times[-1])
    _send(recording, "log/rocks", times, rr.TextLog.columns(text=lines, level=levels))


def _send(recording: Any, entity: str, seconds: FloatArray, columns: Any) -> None:
    """Write a time series to a recording in one call.

    entity : path in the recording, such as speed/0/12; seconds : (N,) s, simulated time of each value
    columns : the N values, as columns of a rerun archetype
    """
    recording.send_columns(entity, [import_rerun().TimeColumn(TIMELINE, duration=seconds)], columns)
