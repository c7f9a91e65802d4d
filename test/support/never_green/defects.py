"""Add defects of inputs to a combination: each function takes a `Plan` and returns the plan with one more defect.

Only defects that the node can notice are drawn. The safety argument names the others ("Which dangers are not
covered?"): a wrong place that is plausible, a source that no sensor reports, a patch that is never sent while whole
surveys arrive.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from never_green import changes, pit
from never_green.changes import Change
from never_green.parts import scan_in_parts
from never_green.plan import END, Plan, Send, Speaker
from never_green.stories import EVERY, RADAR_A, SENSORS

Defect = Callable[[Plan, np.random.Generator], Plan | None]
"""A function that returns a plan with one more defect; None if the plan lacks the input that the defect harms."""

AREAS = ("areas/polygon", "areas/equipment")
WHOLE = ("terrain/points", "terrain/mesh")
PATCH = ("terrain/update",)
RESTARTED = 3.5
"""Time (s) after a restart within which the node notices two publishers, or a clock that stands still."""

LOOKED = 2.5
"""Time (s) within which the node notices a second publisher, or a publisher that it cannot receive."""


def harmed(plan: Plan, name: str, chosen: Callable[[Send], bool], change: Change) -> Plan | None:
    """Return a plan with some of its messages changed; None if no message is chosen.

    name : name of the defect; chosen : returns True for the messages to change
    """
    if not any(map(chosen, plan.sends)):
        return None
    return plan.with_defect(name, sends=tuple(change(send) if chosen(send) else send for send in plan.sends))


def _topic_of(plan: Plan, rng: np.random.Generator, topics: tuple[str, ...]) -> str:
    """Return a random one of the `topics` that have messages in the plan; "" if none of them has messages."""
    used = sorted({send.topic for send in plan.sends if send.topic in topics})
    return str(rng.choice(used)) if used else ""


def _from_then(plan: Plan, rng: np.random.Generator, topics: tuple[str, ...]) -> tuple[str, Callable[[Send], bool]]:
    """Return a random one of `topics`, and a function that returns True for the messages to change.

    These are its messages from a random time on, to the end or for 2.5 EVERY seconds.
    """
    topic, since = _topic_of(plan, rng, topics), float(rng.choice((0.0, rng.uniform(0.0, 14.0))))
    until = float(rng.choice((END, since + 2.5 * EVERY)))
    return topic, lambda send: send.topic == topic and since <= send.sent < until


def changing(word: str, topics: tuple[str, ...], change_of: Callable[[np.random.Generator], Change]) -> Defect:
    """Return a defect that changes messages of one of `topics`; word : its name; change_of : draws the change."""

    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        topic, chosen = _from_then(plan, rng, topics)
        return harmed(plan, f"{word}: {topic}", chosen, change_of(rng))

    return defect


def late_sources(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let messages of a sensor be late; if its first message is late, the node's parameters expect the sensor.

    A node cannot know of a sensor that has not published yet and that its parameters do not name as expected.
    """
    harmed_plan = changing("late", SENSORS, changes.late)(plan, rng)
    if harmed_plan is None:
        return None
    topic = harmed_plan.defects[-1].removeprefix("late: ")
    first, late = (min(send.at for send in one.sends if send.topic == topic) for one in (plan, harmed_plan))
    return harmed_plan._replace(expects=True) if late > first else harmed_plan


def silent(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let a sensor fall silent; it is silent from the start only if the node's parameters expect the sensor."""
    topic, since = _topic_of(plan, rng, SENSORS), 0.0 if plan.expects and rng.random() < 0.4 else rng.uniform(3.0, 14.0)
    sends = tuple(send for send in plan.sends if send.topic != topic or send.sent < since)
    if len(sends) == len(plan.sends) or (since and not any(send.topic == topic for send in sends)):
        return None
    return plan.with_defect(f"missing: {topic}", sends=sends)


def without(word: str, topics: tuple[str, ...], from_begin: bool) -> Defect:
    """Return a defect that removes the messages of one of `topics` from a random time on.

    word : name of the defect; from_begin : True to remove all messages of the topic
    """

    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        topic, since = _topic_of(plan, rng, topics), 0.0 if from_begin else float(rng.uniform(3.0, 6.0))
        sends = tuple(send for send in plan.sends if send.topic != topic or send.sent < since)
        return None if len(sends) == len(plan.sends) else plan.with_defect(f"{word}: {topic}", sends=sends)

    return defect


def duplicated(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Send messages of a topic twice with the same stamp; the second arrives at once or 8.3 s later."""
    topic, chosen = _from_then(plan, rng, (*SENSORS, *AREAS, *WHOLE, *PATCH))
    by = float(rng.choice((0.05, 4.0 * EVERY + 0.3)))
    again = tuple(send._replace(at=send.at + by) for send in plan.sends if chosen(send))
    return plan.with_defect(f"duplicated: {topic}", sends=(*plan.sends, *again)) if again else None


def repeated_surveys(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Publish each whole survey again before the next survey, with its first stamp."""
    later = float(rng.uniform(0.5, 5.0))
    again = tuple(
        send._replace(sent=send.sent + later, at=send.at + later, offset=send.offset - later)
        for send in plan.sends if send.topic in WHOLE
    )  # fmt: skip
    return plan.with_defect("published again", sends=(*plan.sends, *again)) if again else None


def diluted(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Add twenty harmless sources to the messages of a sensor."""
    topic, chosen = _from_then(plan, rng, SENSORS)
    more = np.array([pit.placed(62.0, 6.0 + 3.4 * number, 0.5) for number in range(20)])
    return harmed(
        plan, f"diluted: {topic}", lambda send: chosen(send) and send.kind in ("poses", "cloud"),
        lambda send: send._replace(places=np.concatenate([more, send.places])),
    )  # fmt: skip


def contradicting(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let a sensor report no sources, although other sensors see all of its sources; at most once in a plan."""
    sources = [set(source.seen_by) & set(plan.sensors) for source in plan.truth.sources]
    topics = [each for each in plan.sensors if any(each in seen for seen in sources)]
    topics = [each for each in topics if all(seen != {each} for seen in sources)]
    if not topics or any(name.startswith("contradicting:") for name in plan.defects):
        return None
    topic = str(rng.choice(topics))
    return harmed(
        plan, f"contradicting: {topic}", lambda send: send.topic == topic,
        lambda send: send._replace(places=np.empty((0, 3))),
    )  # fmt: skip


def empty_at_once(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """After messages of a sensor, send a message without sources and with the same stamp."""
    topic, chosen = _from_then(plan, rng, SENSORS)
    none = np.empty((0, 3))
    full = [send for send in plan.sends if chosen(send) and len(send.places)]
    more = tuple(send._replace(at=send.at + 0.01, places=none) for send in full)
    return plan.with_defect(f"contradicting itself: {topic}", sends=(*plan.sends, *more)) if more else None


def two_speakers(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let a second program publish on a topic: messages without sources, or copies of the first survey or area."""
    topic, since = _topic_of(plan, rng, (*SENSORS, *AREAS, *WHOLE)), float(rng.uniform(0.0, 12.0))
    own = [send for send in plan.sends if send.topic == topic]
    if not own:
        return None
    places = np.empty((0, 3)) if topic in SENSORS else own[0].places
    times = np.arange(since + 0.4, END, EVERY).tolist()
    more = tuple(own[0]._replace(sent=at, at=at, places=places, publisher=1, damage=None) for at in times)
    return plan.with_defect(
        f"two publishers: {topic}", sends=(*plan.sends, *more), graces=(*plan.graces, (since, LOOKED)),
        speakers=(*plan.speakers, Speaker(topic=topic, number=1, since=since)),
    )  # fmt: skip


def not_received(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Give the publisher of a topic a quality of service or a message type that the node cannot receive."""
    topic = _topic_of(plan, rng, (*SENSORS, *AREAS, *WHOLE, *PATCH))
    since = float(rng.choice((0.0, rng.uniform(0.0, 12.0))))
    if not topic:
        return None
    is_of_type = bool(rng.random() < 0.5)
    speakers = []
    for one in plan.speakers:
        parts = [one]
        if one.topic == topic and one.number == 0:
            late = one._replace(since=since, is_received=False, is_of_type=is_of_type)
            parts = [one._replace(until=since), late]
        speakers += parts
    return plan.with_defect(f"not received: {topic}", speakers=tuple(speakers))


def _clock(name: str, **changes: Callable[[np.random.Generator], object]) -> Defect:
    def defect(plan: Plan, rng: np.random.Generator) -> Plan | None:
        rule = plan.clock._replace(**{key: draw(rng) for key, draw in changes.items()})
        return plan.with_defect(name, clock=rule)

    return defect


def _a_while(rng: np.random.Generator) -> tuple[float, float]:
    begin = float(rng.uniform(4.0, 12.0))
    return begin, begin + float(rng.uniform(1.0, 9.0))


def _anywhen(rng: np.random.Generator) -> float:
    return float(rng.uniform(2.0, 14.0))


def clock_back(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the clock jump back by 1 to 60 s; the areas are published again, because the node then needs them again."""
    rule = plan.clock._replace(jump=-float(rng.uniform(1.0, 60.0)), jump_at=_anywhen(rng))
    return plan.with_defect("clock back", clock=rule, sends=(*plan.sends, *areas_again(plan, rule.jump_at + 0.4)))


def areas_again(plan: Plan, at: float) -> list[Send]:
    """Return the last message of each topic of areas before a time `at` (s), published again at this time.

    The last message is that with the latest stamp: another defect may have published a former area again.
    """
    sent = sorted(plan.sends, key=lambda send: send.sent + send.offset)
    last = {send.topic: send for send in sent if send.topic in AREAS and send.sent < at}
    return [send._replace(sent=at, at=at, offset=0.0) for send in last.values()]


def again(send: Send, at: float) -> Send:
    """Return a message that is published again at a time `at` (s), with its first stamp."""
    return send._replace(sent=at, at=at, offset=send.sent + send.offset - at)


def clock_back_a_little(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the clock jump back by less than its tolerance; then an old survey, patch or area is published again."""
    jump_at = _anywhen(rng)
    old = _old_message(plan, rng, jump_at)
    if old is None:
        return None
    rule = plan.clock._replace(jump=-float(rng.uniform(0.05, 0.45)), jump_at=jump_at)
    return plan.with_defect("clock back a little", clock=rule, sends=(*plan.sends, old))


def restarted(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let the node be started again; then the areas are published, and an old survey, patch or area again.

    The new node needs some time to notice two publishers, or a clock that stands still.
    """
    restart_at = _anywhen(rng)
    old = _old_message(plan, rng, restart_at)
    if old is None or np.isfinite(plan.restart_at):
        return None
    sends, graces = (*areas_again(plan, restart_at + 0.4), old), (*plan.graces, (restart_at, RESTARTED))
    return plan.with_defect("restarted", restart_at=restart_at, sends=(*plan.sends, *sends), graces=graces)


def _old_message(plan: Plan, rng: np.random.Generator, since: float) -> Send | None:
    """Return a survey, patch or area that is published again 0.5 to 4 s after a time `since` (s); None if none is."""
    olds = [send for send in plan.sends if send.topic in (*AREAS, "terrain/points", *PATCH) and send.at < since]
    return again(olds[rng.integers(len(olds))], since + float(rng.uniform(0.5, 4.0))) if olds else None


def acknowledged(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let a person acknowledge one to four times at random times, sometimes without a name or without a reason.

    An acknowledgement says that a place that is no longer reported is safe, so no person may acknowledge such a place.
    """
    if plan.stays:
        return None
    words = str(rng.choice(("A. Shift: looked from the other side", ":", "A. Shift:")))
    times = sorted(rng.uniform(0.5, END, rng.integers(1, 5)).tolist())
    acks = [
        Send(sent=at, at=at, topic="", kind="acknowledgement", places=np.empty((0, 3)), words=words) for at in times
    ]
    return plan.with_defect("acknowledged early", sends=(*plan.sends, *acks))


def failing(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let every answer to sources on the slope fail with an error for a random time of at least 5 s."""
    begin = float(rng.choice((0.0, rng.uniform(0.0, 10.0))))
    return plan.with_defect("answers fail", answers_fail=(begin, begin + float(rng.uniform(5.0, END))))


def false_patch(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Send a patch of the slope whose heights are in another unit or upside down."""
    since = float(rng.uniform(1.0, 12.0))
    change = (changes.heights_scaled, changes.upside_down)[rng.integers(2)](rng)
    points = pit.patch_of(plan.truth.has_bank(since), (24.0, 36.0), (4.0, 76.0))
    send = change(Send(sent=since, at=since, topic=PATCH[0], kind="patch", places=points))
    speakers = plan.speakers
    if not any(one.topic == PATCH[0] for one in speakers):
        speakers = (*speakers, Speaker(topic=PATCH[0], number=0))
    return plan.with_defect("wrong heights of a patch", sends=(*plan.sends, send), speakers=speakers)


BROKEN = partial(changing, topics=(*SENSORS, *PATCH, *WHOLE, *AREAS))
DEFECTS: dict[str, Defect] = {
    "missing sources": silent,
    "missing surveys": without("missing", WHOLE, from_begin=False),
    "missing terrain": without("missing from the beginning", WHOLE, from_begin=True),
    "missing areas": without("missing from the beginning", AREAS, from_begin=True),
    "late sources": late_sources,
    "late terrain": changing("late", ("terrain/points", *PATCH), changes.late),
    "late areas": changing("late", AREAS, changes.stamped_late),
    "early": changing("early", (*SENSORS, "terrain/points", *PATCH, *AREAS), changes.early),
    "wrong frame": changing("wrong frame", (*SENSORS, "terrain/points", *PATCH, *AREAS), changes.framed),
    "wrong unit": BROKEN("wrong unit", change_of=changes.scaled),
    "wrong unit of heights": changing("wrong heights", (*SENSORS, *WHOLE), changes.heights_scaled),
    "wrong sign": BROKEN("wrong sign", change_of=changes.mirrored),
    "exchanged axes": BROKEN("exchanged axes", change_of=changes.exchanged),
    "upside down": changing("upside down", (*SENSORS, *WHOLE), changes.upside_down),
    "wrong heights of a patch": false_patch,
    "not finite": changing("not finite", (*SENSORS, "terrain/points", *PATCH, "areas/equipment"), changes.not_finite),
    "nothing but NaN": changing("nothing but NaN", (RADAR_A, SENSORS[2]), changes.all_nan),
    "damaged": changing("damaged", (*SENSORS, *WHOLE, *PATCH), changes.damaged),
    "partial area": changing("partial", ("areas/polygon",), changes.two_corners),
    "strip of holes": changing("strip of holes", WHOLE[:1], changes.strip),
    "cut survey": changing("cut", WHOLE, changes.cut),
    "duplicated": duplicated,
    "diluted": diluted,
    "contradicting": contradicting,
    "contradicting itself": empty_at_once,
    "two speakers": two_speakers,
    "not received": not_received,
    "clock stands": _clock("clock stands", stands=_a_while),
    "clock back": clock_back,
    "clock ahead": _clock("clock ahead", jump=lambda rng: float(rng.uniform(1.0, 60.0)), jump_at=_anywhen),
    "clock begins late": _clock("clock begins late", begins=_anywhen),
    "acknowledged early": acknowledged,
    "answers fail": failing,
    "published again": repeated_surveys,
    "clock back a little": clock_back_a_little,
    "restarted": restarted,
    "scan in parts": scan_in_parts,
}
