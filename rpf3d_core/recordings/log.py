"""Writing a recording (.rrd) of a run for the rerun viewer.

Everything is in the terrain's local frame, z up, because rerun stores float32: a survey's 4,500,000 m leaves steps of
0.5 m there, a local frame of 10 km leaves 1 mm. The origin to add is in the log, the document and the 3D view's name.
rerun is imported when a recording is written, not before: a plain run does not need it.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from rpf3d_core.ensemble.colours import OUTCOME_COLOURS, speed_colours
from rpf3d_core.ensemble.flights import Deposits, Flights, FloatArray, IntArray
from rpf3d_core.ensemble.paths import PathSamples, displayed_rows, positions_at, sample_paths
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.recordings.blueprint import TIMELINE, blueprint
from rpf3d_core.recordings.hazard import log_hazard
from rpf3d_core.recordings.obstacles import log_obstacles
from rpf3d_core.recordings.shapes import coloured_mesh, strips_by_speed
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.values import DEPOSITED, OUTCOME_SENTENCES, Outcome

APPLICATION = "rpf3d"
FRAMES = 500
"""Moments at which the moving rocks are recorded, evenly over the longest path."""

SERIES_ROCKS = 20
"""Rocks with series of speed and energy: more lines cannot be told apart."""

LOGGED_ROCKS = 10_000
"""Rocks whose outcome is a line of the log; a last line says how many are left out."""

ROCK_COLOUR = (255, 140, 0)
ROCK_PIXELS, DEPOSIT_PIXELS = 4.0, 3.0
"""Radii on the screen: a rock of 1 m cannot be seen in a pit of 1 km. rerun reads negative radii so."""


class RecordedSource(Protocol):
    """What a recording needs of a source of rocks."""

    @property
    def name(self) -> str:
        """Of the source."""


class RecordedOutputs(Protocol):
    """What a recording needs of a scene's output settings."""

    @property
    def trajectories(self) -> int:
        """Number of rocks to show."""


class RecordedMethod(Protocol):
    """What a recording needs of the way contacts were found."""

    def describe(self) -> str:
        """In words."""


class RecordedScene(Protocol):
    """What a recording needs of a scene; `io.scene_model.Scene` has it."""

    @property
    def path(self) -> Path:
        """The scene file, quoted in the recording."""

    @property
    def seed(self) -> int:
        """Of the random streams."""

    @property
    def gravity(self) -> float:
        """In m/s^2."""

    @property
    def sources(self) -> Sequence[RecordedSource]:
        """In the order that `Deposits.source` counts."""

    @property
    def materials(self) -> Mapping[str, Any]:
        """By zone or pattern."""

    @property
    def method(self) -> RecordedMethod:
        """How contacts were found."""

    @property
    def outputs(self) -> RecordedOutputs:
        """How much is shown."""


def write_recording(
    path: Path,
    scene: RecordedScene,
    terrain: Terrain,
    flights: Flights,
    summary: Mapping[str, Any] | None = None,
    maps: HazardMaps | None = None,
    obstacles: Obstacles = NO_OBSTACLES,
) -> None:
    """Write run.rrd: terrain, trajectories, moving rocks, series, log, documents and a blueprint to see them with.

    Parameters
    ----------
    summary : mapping, optional
        As in summary.json, for the log and the document.
    maps : HazardMaps, optional
        Of the ensemble: adds the hazard of the facets and the bench table.
    obstacles : Obstacles, optional
        What stands in the rocks' way.

    Raises
    ------
    InputError
        If rerun is not installed.
    OSError
        The file could not be written.
    """
    rr = import_rerun()
    names = [source.name for source in scene.sources]
    rows = displayed_rows(flights.paths, scene.outputs.trajectories)
    samples = sample_paths(flights.paths, rows, gravity=scene.gravity)
    shown = displayed_rows(flights.paths, SERIES_ROCKS)
    most = (flights.deposits.max_speed, flights.deposits.max_energy)
    fastest, most_energy = (float(values[shown].max(initial=0.0)) for values in most)
    layout = blueprint(terrain, samples, fastest, most_energy, hazard=maps is not None)
    recording = rr.RecordingStream(APPLICATION)
    recording.save(path, default_blueprint=layout)
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    log_terrain(recording, terrain)
    log_obstacles(recording, obstacles)
    if maps is not None:
        log_hazard(recording, terrain, maps)
    log_trajectories(recording, samples)
    log_ends(recording, flights.deposits)
    log_moving_rocks(recording, flights, rows, scene.gravity)
    log_series(recording, names, flights, scene.gravity)
    log_scene(recording, scene, terrain, summary or {})
    log_outcomes(recording, names, terrain, flights.deposits, _sentences(summary or {}))
    close_recording(recording, path)


def close_recording(recording: Any, path: Path) -> None:
    """Write the rest of a recording to its file; OSError where that cannot be written."""
    try:
        recording.flush()
    except RuntimeError as fault:  # all that rerun says where its file cannot be written, as on a full disk
        raise OSError(f"{path}: the recording could not be written") from fault
    recording.disconnect()


def import_rerun() -> Any:
    """The rerun package, or an `InputError` that says how to get it."""
    try:
        import rerun
    except ImportError as fault:
        raise InputError("recordings need rerun: pip install 'rerun-sdk>=0.41,<0.42'") from fault
    return rerun


def log_terrain(recording: Any, terrain: Terrain) -> None:
    """The terrain as `world/terrain`, coloured by zone."""
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
    """All trajectories as `world/trajectories`, cut where the speed changes colour."""
    rr = import_rerun()
    fastest = float(samples.speed.max(initial=0.0))
    strips, speed = strips_by_speed(samples, fastest)
    colours = speed_colours(speed, fastest)
    recording.log("world/trajectories", rr.LineStrips3D(strips, colors=colours, radii=[-0.7]), static=True)


def log_ends(recording: Any, deposits: Deposits) -> None:
    """Releases as `world/releases`, ends as `world/ends` coloured by outcome."""
    rr = import_rerun()
    colours = np.array([OUTCOME_COLOURS[outcome] for outcome in Outcome], dtype=np.uint8)[deposits.outcome]
    recording.log("world/ends", rr.Points3D(deposits.x, colors=colours, radii=[-DEPOSIT_PIXELS]), static=True)
    releases = rr.Points3D(deposits.release, colors=[(20, 20, 20)], radii=[-DEPOSIT_PIXELS / 2])
    recording.log("world/releases", releases, static=True)


def log_moving_rocks(recording: Any, flights: Flights, rows: IntArray, gravity: float) -> None:
    """Rocks of rows (N,) as `world/rocks`, at FRAMES moments of simulated time."""
    if len(rows) == 0:
        return
    rr = import_rerun()
    times = np.linspace(0.0, float(flights.deposits.t[rows].max()), FRAMES)
    positions = np.stack([positions_at(flights.paths, int(row), times, gravity) for row in rows], axis=1)
    recording.log("world/rocks", rr.Points3D.from_fields(colors=[ROCK_COLOUR], radii=[-ROCK_PIXELS]), static=True)
    columns = rr.Points3D.columns(positions=positions.reshape(-1, 3)).partition([len(rows)] * len(times))
    recording.send_columns("world/rocks", [rr.TimeColumn(TIMELINE, duration=times)], columns)


def log_series(recording: Any, names: Sequence[str], flights: Flights, gravity: float) -> None:
    """Speed (m/s) and translational kinetic energy (J) of some rocks as `speed/...` and `energy/...`."""
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
    """What was simulated: lines of the log at time 0, and the scene file and the summary as a document."""
    rr = import_rerun()
    lines = scene_lines(scene, terrain, summary)
    levels = [rr.TextLogLevel.INFO] * len(lines)
    _send(recording, "log/scene", np.zeros(len(lines)), rr.TextLog.columns(text=lines, level=levels))
    text = document(scene, lines, summary)
    recording.log("document", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def _sentences(summary: Mapping[str, Any]) -> dict[Outcome, str]:
    """The sentence of each outcome: the one of the summary, where it has one."""
    told = {name: entry["sentence"] for name, entry in summary.get("outcomes", {}).items() if "sentence" in entry}
    return OUTCOME_SENTENCES | {Outcome[name.upper()]: sentence for name, sentence in told.items()}


def log_outcomes(
    recording: Any, names: Sequence[str], terrain: Terrain, deposits: Deposits, sentences: Mapping[Outcome, str]
) -> None:
    """A line of the log for each rock, at the time of its end: outcome, sentence, zone and figures."""
    rr = import_rerun()
    order = np.argsort(deposits.t[:LOGGED_ROCKS], kind="stable")
    lines = [outcome_line(names, terrain, deposits, int(row), sentences) for row in order]
    levels = ["INFO" if deposits.outcome[row] in DEPOSITED else "WARN" for row in order]
    times = deposits.t[order]
    if len(deposits.t) > LOGGED_ROCKS:
        lines.append(f"{len(deposits.t) - LOGGED_ROCKS} more rocks are in deposits.csv only")
        levels, times = [*levels, "WARN"], np.append(times, times[-1])
    _send(recording, "log/rocks", times, rr.TextLog.columns(text=lines, level=levels))


def scene_lines(scene: RecordedScene, terrain: Terrain, summary: Mapping[str, Any]) -> list[str]:
    """Name, seed, terrain, frame, faults, materials and outcomes, a line each."""
    faults = summary.get("terrain", {}).get("faults", {})
    counted = ", ".join(f"{name} {value}" for name, value in faults.items() if isinstance(value, int) and value)
    outcomes = ", ".join(f"{name} {share['rocks']}" for name, share in summary.get("outcomes", {}).items())
    return [
        f"scene {scene.path.name}, seed {scene.seed}, method {scene.method.describe()}",
        f"terrain: {len(terrain.triangles)} triangles in the zones {', '.join(terrain.zones)}",
        frame_line(terrain.frame),
        *([f"mesh: {counted}"] if counted else []),
        *(f"material {name}: {material}" for name, material in scene.materials.items()),
        *([f"outcomes: {outcomes}"] if outcomes else []),
    ]


def frame_line(frame: Frame) -> str:
    """How to get from positions in the recording to the input's coordinates."""
    east, north, up = frame.origin
    turned = "" if frame.up == "z" else "; the input's y points up: its (x, y, z) is (x, z, -y) of the sum"
    return f"positions are local, z up; add the origin ({east:.10g}, {north:.10g}, {up:.10g}) m{turned}"


def outcome_line(
    names: Sequence[str], terrain: Terrain, deposits: Deposits, row: int, sentences: Mapping[Outcome, str]
) -> str:
    """One rock's outcome with its sentence, where, when and how fast."""
    outcome, facet = Outcome(deposits.outcome[row]), int(deposits.facet[row])
    where = f", last on {terrain.zones[terrain.zone[facet]]}" if facet >= 0 else ", never on the ground"
    return (
        f"{rock_name(names, deposits, row)}: {outcome.name.lower()}, {sentences[outcome]}{where}; "
        f"{deposits.t[row]:.1f} s, {deposits.path[row]:.1f} m, {deposits.impacts[row]} impacts, "
        f"fastest {deposits.max_speed[row]:.1f} m/s"
    )


def rock_name(names: Sequence[str], deposits: Deposits, row: int) -> str:
    """A rock as people call it."""
    return f"{names[deposits.source[row]]} {deposits.rock[row]}"


def document(scene: RecordedScene, lines: Sequence[str], summary: Mapping[str, Any]) -> str:
    """Markdown: the lines of the log, the scene file as it is, the summary."""
    parts = [f"# {scene.path.stem}", "\n".join(f"- {line}" for line in lines)]
    if scene.path.is_file():
        parts.append(f"## Scene\n```yaml\n{scene.path.read_text(encoding='utf-8')}\n```")
    if summary:
        parts.append(f"## Summary\n```json\n{json.dumps(summary, indent=2)}\n```")
    return "\n\n".join(parts)


def _send(recording: Any, entity: str, seconds: FloatArray, columns: Any) -> None:
    """Rows of an entity, all at once, at simulated times (N,) s."""
    recording.send_columns(entity, [import_rerun().TimeColumn(TIMELINE, duration=seconds)], columns)
