"""Find models and effects that a scene seems to need but does not name, and named effects that change nothing.

The check uses the flights of a few rocks and the files in the folder of the scene.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rpf3d_core.effects.hooks import chain_of, links_of
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.values import Outcome

TREES = ("nrtrees", "dbhmean", "dbhstd", "conif_percent", "treefile")
"""Names of files about trees in an input folder of Rockyfor3D, which suggest that the scene needs a forest."""


def effects_called_for(scene: Scene, flown: Flights) -> Iterator[str]:
    """Yield a warning for a ground model or an effect that a scene seems to need but does not name, such as a forest.

    flown : flights of a few rocks of the scene
    """
    unresolved = int((flown.deposits.outcome == Outcome.UNRESOLVED_CONTACT).sum())
    if unresolved and scene.ground_model.name == "none":
        yield (
            f"{unresolved} of {len(flown.deposits.outcome)} pilot rocks ended unresolved_contact: "
            f"name `ground: {_carrying_on(scene)}`, or raise stop_speed"
        )
    if "forest" in type(scene.effects).model_fields and "forest" not in scene.effects.named:
        found = sorted({path.name for name in TREES for path in scene.path.parent.glob(f"{name}.*")})
        if found:
            yield f"the folder of the scene has {', '.join(found)}, but `effects` names no forest"


def _carrying_on(scene: Scene) -> str:
    """Return the ground model to suggest for a scene without a ground model, so that rocks move on after bouncing.

    The result is `sliding`, or the first ground model that may be combined with the scene's model of impacts.
    """
    grounds = scene.impact_model.model_spec.GROUNDS
    return "sliding" if grounds is None else next(name for name in grounds if name != "none")


def idle_effects(prepared: Prepared, releases: Releases, flown: Flights) -> Iterator[str]:
    """Yield a warning for each effect that changes the flight of no pilot rock.

    To find these effects, the pilot rocks fly again several times, each time without one effect of the scene.

    releases, flown : releases of the pilot rocks, and their flights with all effects of the scene
    """
    names, effects = list(prepared.scene.effects.named), links_of(prepared.flight.models.effects)
    for k, name in enumerate(names):
        without = _with_only(prepared.flight, effects[:k] + effects[k + 1 :])
        if _same(fly_ensemble(prepared.engine, without, releases), flown):
            yield f"`effects.{name}` acted on none of the {len(releases.x)} pilot rocks"


def _with_only(flight: Flight, effects: list[object]) -> Flight:
    """Return a copy of the flight settings in which only the given effects act."""
    return replace(flight, models=flight.models._replace(effects=chain_of(effects)))


def _same(one: Flights, other: Flights) -> bool:
    """Return True if the rocks have the same impact points and end points in both flights, to the last bit."""
    pairs = ((one.deposits.x, other.deposits.x), (one.impacts.x, other.impacts.x))
    return all(a.shape == b.shape and np.array_equal(a, b) for a, b in pairs)
