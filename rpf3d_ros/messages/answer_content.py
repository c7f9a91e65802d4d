"""Collect the published content of an answer: positions of rocks as columns, figures and warnings for diagnostics.

The module needs no message class of ROS.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.alerts.evidence import UNFINISHED
from rpf3d_core.ensemble.flights import Deposits, FloatArray, Impacts, on_ground
from rpf3d_core.ensemble.paths import PathSamples, sample_paths
from rpf3d_core.live.answers import Answer
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import DEPOSITED, OUTCOME_SENTENCES

Columns = Mapping[str, NDArray[Any]]
"""Columns of a point cloud: name -> (N,) values.

x, y, z are in m, t in s, speed in m/s, energy in J; rocks are counted from 0.
"""


class AnswerContent(NamedTuple):
    """Paths, impacts and deposits of the displayed rocks of an answer, as columns in the map frame.

    The units are m (x, y, z, runout), s after the release (t), m/s (speed) and J (energy); `rock` is the rock's number.

    trajectories : x, y, z, t, rock, speed, energy; grouped by rock, in order of time
    impacts : x, y, z, t, rock, speed, energy; only impacts on the ground; speed and energy just before each impact
    deposits : x, y, z, t, rock, runout, speed, energy; one row for each rock that stopped or was caught on the terrain,
        with the greatest speed and energy of its path

    Each group of columns also has `result`: the number of the result, different for each stage of an answer.
    """

    trajectories: Columns
    impacts: Columns
    deposits: Columns


def content_of(answer: Answer, step: float) -> AnswerContent:
    """Return paths, impacts and deposits of the displayed rocks (`answer.flights`), as columns for the messages.

    step : longest distance (m) between two successive points of a path
    """
    terrain, flights = answer.standing.ground.terrain, answer.flights
    samples = sample_paths(flights.paths, max_step=step, gravity=answer.standing.scene.gravity)
    columns = {
        "trajectories": _trajectory_columns(terrain, samples, flights.deposits),
        "impacts": _impact_columns(terrain, flights.impacts, flights.deposits),
        "deposits": _deposit_columns(terrain, flights.deposits),
    }
    return AnswerContent(**{name: _with_result(each, answer.result) for name, each in columns.items()})


def figures_of(answer: Answer) -> dict[str, str]:
    """Return the figures of an answer for its diagnostic status, as text: engine, counts and seconds."""
    outcomes = {outcome.name.lower(): count for outcome, count in answer.outcomes.items()}
    counts = {
        "result": answer.result,
        "stage": answer.stage,
        "triangles": len(answer.standing.ground.terrain.triangles),
        "sources": answer.sources,
        "rocks": answer.rocks,
        **outcomes,
    }
    whole = {name: str(count) for name, count in counts.items()}
    return {"engine": answer.flights.engine, **whole, "seconds": f"{answer.seconds:.3f}"}


def warnings_of(answer: Answer) -> tuple[str, ...]:
    """Return the warnings of an answer, one sentence each.

    The warnings name refused and doubtful sources, sources far from where the scene was calibrated, and the number of
    rocks with each outcome that cuts a path off (`alerts.evidence.UNFINISHED`).
    """
    counts = {outcome: answer.outcomes.get(outcome, 0) for outcome in UNFINISHED}
    left_out = (f"sources refused: {answer.left_out}",) if answer.left_out else ()
    left_out += tuple(sentence for sentence in (answer.doubtful, answer.elsewhere) if sentence)
    return left_out + tuple(f"rocks: {n}, each {OUTCOME_SENTENCES[outcome]}" for outcome, n in counts.items() if n)


def _with_result(columns: Columns, result: int) -> Columns:
    return {**columns, "result": np.full(len(columns["x"]), result, np.uint32)}


def _trajectory_columns(terrain: Terrain, samples: PathSamples, deposits: Deposits) -> Columns:
    energy = 0.5 * deposits.mass[samples.row] * samples.speed**2
    row = {"t": samples.t, "rock": samples.row, "speed": samples.speed, "energy": energy}
    return {**_position_columns(terrain, samples.x), **row}


def _impact_columns(terrain: Terrain, flown: Impacts, deposits: Deposits) -> Columns:
    impacts = on_ground(flown)
    energy = 0.5 * deposits.mass[impacts.row] * impacts.speed_in**2
    row = {"t": impacts.t, "rock": impacts.row, "speed": impacts.speed_in, "energy": energy}
    return {**_position_columns(terrain, impacts.x), **row}


def _deposit_columns(terrain: Terrain, deposits: Deposits) -> Columns:
    lying = np.flatnonzero(np.isin(deposits.outcome, DEPOSITED))
    runout = np.linalg.norm((deposits.x - deposits.release)[lying, :2], axis=1)
    row = {"t": deposits.t, "runout": runout, "speed": deposits.max_speed, "energy": deposits.max_energy}
    kept = {name: column if name == "runout" else column[lying] for name, column in row.items()}
    return {**_position_columns(terrain, deposits.x[lying]), "rock": lying, **kept}


def _position_columns(terrain: Terrain, x: FloatArray) -> dict[str, FloatArray]:
    points = terrain.frame.points_to_input(x)
    return {name: points[:, i] for i, name in enumerate("xyz")}
