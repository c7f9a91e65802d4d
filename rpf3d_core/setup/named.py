"""Build the models and effects that a scene names; no other model or effect is imported."""

from typing import Any

from rpf3d_core.effects.hooks import FOR_POINTS, HOOKS, breaks, chain_of, links_of
from rpf3d_core.errors import InputError
from rpf3d_core.kinetics.rebound import rebound
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.spec import ModelSpec, loaded
from rpf3d_core.simulation.engines import Models
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.obstacles import Obstacles, all_of


def models_of(scene: Scene, terrain: Terrain) -> Models:
    """Return the models and effects of a scene in the form that the flight loops read.

    Raises
    ------
    InputError
        A model or effect cannot be built, has no rule, or has a rule that it may not have (see `_check_hooks`). The
        message names the key or the file.
    """
    model = _built(scene.impact_model.model_spec, scene, terrain)
    effects = numbered([_built(model_spec, scene, terrain) for model_spec in scene.effects.named.values()])
    _check_hooks(scene, effects)
    if scene.rock.is_body:
        return Models(rebound=model, ground=None, effects=chain_of(effects))
    ground = _built(scene.ground.model_spec, scene, terrain)
    if not rebound.has_rule(type(model)):
        raise InputError(f"{scene.path}: `rebound` names {type(model).__name__}, which has no rule; its file must have "
                         f"a function decorated with @rebound.rule({type(model).__name__})")  # fmt: skip
    return Models(rebound=model, ground=ground, effects=chain_of(effects))


def _check_hooks(scene: Scene, effects: list[Any]) -> None:
    """Raise an InputError for an effect without any rule, or with a rule for a hook that the effect cannot use.

    Only `fragmentation` can use the hook `breaks`. Rocks with a shape do not have the hooks FOR_POINTS.
    """
    for effect in effects:
        name = type(effect).__name__
        if not any(hook.has_rule(type(effect)) for hook in HOOKS):
            raise InputError(f"{scene.path}: `effects` names {name}, which has no rule; its file must have a function "
                             f"decorated as @felt_normal.rule({name}) is, for one of the hooks "
                             f"{', '.join(hook.__name__ for hook in HOOKS if hook is not breaks)}")  # fmt: skip
        if breaks.has_rule(type(effect)) and not _is_fragmentation(effect):
            raise InputError(f"{scene.path}: `effects` names {name}, which has a rule for breaks; only the effect "
                             "`fragmentation` may break rocks, so remove the rule")  # fmt: skip
        for hook in FOR_POINTS:
            if scene.rock.is_body and hook.has_rule(type(effect)):
                raise InputError(f"{scene.path}: `effects` names {name}, which has a rule for {hook.__name__}; rocks "
                                 "with a shape have no such hook, so remove it, or `rock.shape`")  # fmt: skip


def _is_fragmentation(effect: object) -> bool:
    """Return True for the effect `fragmentation`; its module is imported only for a scene whose rocks may break."""
    from rpf3d_core.effects.fragmentation import Fragmentation

    return isinstance(effect, Fragmentation)


def numbered(effects: list[Any]) -> list[Any]:
    """Return the effects with obstacle numbers assigned: all trees and barriers are numbered in one sequence.

    In an effect with obstacles, the field `first` is the number of the first obstacle. The field `obstacles` states how
    many obstacles the effect has.
    """
    known, first = [], 0
    for effect in effects:
        if hasattr(effect, "first"):
            effect, first = effect._replace(first=first), first + effect.obstacles
        known.append(effect)
    return known


def obstacles_of(scene: Scene, models: Models) -> Obstacles:
    """Return the names and places of all obstacles of a scene, in the order of the obstacle numbers."""
    named = zip(scene.effects.named.items(), links_of(models.effects), strict=True)
    return all_of([
        loaded(model_spec.OBSTACLES)(name, model_spec, effect)
        for (name, model_spec), effect in named
        if model_spec.OBSTACLES is not None
    ])  # fmt: skip


def _built(model_spec: ModelSpec, scene: Scene, terrain: Terrain) -> object:
    """Return a model or effect as an object of its physics class, whose rules the flight loops call."""
    if model_spec.BUILDER is not None:
        return loaded(model_spec.BUILDER)(model_spec, scene, terrain)
    return model_spec.made()
