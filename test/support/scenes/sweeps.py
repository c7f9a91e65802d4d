"""Make scenes of benches for tests of sweeps, and count the cells that a sweep flies."""

import csv
import json
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import rpf3d_core as rpf3d

BERM, ANGLE = "terrain.benches.berm", "terrain.benches.face_angle_deg"
SCENE = """\
terrain: {benches: {number: 2, height: 10, berm: 4, floor: 60, width: 80}}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}
sources: [{name: top, crest: 1, above_ground: 0.5, rocks: 60, velocity: [2, 0, 0]}]
areas_of_interest: [{name: road, polygons: road.geojson}]
engine: reference
"""
UNKNOWN = SCENE.replace("normal_restitution: 0.4", "normal_restitution: {prior: {min: 0.2, max: 0.6}}")
FENCE = "effects: {barriers: {panels: [{name: fence, along: [[14, -40], [14, 40]], height: 1, capacity_kj: 5000}]}}\n"


def road(low: float, high: float) -> str:
    ring = [[low, -40], [high, -40], [high, 40], [low, 40], [low, -40]]
    return json.dumps({"type": "Polygon", "coordinates": [ring]})


class Here(Executor):
    """An executor that flies each cell at once in this process.

    flown : number of cells flown; ends : number of cells after which `submit` raises KeyboardInterrupt, None for never
    """

    def __init__(self, ends: int | None = None) -> None:
        self.flown, self.ends = 0, ends

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        if self.flown == self.ends:
            raise KeyboardInterrupt
        self.flown += 1
        try:
            future.set_result(fn(*args, **kwargs))
        except rpf3d.InputError as fault:
            future.set_exception(fault)
        return future


def written(folder: Path, text: str) -> Path:
    (folder / "scene.yaml").write_text(text)
    return folder / "scene.yaml"


def table(scene: Path) -> list[dict[str, str]]:
    with (scene.parent / "out" / "sweep.csv").open(newline="") as file:
        return list(csv.DictReader(file))
