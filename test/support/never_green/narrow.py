"""Rare defects for testing guards that matter only in these cases; the campaign itself does not draw these defects."""

from collections.abc import Callable
from functools import partial

import numpy as np
from never_green import changes
from never_green.changes import Change
from never_green.defects import PATCH, WHOLE, Defect, changing, harmed
from never_green.messages import lengthened
from never_green.plan import END, Plan, Send, Speaker
from never_green.stories import EVERY, patch_send, survey


def of_the_only_sensor(word: str, change_of: Callable[[np.random.Generator], Change]) -> Defect:
    """Return a defect that changes all messages of the only sensor that sees the plan's last source.

    word : name of the defect; change_of : draws the change
    """

    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        topics = plan.truth.sources[-1].seen_by if plan.truth.sources else ()
        if len(topics) != 1 or topics[0] not in plan.sensors or plan.expects:
            return None
        return harmed(plan, f"{word}: {topics[0]}", lambda send: send.topic == topics[0], change_of(rng))

    return defect


never_understood = of_the_only_sensor("never understood", changes.framed)
never_released = of_the_only_sensor("never released", changes.upside_down)


def never_published(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the only sensor that sees the last source never publish; the node's parameters expect all sensors."""
    harmed_plan = never_understood(plan._replace(expects=False), rng)
    if harmed_plan is None:
        return None
    topic = harmed_plan.defects[-1].partition(": ")[2]
    sends = tuple(send for send in plan.sends if send.topic != topic)
    return plan.with_defect(f"never published: {topic}", sends=sends, expects=True)


def connected_and_mute(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the only sensor that sees the last source be connected but never publish; no sensor is expected."""
    harmed_plan = never_published(plan, rng)
    if harmed_plan is None:
        return None
    topic = harmed_plan.defects[-1].partition(": ")[2]
    return plan.with_defect(f"connected and mute: {topic}", sends=harmed_plan.sends, expects=False)


def alternately_understood(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the only sensor that sees the last source publish in an unknown frame, in alternation with a second program.

    The second program publishes messages without sources on the same topic.
    """
    harmed_plan = never_understood(plan, rng)
    if harmed_plan is None:
        return None
    topic = harmed_plan.defects[-1].partition(": ")[2]
    none, times = np.empty((0, 3)), np.arange(1.3, END, EVERY).tolist()
    own = next(send for send in plan.sends if send.topic == topic)
    more = tuple(own._replace(sent=at, at=at, places=none, publisher=1) for at in times)
    second = Speaker(topic=topic, number=1)
    return harmed_plan._replace(sends=(*harmed_plan.sends, *more), speakers=(*plan.speakers, second))


def one_misplaced(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Put the plan's last source under the ground in each message that reports it together with other sources."""
    dangerous = plan.truth.sources[-1:]
    topics = [topic for source in dangerous for topic in source.seen_by if topic in plan.sensors]

    def change(send: Send) -> Send:
        places = send.places.copy()
        places[-1] *= changes.AXES[2]
        return send._replace(places=places)

    return harmed(plan, "one misplaced", lambda send: send.topic in topics and len(send.places) > 1, change)


def change_not_understood(by_patch: bool) -> Defect:
    """Return a defect in which the surveys that show the removal of the bank are in an unknown frame.

    by_patch : True if one patch shows the removal, False if all later whole surveys show it
    """

    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        gone = plan.truth.bank_until
        whole = next((send for send in plan.sends if send.topic == "terrain/points"), None)
        if np.isinf(gone) or whole is None:
            return None
        sends = [send for send in plan.sends if send.topic not in (*WHOLE, *PATCH) or send.sent < gone]
        if by_patch:
            sends.append(patch_send(plan.truth, gone + 0.1, ((32.0, 48.0), (40.0, 72.0)))._replace(frame="drone"))
        else:
            sends += [whole._replace(sent=at, at=at, frame="drone") for at in np.arange(gone + 0.1, END, 6.0).tolist()]
        speakers = (*plan.speakers, *((Speaker(topic=PATCH[0], number=0),) if by_patch else ()))
        return plan.with_defect("change not understood", sends=tuple(sends), speakers=speakers)

    return defect


def mesh_after_the_patch(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let a patch show that the bank is removed, and then publish the old mesh with the bank again and again."""
    gone = plan.truth.bank_until
    if np.isinf(gone):
        return None
    patch = patch_send(plan.truth, gone + 0.1, ((32.0, 48.0), (40.0, 72.0)))
    sends = (_mesh(plan, 0.1), *_old_meshes(plan, gone + 0.6), patch)
    return _with_terrain(plan, "mesh after the patch", sends)


def same_mesh_in_other_bytes(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let a patch show that the bank is removed; then publish the old mesh again and again, each time in other bytes.

    Only the number of bytes after the vertices differs, which have no meaning.
    """
    harmed_plan = mesh_after_the_patch(plan, rng)
    if harmed_plan is None:
        return None
    sends = tuple(
        send._replace(damage=partial(lengthened, count=number)) if send.kind == "mesh" else send
        for number, send in enumerate(harmed_plan.sends)
    )
    return plan.with_defect("same mesh in other bytes", sends=sends, speakers=harmed_plan.speakers)


def former_mesh_again(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let a new mesh show that the bank is removed, and then publish the old mesh with the bank again and again."""
    gone = plan.truth.bank_until
    if np.isinf(gone):
        return None
    sends = (_mesh(plan, 0.1), _mesh(plan, gone + 0.1), *_old_meshes(plan, gone + 3.0))
    return _with_terrain(plan, "former mesh again", sends)


def _mesh(plan: Plan, at: float) -> Send:
    return Send(sent=at, at=at, topic=WHOLE[1], kind="mesh", places=survey(plan.truth, at))


def _old_meshes(plan: Plan, since: float) -> list[Send]:
    """Return messages with the first mesh of `_mesh(plan, 0.1)` that are published every 1.5 s from `since` (s) on."""
    return [_mesh(plan, 0.1)._replace(sent=at, at=at) for at in np.arange(since, END, 1.5).tolist()]


def _with_terrain(plan: Plan, name: str, sends: tuple[Send, ...]) -> Plan:
    """Return the plan with other terrain messages, and one publisher for each of their topics; name : of the defect."""
    others = [send for send in plan.sends if send.topic not in (*WHOLE, *PATCH)]
    own = [speaker for speaker in plan.speakers if speaker.topic not in (*WHOLE, *PATCH)]
    speakers = (*own, *(Speaker(topic=topic, number=0) for topic in dict.fromkeys(send.topic for send in sends)))
    return plan.with_defect(name, sends=(*others, *sends), speakers=speakers)


NARROW: dict[str, Defect] = {
    "never understood": never_understood,
    "never released": never_released,
    "never published": never_published,
    "connected and mute": connected_and_mute,
    "survey not understood": change_not_understood(by_patch=False),
    "patch not understood": change_not_understood(by_patch=True),
    "mirrored survey": changing("mirrored", WHOLE, changes.mirrored_heights),
    "alternately understood": alternately_understood,
    "one misplaced": one_misplaced,
    "mesh after the patch": mesh_after_the_patch,
    "same mesh in other bytes": same_mesh_in_other_bytes,
    "former mesh again": former_mesh_again,
    "no data as a height": changing("no data as a height", WHOLE[:1], changes.no_data),
    "folded survey": changing("folded survey", WHOLE[:1], changes.folded),
}
"""Name of each rare defect -> the defect."""
