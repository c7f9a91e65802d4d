"""The first messages that a node of the pit needs before it decides without a fault: terrain, an area and no source."""

import numpy as np
from never_green import pit
from never_green.plan import Plan, Send, Speaker, Truth
from never_green.stories import CLICK, RADAR_A, survey

TRUTH = Truth(sources=(), bank_until=np.inf, areas=(pit.outline(pit.ROAD),) * 2, area_since=0.0)
TOPICS = (RADAR_A, CLICK, "terrain/points", "areas/polygon")
PLAN = Plan(
    truth=TRUTH, sends=(), speakers=tuple(Speaker(topic=topic, number=0) for topic in TOPICS), sensors=(),
    limits="restrict", expects=False,
)  # fmt: skip
WHOLE = Send(sent=0.1, at=0.1, topic="terrain/points", kind="grid", places=survey(TRUTH, 0.1))
AREA = Send(sent=0.2, at=0.2, topic="areas/polygon", kind="polygon", places=pit.outline(pit.ROAD))
NOTHING = Send(sent=0.4, at=0.4, topic=RADAR_A, kind="poses", places=np.empty((0, 3)))


def faults_after(run, *sends):
    """Deliver messages to the node one by one; return the faults of its alert after the last."""
    for send in sends:
        run.deliver(send)
        run.node.tick()
    return run.node.station.desk.alert.faults
