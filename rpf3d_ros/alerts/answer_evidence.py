"""Convert an answer, or a missing answer, to the evidence for a decision."""

from dataclasses import dataclass

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.live.answers import Answer
from rpf3d_core.live.standing import PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.alerts.version import version


@dataclass(frozen=True, eq=False)
class EvidenceContext:
    """The values of evidence that are not in an answer: terrain, time and seed.

    standing : the prepared terrain in use, None if there is none
    at_ns : time of the answer (ns); seed : random seed of the scene
    """

    standing: PreparedTerrain | None
    at_ns: int
    seed: int


def evidence_of_answer(answer: Answer, context: EvidenceContext) -> Evidence:
    """Return the evidence of an answer for the decision on the alert.

    Refused or doubtful sources are a fault of the evidence. Sources far from the place of the calibration are a note.
    """
    faults = tuple(sentence for sentence in (answer.left_out, answer.doubtful) if sentence)
    without_sources = evidence_without_answer(answer.trigger, "", context)._replace(
        result=answer.result, stage=answer.stage, faults=faults, areas=answer.evidence
    )
    if not answer.sources:
        return without_sources
    notes = (answer.elsewhere,) if answer.elsewhere else ()
    return without_sources._replace(sources=answer.sources, unfinished=answer.unfinished, notes=notes)


def evidence_without_answer(trigger: Trigger, fault: str, context: EvidenceContext) -> Evidence:
    """Return the evidence for sources that got no answer, for the decision on the alert; it has no areas.

    fault : reason for the missing answer, "" for no fault
    """
    ground = None if context.standing is None else context.standing.ground
    return Evidence(
        result=0, stage=0, at_ns=context.at_ns, trigger_stamp_ns=trigger.stamp_ns,
        terrain_stamp_ns=0 if ground is None else ground.whole_ns,
        terrain_digest="" if ground is None else ground.digest,
        sources_digest=trigger.digest, sources=len(trigger.positions), seed=context.seed,
        version=version(), areas=(), faults=(fault,) if fault else (),
    )  # fmt: skip
