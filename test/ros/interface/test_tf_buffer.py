"""Tests of the adapter to tf2, with a stand-in for tf2_ros only, because no wheel contains tf2_ros."""

import importlib
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.tf_buffer import TfTransforms
from rpf3d_ros.interface.transforms import NEWEST

STAND_IN = Path(__file__).parents[2] / "support" / "stand_in_tf2"
S = 1_000_000_000
NOW = 1_000 * S
QUICK = 20.0
"""Longest time (s) of a lookup that does not wait; on an idle machine it takes milliseconds."""


@pytest.fixture
def tf2(monkeypatch):
    """Yield the stand-in module, imported as tf2_ros."""
    monkeypatch.syspath_prepend(str(STAND_IN))
    monkeypatch.delitem(importlib.sys.modules, "tf2_ros", raising=False)
    yield importlib.import_module("tf2_ros")
    importlib.sys.modules.pop("tf2_ros", None)


@pytest.fixture
def transforms(tf2, node):
    made = TfTransforms(node)
    yield made
    made.close()


def moved(tf2, x, turn=(0.0, 0.0, 0.0, 1.0)):
    return tf2.Pose(np.array(turn), np.array([x, 0.0, 0.0]))


def put(tf2, transforms, parent, child, x, stamp_ns=None):
    message = tf2.message_of(moved(tf2, x), parent, child, stamp_ns or 0)
    (transforms._buffer.set_transform_static if stamp_ns is None else transforms._buffer.set_transform)(message, "test")


def test_where_tf2_is_missing_the_reason_names_the_package(node):
    try:
        importlib.import_module("tf2_ros")
    except ImportError:
        with pytest.raises(InputError, match=r"use_tf is true, but tf2_ros cannot be imported .*tf2_ros_py"):
            TfTransforms(node)
    else:
        pytest.skip("tf2_ros is installed")


def test_a_chain_of_static_transforms_holds_for_all_times(tf2, transforms):
    put(tf2, transforms, "map", "mast", 10.0)
    put(tf2, transforms, "mast", "radar", 1.0)
    for stamp in (1, NOW):
        found = transforms.lookup("map", "radar", stamp)
        assert (found.translation, found.quaternion, found.stamp_ns) == ((11.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), None)


def test_a_dynamic_transform_is_that_of_the_stamp_or_the_newest_before_it(tf2, transforms):
    put(tf2, transforms, "map", "truck", 10.0, NOW)
    put(tf2, transforms, "map", "truck", 20.0, NOW + S)
    put(tf2, transforms, "truck", "radar", 1.0)
    at = {offset: transforms.lookup("map", "radar", NOW + round(offset * S)) for offset in (0.0, 0.25, 1.0, 3.0)}
    assert [each.translation[0] for each in at.values()] == [11.0, 13.5, 21.0, 21.0]
    assert [(each.stamp_ns - NOW) / S for each in at.values()] == [0.0, 0.25, 1.0, 1.0]


def test_the_oldest_link_of_a_chain_decides_the_age(tf2, transforms):
    put(tf2, transforms, "map", "truck", 10.0, NOW)
    put(tf2, transforms, "truck", "radar", 1.0, NOW + 4 * S)
    put(tf2, transforms, "truck", "radar", 2.0, NOW)
    assert transforms.lookup("map", "radar", NOW + 5 * S).stamp_ns == NOW


def test_each_reason_of_tf2_is_passed_on(tf2, transforms):
    assert "does not exist" in transforms.lookup("map", "radar", NOW)
    put(tf2, transforms, "map", "truck", 10.0, NOW)
    put(tf2, transforms, "elsewhere", "radar", 1.0)
    assert "not part of the same tree" in transforms.lookup("map", "radar", NOW)
    assert "extrapolation into the past" in transforms.lookup("map", "truck", NOW - 1)
    assert "cannot start with a /" in transforms.lookup("map", "/truck", NOW)


def test_a_dynamic_transform_without_a_stamp_is_not_taken_for_a_static_one(tf2, transforms):
    transforms._buffer.set_transform(tf2.message_of(moved(tf2, 10.0), "map", "truck", 0), "test")
    assert "extrapolation" in transforms.lookup("map", "truck", NOW)


def test_without_a_time_only_a_static_transform_has_no_stamp(tf2, transforms):
    put(tf2, transforms, "map", "mast", 10.0)
    put(tf2, transforms, "map", "truck", 10.0, NOW)
    transforms._buffer.set_transform(tf2.message_of(moved(tf2, 10.0), "map", "unstamped", 0), "test")
    assert transforms.lookup("map", "mast", NEWEST).stamp_ns is None
    assert transforms.lookup("map", "truck", NEWEST).stamp_ns == NOW
    assert "extrapolation" in transforms.lookup("map", "unstamped", NEWEST)


@pytest.mark.parametrize(("error", "reason"), [
    (RuntimeError("the core is corrupt"), "RuntimeError: the core is corrupt"), (ValueError(), "ValueError"),
])  # fmt: skip
def test_any_other_error_of_a_lookup_is_a_reason_and_does_not_end_the_process(transforms, monkeypatch, error, reason):
    def fail(*arguments):
        raise error

    monkeypatch.setattr(transforms._buffer, "lookup_transform", fail)
    assert transforms.lookup("map", "radar", NOW) == reason


def test_an_exception_of_tf2_without_a_message_is_named(tf2, transforms, monkeypatch):
    def fail(*arguments):
        raise tf2.LookupException

    monkeypatch.setattr(transforms._buffer, "lookup_transform", fail)
    assert transforms.lookup("map", "radar", NOW) == "LookupException"


def test_after_the_clock_went_back_static_transforms_are_left(tf2, transforms):
    put(tf2, transforms, "map", "truck", 10.0, NOW)
    put(tf2, transforms, "map", "radar", 5.0)
    transforms.clear()
    assert isinstance(transforms.lookup("map", "truck", NOW), str)
    assert transforms.lookup("map", "radar", NOW).translation[0] == 5.0


def test_a_lookup_asks_for_no_waiting(tf2, transforms, monkeypatch):
    monkeypatch.setattr(tf2.wall_clock, "sleep", lambda seconds: pytest.fail("it waits"))
    began = time.monotonic()
    assert isinstance(transforms.lookup("map", "radar", NOW), str)
    assert time.monotonic() - began < QUICK, "it waits without a sleep"


def test_the_subscriptions_end_with_the_provider(tf2, node):
    made = TfTransforms(node)
    assert {each.topic_name for each in node.subscriptions} >= {"/tf", "/tf_static"}
    made.close()
    assert not {each.topic_name for each in node.subscriptions} & {"/tf", "/tf_static"}
