"""Make messages of every recorded topic as the nodes publish them: two events over a small slope.

In all functions, `second` is the stamp of the message in whole seconds.
"""

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    Polygon,
    PolygonStamped,
    Pose,
    PoseArray,
    Quaternion,
)
from nav_msgs.msg import MapMetaData, OccupancyGrid
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Bool, Header
from visualization_msgs.msg import MarkerArray

from rpf3d_core.live.zones import ShownZone
from rpf3d_ros.messages.alert_reading import ALERT
from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.diagnostic_messages import diagnostics_of
from rpf3d_ros.messages.health import ERROR, OK, WARN, Health
from rpf3d_ros.messages.marker_messages import area_markers, trajectory_markers, zone_markers
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh
from rpf3d_ros.recording.bag_writer import BagWriter, typestore

SECOND = 1_000_000_000
SIDE = 40
"""Number of points along each side of the slope; the points are one metre apart."""

LEVEL_OF_ALERT = {"normal": OK, "watch": WARN, "restrict": WARN, "evacuate": ERROR, "fault": ERROR}


def header(second, frame="map"):
    return Header(frame_id=frame, stamp=Time(sec=second))


def markers(data):
    """Return the MarkerArray of published CDR bytes."""
    return deserialize_message(data, MarkerArray)


def hazard(of, levels):
    """Return the MarkerArray of hazard zones without outlines.

    of : header; levels : name of each zone -> corners (F, 3, 3) m of its facets
    """
    return markers(zone_markers(of, [ShownZone(name, c, np.empty((0, 2, 3))) for name, c in levels.items()]))


def slope():
    """Return points (SIDE, SIDE, 3) m of a slope that falls to the north."""
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    return np.stack([x, y, 0.5 * (SIDE - y)], axis=-1)


def mesh():
    return cdr_of_mesh(grid_mesh(slope()))


def falls(rocks=6, points=30, seconds=4.0):
    """Return the columns (N,) of a cloud of points on the paths of rocks that bounce down the slope.

    rocks : number of rocks; points : number of points of each rock; seconds : duration of the motion (s)
    """
    rock = np.repeat(np.arange(rocks), points)
    t = np.tile(np.linspace(0.0, seconds, points), rocks)
    y = 2.0 + 30.0 * t / seconds
    z = 0.5 * (SIDE - y) + 2.0 * np.abs(np.sin(3.0 * t + rock))
    speed = 3.0 + 4.0 * t
    return {"x": 8.0 + 4.0 * rock, "y": y, "z": z, "t": t, "rock": rock, "speed": speed, "energy": 700.0 * speed**2}


def pose(x, y, z):
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(z=0.7071068, w=0.7071068))


def poses(second, *places):
    return PoseArray(header=header(second), poses=[pose(*place) for place in places])


def facets(rows):
    points = slope()[rows]
    south, north = points[:-1], points[1:]
    lower = np.stack([south[:, :-1], south[:, 1:], north[:, 1:]], axis=2)
    upper = np.stack([south[:, :-1], north[:, 1:], north[:, :-1]], axis=2)
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


def grid(second):
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    percent = (100.0 * np.exp(-(((x - 18.0) / 8.0) ** 2)) * (y < 34)).round().astype(np.int8)
    percent[y > 36] = -1
    info = MapMetaData(resolution=1.0, width=SIDE, height=SIDE, origin=pose(0.0, 0.0, 0.0))
    return OccupancyGrid(header=header(second), info=info, data=percent.ravel().tolist())


def areas(second, *names, raised=0.0):
    """Return the MarkerArray with an outline for each named area, by default for haul_ramp.

    raised : height (m) that is added to the outlines
    """
    ring = np.array([[5.0, 30.0, 5.0], [35.0, 30.0, 5.0], [35.0, 34.0, 4.0], [5.0, 30.0, 5.0]])
    ring[:, 2] += raised
    return markers(area_markers(header(second), {name: [ring] for name in names or ("haul_ramp",)}))


def alerts(second, level, area="haul_ramp"):
    """Return a message of `alerts` with the same level (a word) for the site and one area."""
    values = {"level": level, "valid_until": str(second + 5), "reasons": "reach", "result": "1"}
    site = Health(ALERT, LEVEL_OF_ALERT[level], f"{level}: reach of {area} 12 %", values)
    return diagnostics_of(Time(sec=second), [site, Health(f"{ALERT} {area}", site.level, site.message, values)])


def inputs(second):
    """Return a message for each input of the simulator except whole surveys, by topic."""
    patch = slope()[4:8, 4:10] + np.array([0.0, 0.0, 0.4])
    return {
        "terrain/update": cloud_of_columns(header(second), {n: patch[..., i] for i, n in enumerate("xyz")}),
        "areas/polygon": PolygonStamped(
            header=header(second),
            polygon=Polygon(points=[Point32(x=x, y=y, z=5.0) for x, y in ((5.0, 30.0), (35.0, 30.0), (35.0, 34.0))]),
        ),
        "areas/equipment": poses(second, (20.0, 32.0, 4.0)),
        "sources": poses(second, (8.0, 2.0, 20.0), (12.0, 2.0, 20.0)),
        "clicked_point": PointStamped(header=header(second + 1), point=Point(x=10.0, y=3.0, z=19.0)),
        "source_cloud": cloud_of_columns(
            header(second + 2),
            {"x": np.full(2, 9.0), "y": np.full(2, 2.0), "z": np.full(2, 20.0)}
            | {"vx": np.zeros(2), "vy": np.full(2, 2.0), "vz": np.zeros(2)},
        ),
    }


def answers(second, seconds=4.0):
    """Return the messages of one answer, by topic; seconds : duration of the rocks' motion (s)."""
    fallen = falls(seconds=seconds)
    fallen["energy"] = fallen["energy"] * seconds
    cloud = cloud_of_columns(header(second), fallen)
    reach = {"x": np.arange(5.0), "y": np.arange(5.0), "z": np.full(5, 18.0), "reach_probability": np.linspace(0, 1, 5)}
    reach |= {"p95_energy": np.full(5, np.nan), "first_arrival": np.arange(5.0)}
    zones = {"passed": facets(slice(4, 30)), "stopped": facets(slice(29, 34))}
    result = Health("rpf3d: result", OK, "result 1", {"result": "1", "stage": "0", "rocks": "6", "complete": "true"})
    return {
        "trajectories": markers(trajectory_markers(header(second), falls(), 200, 50)),
        "trajectories/points": cloud,
        "impacts": cloud,
        "deposits": cloud,
        "hazard/zones": hazard(header(second), zones),
        "areas/outlines": areas(second),
        "hazard/points": cloud_of_columns(header(second), reach),
        "hazard/grid": grid(second),
        "results": diagnostics_of(Time(sec=second), [result]),
    }


def shift(start=1_700_000_000):
    """Yield time of reception (ns), topic and message of two events, in order; the alert level rises and falls.

    start : time of the first message (s); meshes are given as CDR bytes
    """
    yield start * SECOND, "terrain/mesh", mesh()
    yield start * SECOND, "alarm", Bool(data=False)
    for number, level in enumerate(("evacuate", "normal")):
        second = start + 20 * number + 5
        yield second * SECOND, "alerts", alerts(second, "normal")
        for topic, message in {**inputs(second), **answers(second, 4.0 - number)}.items():
            yield second * SECOND + SECOND // 2, topic, message
        for later, said in enumerate((level, "watch" if number == 0 else level), start=3):
            yield (second + 4 * later) * SECOND, "alerts", alerts(second + 4 * later, said)
        yield (second + 9) * SECOND, "alarm", Bool(data=level == "evacuate")
        yield (second + 9) * SECOND, "/diagnostics", nothing_wrong(second)
    yield (start + 60) * SECOND, "terrain/mesh", mesh()


def nothing_wrong(second) -> DiagnosticArray:
    return diagnostics_of(Time(sec=second), [Health("rpf3d_simulator: terrain", OK, f"{SIDE * SIDE} points")])


def as_cdr(message):
    return message if isinstance(message, bytes) else serialize_message(message)


def without_chance(message):
    """Return a message as CDR bytes with zeros as padding; rclpy leaves arbitrary bytes there."""
    kind, types = type(message), typestore()
    name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
    return bytes(types.serialize_cdr(types.deserialize_cdr(serialize_message(message), name), name))


def write_bag(folder, messages, namespace="/"):
    """Write a bag to a folder.

    messages : time (ns), topic and message of each; namespace : prefix of topics that do not begin with a slash
    """
    bag = BagWriter(folder)
    for stamp_ns, topic, message in messages:
        bag.write(topic, topic if topic.startswith("/") else namespace + topic, stamp_ns, as_cdr(message))
    bag.close()
