"""Write and read a message of each recorded type: do the numpy of this environment and its ROS packages fit?"""

from importlib import import_module

from rclpy.serialization import deserialize_message, serialize_message
from shape_msgs.msg import Mesh, MeshTriangle

from rpf3d_ros.interface.recorded_topics import TOPICS


def check(message: object) -> None:
    """Raise AssertionError if a message changes when it is written and read."""
    assert deserialize_message(serialize_message(message), type(message)) == message, type(message)


def main() -> None:
    """Check an empty message of each type, and a mesh, whose indices are arrays of numpy."""
    for kind in sorted({topic.kind for topic in TOPICS.values()}):
        package, _, name = kind.rpartition("/")
        check(getattr(import_module(package.replace("/", ".")), name)())
        print(f"{kind}: read as written")
    check(Mesh(triangles=[MeshTriangle(vertex_indices=[0, 1, 2])]))


if __name__ == "__main__":
    main()
