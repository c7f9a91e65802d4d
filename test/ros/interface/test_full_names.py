"""Tests that two spellings of one topic are not taken for two sensors."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.recorded_topics import check_full_names


def full_name_in(namespace, **remapped):
    """Return a function that returns the full name of a topic of a node in a namespace; remapped : name -> new name."""

    def full_name(name):
        name = remapped.get(name, name)
        return name if name.startswith("/") else f"{namespace}/{name}"

    return full_name


@pytest.mark.parametrize(
    ("names", "full_name"),
    [
        (("a", "/a"), full_name_in("")),
        (("a", "/mine/a"), full_name_in("/mine")),
        (("a", "b"), full_name_in("", b="/a")),
    ],
)
def test_one_topic_under_two_names_is_refused(names, full_name):
    with pytest.raises(InputError, match=f"{names[1]} is the same topic as a, {full_name('a')}: see source_topics"):
        check_full_names(names, full_name)


def test_a_topic_of_rpf3d_for_other_data_is_refused_under_its_full_name_too():
    with pytest.raises(InputError, match="/mine/areas/equipment is a topic of rpf3d without sources"):
        check_full_names(("/mine/areas/equipment",), full_name_in("/mine"))


def test_different_topics_are_accepted():
    check_full_names(("sources", "source_cloud", "/sources", "/mine/b/sources"), full_name_in("/mine"))
