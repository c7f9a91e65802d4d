"""What the outcome of a rock means in a scene: the sentence of `values`, or that of the scene's ground model."""

from rpf3d_core.scene.model import Scene
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome


def sentence_of(outcome: Outcome, scene: Scene) -> str:
    """The sentence that tables and files show for an outcome; ground models that ignore friction have their own."""
    stopped = scene.ground.offer.STOPPED
    return stopped if outcome == Outcome.STOPPED and stopped is not None else OUTCOME_SENTENCES[outcome]
