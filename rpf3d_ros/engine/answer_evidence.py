"""Convert an answer, or a missing answer, to the evidence for a decision."""

from dataclasses import dataclass

from rpf3d_core.alerts.evidence import Evidence, areas_of, unfinished_of, untouched
from rpf3d_core.live.answers import Answer
from rpf3d_core.live.standing import PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.configuration import version


@dataclass(frozen=True, eq=False)
class EvidenceContext:
    """What the evidence of an answer contains besides the answer: terrain, time and seed.

    standing : the prepared terrain in use, or None; lost_patches : number of patches that this terrain lacks
    at_ns : time of the answer (ns); seed : random seed of the scene
    """

    standing: PreparedTerrain | None
    lost_patches: int
    at_ns: int
    seed: int


def evidence_of_answer(answer: Answer, context: EvidenceContext) -> Evidence:
    """Return the evidence of an answer, for the alert decision; left-out sources and missing patches are faults."""
    faults = (answer.left_out,) if answer.left_out else ()
    if lost := context.lost_patches:
        faults = (*faults, f"{lost} patches are not in the terrain: the whole terrain must be published")
    without_sources = evidence_without_answer(answer.trigger, "", context)._replace(
        result=answer.result, stage=answer.stage, faults=faults, areas=untouched(answer.maps.area_names)
    )
    if not answer.sources:
        return without_sources
    unfinished = unfinished_of(answer.outcomes)
    return without_sources._replace(sources=answer.sources, unfinished=unfinished, areas=areas_of(answer.maps))


def evidence_without_answer(trigger: Trigger, fault: str, context: EvidenceContext) -> Evidence:
    """Return the evidence for sources that got no answer, for the alert decision.

    fault : reason for the missing answer, "" for no fault
    """
    ground = None if context.standing is None else context.standing.ground
    return Evidence(
        result=0, stage=0, at_ns=context.at_ns, trigger_stamp_ns=trigger.stamp_ns,
        terrain_stamp_ns=0 if ground is None else ground.stamp_ns,
        terrain_digest="" if ground is None else ground.digest,
        sources_digest=trigger.digest, sources=len(trigger.positions), seed=context.seed,
        version=version(), areas=(), faults=(fault,) if fault else (),
    )  # fmt: skip
