"""Fly rigid spheres over test terrains, and compute their distances from the facets."""

import dataclasses

import numpy as np

from flights.scenes_of_facets import flight
from rpf3d_core.detection import vtk_swept
from rpf3d_core.detection.closest import distance_to_facet
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.kinetics.coulomb_sphere import MATERIALS_OWN, CoulombSphere
from rpf3d_core.kinetics.sphere_ground import SphereGround
from rpf3d_core.materials.library import Surface
from rpf3d_core.simulation import sphere
from rpf3d_core.simulation.engines import Engine, Models
from rpf3d_core.values import Mode

REGISTERED = (vtk_swept, sphere)
"""Modules that are imported because their import registers the contact rules of spheres."""
SPHERE = CoulombSphere(MATERIALS_OWN, 0.0)


def spheres(ground: Surface, model=SPHERE, on_ground=None, **settings: float) -> Flight:
    """Return materials, settings and models of flights of spheres over ground with one surface.

    model : rebound model; on_ground : ground model, None for `sphere`; settings : fields of `Settings`
    """
    physics = flight(ground, **settings)
    return dataclasses.replace(physics, models=Models(model, SphereGround() if on_ground is None else on_ground))


def roll(engine: Engine, physics: Flight, radius, x, v=(0.0, 0.0, 0.0), **how) -> Flights:
    """Fly spheres from positions x, (3,) or (R, 3) m, over ground with the first surface of `physics` in all zones.

    radius : m, of all spheres or (R,); v : velocity (3,) or (R, 3) m/s; how : further arguments of `fly_ensemble`
    """
    places = np.atleast_2d(np.array(x, dtype=float))
    rocks = np.arange(len(places))
    speeds = np.ascontiguousarray(np.broadcast_to(np.array(v, dtype=float), places.shape))
    ones = np.ones(len(places))
    zones = int(np.max(engine.facets.zone)) + 1
    columns = (np.repeat(column[:1], zones) for column in physics.materials)
    physics = dataclasses.replace(physics, materials=type(physics.materials)(*columns))
    return fly_ensemble(
        engine, physics, Releases(np.zeros_like(rocks), rocks, places, speeds, 1000.0 * ones, radius * ones), **how
    )


def clearance(engine: Engine, points: np.ndarray) -> np.ndarray:
    """Return the distance (N,) m of each of points (N, 3) m from the nearest facet, by a search over all facets."""
    facets = engine.facets
    return np.array(
        [min(distance_to_facet(facets, f, tuple(p)) for f in range(len(facets.zone))) for p in points.tolist()]
    )


def places_of(flights: Flights, samples: int = 3) -> np.ndarray:
    """Return points (N, 3) m on all paths: all events, and `samples` points inside each arc."""
    paths = flights.paths
    going = np.flatnonzero(paths.mode[:-1] == Mode.FLIGHT)
    t = np.linspace(0.0, 1.0, samples + 2)[1:-1, None, None] * (paths.t[going + 1] - paths.t[going])[:, None]
    arcs = paths.x[going] + paths.v[going] * t - 0.5 * t * t * np.array([0.0, 0.0, 9.81])
    return np.concatenate([paths.x, arcs.reshape(-1, 3)])
