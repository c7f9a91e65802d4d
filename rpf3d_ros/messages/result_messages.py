"""What a result is, beside what is drawn of it: diagnostic_msgs/DiagnosticArray on `results`, one status."""

from collections.abc import Mapping
from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Header

from rpf3d_ros.messages.diagnostic_messages import diagnostics_of
from rpf3d_ros.messages.health import OK, WARN, Health, healths_of
from rpf3d_ros.messages.refusals import MessageRefused

NAME = "rpf3d: result"


@dataclass(frozen=True)
class ResultFacts:
    """One answer in figures.

    result : its number; stage : from 0, each with more rocks than the one before; complete : whether none will follow
    rocks, sources : flown, released; outcomes : how many rocks ended how; seconds : since its trigger was taken up
    terrain_digest, sources_digest : sha256, hex; warning : a sentence where the answer is not all that was asked for
    """

    result: int
    stage: int
    complete: bool
    rocks: int
    sources: int
    seed: int
    seconds: float
    terrain_digest: str
    sources_digest: str
    outcomes: Mapping[str, int]
    warning: str = ""


WHOLE = ("result", "stage", "rocks", "sources", "seed")
"""Keys of whole numbers."""
OUTCOME = "outcome."
"""What the keys of outcomes begin with."""
COMPLETE = {"true": True, "false": False}


def results_message(header: Header, facts: ResultFacts) -> DiagnosticArray:
    """The message that is published last of a result, when all else of it has been."""
    done = "complete" if facts.complete else "to be refined"
    said = f"result {facts.result}: {facts.rocks} rocks from {facts.sources} sources, {done}"
    values = {
        **{name: str(getattr(facts, name)) for name in WHOLE},
        "complete": str(facts.complete).lower(),
        "seconds": f"{facts.seconds:.6f}",
        "terrain_digest": facts.terrain_digest,
        "sources_digest": facts.sources_digest,
        "warning": facts.warning,
        **{OUTCOME + name: str(count) for name, count in facts.outcomes.items()},
    }
    sentence = f"{said}; {facts.warning}" if facts.warning else said
    message = diagnostics_of(header.stamp, [Health(NAME, WARN if facts.warning else OK, sentence, values)])
    message.header.frame_id = header.frame_id
    return message


def facts_of(message: DiagnosticArray) -> ResultFacts:
    """The facts in a received message. Raises MessageRefused where it holds none, or damaged ones."""
    values = next((health.values for health in healths_of(message) if health.name == NAME), None)
    if values is None:
        raise MessageRefused(f"the message holds no status '{NAME}'")
    try:
        return ResultFacts(
            **{name: int(values[name]) for name in WHOLE},
            complete=COMPLETE[values["complete"]],
            seconds=float(values["seconds"]),
            terrain_digest=values["terrain_digest"],
            sources_digest=values["sources_digest"],
            warning=values["warning"],
            outcomes={
                name.removeprefix(OUTCOME): int(count) for name, count in values.items() if name.startswith(OUTCOME)
            },
        )
    except (KeyError, ValueError) as fault:
        raise MessageRefused(f"the status '{NAME}' is damaged: {fault!r}") from None
