"""The models and effects that a scene names, made ready for the kernels; nothing else of them is imported."""

from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.io.scene_models import GroundSpec, ReboundSpec
from rpf3d_core.io.scene_offers import Offer, loaded
from rpf3d_core.simulation.engines import Models
from rpf3d_core.terrain.facets import Terrain


def models_of(scene: Scene, terrain: Terrain) -> Models:
    """The models of a scene over its terrain.

    Raises
    ------
    InputError
        One of them cannot be built there: names the key.
    """
    rebound, ground = (_built(spec.offer, scene, terrain) for spec in (scene.rebound, scene.ground))
    effects = [_built(offer, scene, terrain) for offer in scene.effects.named.values()]
    return Models(rebound, ground, chain_of(effects))


def models_called(rebound: str, ground: str) -> Models:
    """Models by name, with all their defaults and no effects; for those that need nothing of a scene."""
    bouncing, resting = ReboundSpec.model_validate({rebound: {}}), GroundSpec.model_validate({ground: {}})
    return Models(_copied(bouncing.offer), _copied(resting.offer))


def _built(offer: Offer, scene: Scene, terrain: Terrain) -> object:
    """The parameters of one model or effect, as the class that its rules are registered for."""
    if offer.BUILDER is not None:
        return loaded(offer.BUILDER)(offer, scene, terrain)
    return _copied(offer)


def _copied(offer: Offer) -> object:
    """Parameters that are what the scene says, number by number."""
    return offer.physics()(**{name: getattr(offer, name) for name in type(offer).model_fields})
