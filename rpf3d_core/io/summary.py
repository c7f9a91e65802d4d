"""summary.json: what was simulated, with what, how long it took, and what came of it.

Keys carry their units; every share has its 95 % Wilson interval; a value that does not exist is null.
"""

import importlib.metadata
import platform
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import Deposits, Flights
from rpf3d_core.ensemble.statistics import percentiles, share_of
from rpf3d_core.io.areas import REACHED_BY, area_shares, read_areas
from rpf3d_core.io.observed import compare
from rpf3d_core.io.scene import scene_digest
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.io.tables import runout, zones_of_facets
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.faults import FaultReport
from rpf3d_core.values import DEPOSITED, OUTCOME_SENTENCES, Outcome

PACKAGES = ("rpf3d", "numpy", "numba", "vtk", "pyarrow", "matplotlib", "shapely", "rerun-sdk")
"""Whose versions are recorded."""


def summary(
    scene: Scene, terrain: Terrain, faults: FaultReport, flights: Flights, timings: Mapping[str, float]
) -> dict[str, Any]:
    """Everything of a run that fits on a page, ready for JSON.

    Parameters
    ----------
    timings : name -> s
        Wall times that the caller took, such as `read_s` and `wall_s`; they are copied.

    Raises
    ------
    InputError
        If a file of `areas_of_interest` or `observed` is damaged.
    """
    facts = {
        "program": "rpf3d",
        "versions": versions(),
        "scene": {"file": scene.path.name, "digest": scene_digest(scene), **_settings(scene)},
        "terrain": _terrain(scene, terrain, faults),
        **_counts(flights),
        **_speed(flights, timings),
        **_distributions(scene, flights.deposits),
        "stopped_in_zones": stopped_in_zones(terrain, flights.deposits),
        "areas_of_interest": area_shares(terrain, flights, read_areas(scene)),
    }
    if scene.areas_of_interest:
        facts["areas_reached_by"] = REACHED_BY
    if scene.observed is not None:
        facts["observed"] = compare(scene.observed, terrain.frame, flights.deposits)
    return dict(plain(facts))


def versions() -> dict[str, str | None]:
    """Versions of Python and of the packages that shape the answer; null for one that is not installed."""
    return {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}}


def stopped_in_zones(terrain: Terrain, deposits: Deposits) -> dict[str, Any]:
    """Of all rocks, the share that came to rest in each zone."""
    at_rest = np.isin(deposits.outcome, DEPOSITED) & (deposits.facet >= 0)
    counts = np.bincount(zones_of_facets(terrain, deposits.facet)[at_rest], minlength=len(terrain.zones))
    return {zone: share_of(int(counts[i]), len(at_rest)) for i, zone in enumerate(terrain.zones)}


def plain(value: Any) -> Any:
    """A value for JSON: NumPy numbers as Python's, tuples as lists, what is not finite as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(item) for item in value]
    number = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(number, float) and not np.isfinite(number) else number


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _settings(scene: Scene) -> dict[str, Any]:
    """The choices that decide the answer, beside the materials."""
    names = ("seed", "rebound", "ground", "stop_speed", "gravity", "smallest_bounce", "max_time", "max_impacts")
    return {**{name: getattr(scene, name) for name in names}, "effects": list(scene.effects)}


def _terrain(scene: Scene, terrain: Terrain, faults: FaultReport) -> dict[str, Any]:
    return {
        "triangles": len(terrain.triangles),
        "vertices": len(terrain.vertices),
        "zones": list(terrain.zones),
        "up": terrain.frame.up,
        "local_origin_z_up": terrain.frame.origin,
        "crs": scene.terrain.crs,
        "faults": asdict(faults),
    }


def _counts(flights: Flights) -> dict[str, Any]:
    deposits = flights.deposits
    return {
        "engine": flights.engine,
        "rocks": len(deposits.rock),
        "outcomes": {
            outcome.name.lower(): {**share_of(count, len(deposits.rock)), "sentence": OUTCOME_SENTENCES[outcome]}
            for outcome in Outcome
            if (count := int((deposits.outcome == outcome).sum()))
        },
        "impacts": int(deposits.impacts.sum()),
        "path_m": float(deposits.path.sum()),
    }


def _speed(flights: Flights, timings: Mapping[str, float]) -> dict[str, Any]:
    """Wall times; rocks_per_s counts flying only: no reading, compiling or writing."""
    rate = len(flights.deposits.rock) / flights.fly_s if flights.fly_s > 0.0 else None
    return {**timings, "compile_s": flights.compile_s, "fly_s": flights.fly_s, "rocks_per_s": rate}


def _distributions(scene: Scene, deposits: Deposits) -> dict[str, Any]:
    at_rest = np.isin(deposits.outcome, DEPOSITED)
    return {
        "runout_m": {"of": "rocks at rest, horizontal", **percentiles(runout(deposits)[at_rest])},
        "max_speed_m_s": {"of": "all rocks", **percentiles(deposits.max_speed)},
        "max_energy_j": {"of": "all rocks, translational", **percentiles(deposits.max_energy)},
        "max_height_m": {"of": "all rocks, vertical above the terrain", **percentiles(deposits.max_height)},
        "entered_ground_at_speed_m_s": {
            "of": f"rocks whose bounces died out; ground model {scene.ground}",
            **percentiles(deposits.ground_speed),
        },
    }
