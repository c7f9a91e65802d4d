"""Sentences that explain the outcome of a rock: those of `values`, or of the scene's ground model."""

from rpf3d_core.scene.model import Scene
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome


def sentence_of(outcome: Outcome, scene: Scene) -> str:
    """Return the sentence that tables and files show for an outcome.

    A ground model may have its own sentence for STOPPED, for example if it ignores friction.
    """
    stopped = scene.ground.model_spec.STOPPED
    return stopped if outcome == Outcome.STOPPED and stopped is not None else OUTCOME_SENTENCES[outcome]
