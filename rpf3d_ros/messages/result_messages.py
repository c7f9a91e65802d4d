"""Convert the figures of an answer to a diagnostic_msgs/DiagnosticArray with one status for `results`, and back."""

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
    """The figures of one stage of an answer, as published on `results`.

    result : number of this result; each stage of an answer has its own number
    stage : counted from 0; each stage has more rocks than the previous stage
    complete : True if no further stage follows
    rocks, sources : numbers of rocks flown and of sources that released rocks; outcomes : outcome -> number of rocks
    seed : random seed of the scene
    seconds : time (s) since the processing of the trigger began
    terrain_digest, sources_digest : sha256, hex
    warning : the warnings about the answer, such as refused sources, joined by semicolons; "" if there are none
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
"""Keys of a `results` message with whole numbers."""
OUTCOME = "outcome."
"""Prefix of the keys of a `results` message with numbers of rocks by outcome."""
COMPLETE = {"true": True, "false": False}


def results_message(header: Header, facts: ResultFacts) -> DiagnosticArray:
    """Return the message for `results`, which the simulator publishes after all other messages of an answer."""
    done = "complete" if facts.complete else "to be refined"
    summary = f"result {facts.result}: {facts.rocks} rocks from {facts.sources} sources, {done}"
    values = {
        **{name: str(getattr(facts, name)) for name in WHOLE},
        "complete": str(facts.complete).lower(),
        "seconds": f"{facts.seconds:.6f}",
        "terrain_digest": facts.terrain_digest,
        "sources_digest": facts.sources_digest,
        "warning": facts.warning,
        **{OUTCOME + name: str(count) for name, count in facts.outcomes.items()},
    }
    sentence = f"{summary}; {facts.warning}" if facts.warning else summary
    message = diagnostics_of(
        header.stamp, [Health(name=NAME, level=WARN if facts.warning else OK, message=sentence, values=values)]
    )
    message.header.frame_id = header.frame_id
    return message


def facts_of(message: DiagnosticArray) -> ResultFacts:
    """Return the figures of an answer from a received `results` message.

    Raises MessageRefused if the status is missing or damaged.
    """
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
