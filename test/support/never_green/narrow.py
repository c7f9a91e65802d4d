"""Rare defects for testing guards that matter only in these cases; the campaign itself does not draw these defects."""

from collections.abc import Callable
from functools import partial

import numpy as np
from never_green import changes
from never_green.changes import Change
from never_green.defects import PATCH, WHOLE, Defect, again, areas_again, changing, harmed
from never_green.messages import lengthened
from never_green.plan import END, ClockRule, Plan, Send, Speaker
from never_green.stories import EVERY, patch_send, survey
from never_green.turns import scanning_by_turns


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
    """Let the only sensor that sees the last source never run; the node's parameters expect all sensors."""
    harmed_plan = never_understood(plan._replace(expects=False), rng)
    if harmed_plan is None:
        return None
    topic = harmed_plan.defects[-1].partition(": ")[2]
    sends = tuple(send for send in plan.sends if send.topic != topic)
    speakers = tuple(one for one in plan.speakers if one.topic != topic)
    return plan.with_defect(f"never published: {topic}", sends=sends, speakers=speakers, expects=True)


def connected_and_mute(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the only sensor that sees the last source be connected but never publish; no sensor is expected."""
    harmed_plan = never_published(plan, rng)
    if harmed_plan is None:
        return None
    topic = harmed_plan.defects[-1].partition(": ")[2]
    return plan.with_defect(f"connected and mute: {topic}", sends=harmed_plan.sends, expects=False)


def with_nothing_between(plan: Plan, rng: np.random.Generator, publisher: int) -> Plan | None:
    """Let the only sensor that sees the last source publish in an unknown frame, in alternation with a publisher.

    publisher : number of the publisher (`Speaker.number`), which publishes valid messages without sources on the topic
    """
    harmed_plan = never_understood(plan, rng)
    if harmed_plan is None:
        return None
    topic = harmed_plan.defects[-1].partition(": ")[2]
    none, times = np.empty((0, 3)), np.arange(1.3, END, EVERY).tolist()
    own = next(send for send in plan.sends if send.topic == topic)
    more = tuple(own._replace(sent=at, at=at, places=none, publisher=publisher) for at in times)
    speakers = (*plan.speakers, *((Speaker(topic=topic, number=publisher),) if publisher else ()))
    return harmed_plan._replace(sends=(*harmed_plan.sends, *more), speakers=speakers)


def partly_understood(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the only sensor that sees the last source publish its sources in an unknown frame.

    Between these messages, it publishes valid messages without sources, so its topic is neither mute nor silent.
    """
    return with_nothing_between(plan, rng, publisher=0)


def alternately_understood(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the only sensor that sees the last source publish in an unknown frame, in alternation with a second program.

    The second program publishes messages without sources on the same topic.
    """
    return with_nothing_between(plan, rng, publisher=1)


def one_misplaced(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Put the last place under the ground in each message with several places from a sensor that sees the last source.

    As soon as the plan's last source exists, the last place of such a message is this source.
    """
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


def former_area(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Deliver the first polygon again after the watched area has grown; the polygon has its first stamp."""
    polygons = [send for send in plan.sends if send.topic == "areas/polygon"]
    if len(polygons) < 2:
        return None
    former = polygons[0]._replace(at=plan.truth.area_since + float(rng.uniform(0.5, 4.0)))
    return plan.with_defect("former area again", sends=(*plan.sends, former))


def after_a_small_step(plan: Plan, at: float) -> Plan:
    """Return the plan with a clock that jumps back by less than its tolerance at a time (s)."""
    return plan._replace(clock=ClockRule(jump=-0.4, jump_at=at))


def after_a_restart(plan: Plan, at: float) -> Plan:
    """Return the plan with a restart of the node at a time (s)."""
    return plan._replace(restart_at=at)


def old_patch(word: str, harmed_at: Callable[[Plan, float], Plan]) -> Defect:
    """Return a defect in which an old patch with the bank is published again after a survey without the bank.

    Between the survey and the patch, the clock makes a small step back or the node is restarted.

    word : name of the defect; harmed_at : returns the plan with the step or restart at a time (s)
    """

    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        times = (0.1, 9.1, 18.1)
        if plan.truth.bank_until > times[1]:
            return None
        wholes = [Send(sent=at, at=at, topic=WHOLE[0], kind="grid", places=survey(plan.truth, at)) for at in times]
        old = patch_send(plan.truth, 3.0, ((32.0, 48.0), (40.0, 72.0)))
        harmed_plan = _with_terrain(plan, word, (*wholes, again(old, times[2] + 1.0)))
        sends = (*harmed_plan.sends, *areas_again(plan, times[2] + 0.6))
        return harmed_at(harmed_plan._replace(sends=sends), times[2] + 0.3)

    return defect


def old_area(word: str, harmed_at: Callable[[Plan, float], Plan]) -> Defect:
    """Return a defect in which the first polygon is published again after the area has grown.

    Before this message, the clock makes a small step back or the node is restarted.

    word : name of the defect; harmed_at : returns the plan with the step or restart at a time (s)
    """

    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        polygons = [send for send in plan.sends if send.topic == "areas/polygon"]
        if len(polygons) < 2:
            return None
        since = plan.truth.area_since + float(rng.uniform(1.0, 3.0))
        sends = (*plan.sends, again(polygons[0], since + 0.6))
        return harmed_at(plan.with_defect(word, sends=sends), since)

    return defect


def before_silence(word: str, changed: Callable[[Plan, list[Send], np.random.Generator], Plan]) -> Defect:
    """Return a defect of the time or the stamps that hides the silence of all sensors.

    The sensors fall silent just before the plan's last source appears, so no message reports this source.

    word : name of the defect
    changed : returns the plan with changed messages or clock, from the messages of the sensors before their silence
    """

    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        last = plan.truth.sources[-1] if plan.truth.sources else None
        if last is None or not set(last.seen_by) <= set(plan.sensors):
            return None
        heard = [send for send in plan.sends if send.topic in plan.sensors and send.sent < last.since]
        if {send.topic for send in heard} != set(plan.sensors):
            return None
        others = [send for send in plan.sends if send.topic not in plan.sensors]
        return changed(plan.with_defect(word, sends=(*others, *heard)), heard, rng)

    return defect


def _early(plan: Plan, heard: list[Send], rng: np.random.Generator) -> Plan:
    """Let the stamps of the sensors lie further in the future than the sensors' last messages are old."""
    by = float(rng.uniform(4.0, 9.0))
    sends = [send._replace(offset=by) if send.topic in plan.sensors else send for send in plan.sends]
    return plan._replace(sends=tuple(sends))


def _early_until_a_survey(plan: Plan, heard: list[Send], rng: np.random.Generator) -> Plan:
    """Let the last stamp of each sensor be shortly after a whole survey that arrives in the silence; no patch arrives.

    The sources are answered again with each survey. An answer from before the time of the stamp is older than its
    sources. The next survey arrives after the sources are too old.
    """
    since = plan.truth.sources[-1].since
    ends = {topic: max(send.sent for send in heard if send.topic == topic) for topic in plan.sensors}
    answered = min(send.at for send in plan.sends if send.topic in WHOLE and send.at > since + 1.25)
    ahead = {topic: answered + 0.7 - end for topic, end in ends.items()}
    sends = [send._replace(offset=ahead.get(send.topic, 0.0)) for send in plan.sends if send.topic not in PATCH]
    return plan._replace(sends=tuple(sends))


def _clock_stands(plan: Plan, heard: list[Send], rng: np.random.Generator) -> Plan:
    """Let the clock stand still from a time shortly before the silence until the end."""
    begin = plan.truth.sources[-1].since - float(rng.uniform(0.0, 2.0))
    return plan._replace(clock=ClockRule(stands=(begin, END)))


def _clock_back(plan: Plan, heard: list[Send], rng: np.random.Generator) -> Plan:
    """Let the clock jump back to the time of the newest message of the sensors, so that no stamp lies in the future.

    After the jump, the last message of the sensor that fell silent first counts so long that the level is too low.
    """
    ends = [max(send.sent for send in heard if send.topic == topic) for topic in plan.sensors]
    jump = plan.truth.sources[-1].since - min(ends) + float(rng.uniform(2.5, 3.5))
    return plan._replace(clock=ClockRule(jump=-jump, jump_at=max(ends) + jump))


def clock_back_over_old_terrain(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the clock jump back by 20 to 60 s before the bank is removed; no survey or patch arrives after the jump."""
    gone = plan.truth.bank_until
    if np.isinf(gone):
        return None
    jump_at = gone - float(rng.uniform(0.1, 1.0))
    sends = tuple(send for send in plan.sends if send.topic not in (*WHOLE, *PATCH) or send.sent < jump_at)
    rule = ClockRule(jump=-float(rng.uniform(20.0, 60.0)), jump_at=jump_at)
    sends = (*sends, *areas_again(plan, jump_at + 0.3))
    return plan.with_defect("clock back over old terrain", sends=sends, clock=rule)


def _clock_never_begins(plan: Plan, heard: list[Send], rng: np.random.Generator) -> Plan:
    """Let the clock show 0 until the end."""
    return plan._replace(clock=ClockRule(begins=END))


NARROW: dict[str, Defect] = {
    "never understood": never_understood,
    "partly understood": partly_understood,
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
    "former area again": former_area,
    "old patch after a small step": old_patch("old patch after a small step", after_a_small_step),
    "old area after a small step": old_area("old area after a small step", after_a_small_step),
    "old patch after a restart": old_patch("old patch after a restart", after_a_restart),
    "old area after a restart": old_area("old area after a restart", after_a_restart),
    "early before silence": before_silence("early before silence", _early),
    "early until a survey": before_silence("early until a survey", _early_until_a_survey),
    "clock back over old terrain": clock_back_over_old_terrain,
    "clock stands in silence": before_silence("clock stands in silence", _clock_stands),
    "clock back in silence": before_silence("clock back in silence", _clock_back),
    "silence without a clock": before_silence("silence without a clock", _clock_never_begins),
    "scanning by turns": scanning_by_turns,
}
"""Name of each rare defect -> the defect."""
