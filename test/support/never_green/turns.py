"""A sensor that reports the places of its scan by turns: the dangerous source in one message, other places in the next.

The messages are correct, but no message has all places. So this is a defect only for a node that takes each message as
the whole scan.
"""

import numpy as np
from never_green import pit
from never_green.plan import END, Plan, Send
from never_green.stories import EVERY

NAME = "scanning by turns"
TURNS = (2, 4)
"""Numbers of messages of a whole scan; four messages take longer than sources count without a scan period."""


def scanning_by_turns(plan: Plan, rng: np.random.Generator) -> Plan | None:
    """Let all sensors that see the last source report it in every second or fourth message; at most once in a plan.

    The first message with the source stays, because no node can know of a source that was never reported. With a scan
    period in the site file, the other messages have the other sources, or none. Without it, the other messages have at
    least one harmless place, because an empty message says that no source is left; and in half of these plans the
    sensors stop at this part of their scan. A person who acknowledges ends the fault of a missing place, so the sensors
    of a plan with acknowledgements must report the source again soon. In a third of the plans with a scan period, the
    node must refuse the second report of the source.

    Messages with the same time are parts of one scan (`parts.py`), and have the same turn. Plans with a thrown source
    are left out: without it, a scan must not have the harmless source at almost the same place.
    """
    dangerous = plan.truth.sources[-1:]
    topics = [topic for source in dangerous for topic in source.seen_by if topic in plan.sensors]
    is_bound = plan.scan_period is not None or any(source.is_thrown for source in dangerous)
    if not topics or is_bound or any(name.startswith(NAME) for name in plan.defects):
        return None
    is_acknowledged = any(send.kind == "acknowledgement" for send in plan.sends)
    is_stated = bool(rng.random() < 0.5)
    turns = int(rng.choice(TURNS)) if is_stated or not is_acknowledged else min(TURNS)
    period = (turns + 0.5) * EVERY if is_stated else None
    stays = period is None and not is_acknowledged and bool(rng.random() < 0.5)
    since = dangerous[0].since + turns * EVERY + 0.5  # each of the sensors has reported the source
    from_then = max(float(rng.uniform(4.0, 10.0)), since) if stays else END
    refused = 1 if is_stated and rng.random() < 1 / 3 else None  # number of the report
    floor, place = pit.on_the_floor(rng), dangerous[0].place
    numbers: dict[str, int] = {}  # of the scans of each topic since the first message with the source
    times: dict[str, float] = {}  # of the last scan of each topic
    sends = []
    for send in plan.sends:
        if send.topic in topics and (send.topic in numbers or is_at(send, place).any()):
            numbers[send.topic] = numbers.get(send.topic, -1) + int(times.get(send.topic) != send.sent)
            times[send.topic] = send.sent
            is_other = numbers[send.topic] % turns > 0 or send.sent >= from_then
            send = _without(send, place, floor if period is None else None) if is_other else _only(send, place)
            if refused is not None and numbers[send.topic] == refused * turns:
                send = send._replace(frame="refused")
        sends.append(send)
    return plan.with_defect(f"{NAME}: {', '.join(topics)}", sends=tuple(sends), scan_period=period, stays=stays)


def is_at(send: Send, place: np.ndarray) -> np.ndarray:
    """Return for each of the N places of a message whether it is the place (3,) m; the result has the shape (N,)."""
    return np.isclose(send.places.reshape(-1, 3), place).all(axis=1)


def _only(send: Send, place: np.ndarray) -> Send:
    """Return a message with only the source at a place (3,) m; the unchanged message if the source is not in it."""
    there = is_at(send, place)
    return send._replace(places=send.places.reshape(-1, 3)[there]) if there.any() else send


def _without(send: Send, place: np.ndarray, floor: np.ndarray | None) -> Send:
    """Return a message without the source at a place (3,) m; floor : place to report if no source is left, or None."""
    others = send.places.reshape(-1, 3)[~is_at(send, place)]
    if not len(others) and floor is not None:
        others = floor[None]
    return send._replace(places=others)
