"""Check that the message classes of ROS 2 work with the installed numpy: write and read a message of each type."""

from importlib import import_module

from rclpy.serialization import deserialize_message, serialize_message
from shape_msgs.msg import Mesh, MeshTriangle

from rpf3d_ros.interface.recorded_topics import TOPICS


def check(message: object) -> None:
    """Raise AssertionError if a message is not the same after it was written and read."""
    assert deserialize_message(serialize_message(message), type(message)) == message, type(message)


def main() -> None:
    """Check an empty message of each recorded type, and a mesh, because its indices are numpy arrays."""
    for kind in sorted({topic.kind for topic in TOPICS.values()}):
        package, _, name = kind.rpartition("/")
        check(getattr(import_module(package.replace("/", ".")), name)())
        print(f"{kind}: read as written")
    check(Mesh(triangles=[MeshTriangle(vertex_indices=[0, 1, 2])]))


if __name__ == "__main__":
    main()
