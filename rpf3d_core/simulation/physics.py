"""The models, ground properties and settings that all rocks of an ensemble share, as one value for the flight loop."""

from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.library import Surface, surface_of
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.simulation.state import State
from rpf3d_core.terrain.facets import Facets


class Physics(NamedTuple):
    """The models, ground properties and settings of a simulation, in one record that compiled code can read.

    rebound, ground : parameters of a rebound model and of a ground model; effects : a `Chain`, None without effects
    materials : surface properties of the zones, as in `materials.library.surface_of`; facets : the terrain
    caps : a `CapLocator` over the gaps of the terrain; None if no caps are needed
    pieces : `TerrainPieces`, for a terrain whose separate parts may pass through each other; None if no search for
        other parts is needed
    """

    rebound: Any
    ground: Any
    effects: Any
    facets: Facets
    materials: Any
    settings: Settings
    caps: Any = None
    pieces: Any = None


@kernel
def rock_at(rock: RockContext, state: State) -> RockContext:
    """Return the rock's data for the models, with its number of impacts so far, which selects random numbers."""
    return RockContext(rock=rock.rock, key=rock.key, impacts=state.tally.impacts)


@kernel
def ground_of(physics: Physics, facet: int, rock: RockContext, state: State) -> Surface:
    """Return the surface properties of a facet for this rock at its next impact; varying properties are drawn here."""
    return surface_of(physics.materials, physics.facets.zone[facet], rock_at(rock, state))  # type: ignore[no-any-return]
