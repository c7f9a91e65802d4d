"""The worker thread: the latest request wins."""

import threading

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.latest_request import LatestRequest

PATIENCE = 10.0
"""Seconds; a thread that has not moved by then is stuck."""


def test_of_the_requests_that_wait_only_the_latest_is_served():
    served, begun, go, done = [], threading.Event(), threading.Event(), threading.Event()

    def serve(request):
        begun.set()
        assert go.wait(PATIENCE)
        served.append(request)
        if request == "last":
            done.set()

    worker = LatestRequest(serve)
    worker.submit("first")
    assert begun.wait(PATIENCE)
    replaced = [worker.submit(name) for name in ("second", "third", "last")]
    go.set()
    assert done.wait(PATIENCE)
    assert served == ["first", "last"]
    assert replaced == [False, True, True]
    assert worker.close(PATIENCE)


def test_a_closed_worker_ends_without_serving_what_waits():
    served, begun, go = [], threading.Event(), threading.Event()

    def serve(request):
        begun.set()
        go.wait(PATIENCE)
        served.append(request)

    worker = LatestRequest(serve)
    worker.submit("first")
    assert begun.wait(PATIENCE)
    worker.submit("second")
    assert not worker.close(0.0)
    go.set()
    assert worker.close(PATIENCE)
    assert served == ["first"]


def test_submitting_does_not_wait_for_what_is_being_served():
    go, begun = threading.Event(), threading.Event()

    def serve(request):
        begun.set()
        go.wait(PATIENCE)

    worker = LatestRequest(serve)
    worker.submit("slow")
    assert begun.wait(PATIENCE)
    assert worker.submit("next") is False
    go.set()
    assert worker.close(PATIENCE)


def test_a_replaced_request_is_merged_into_the_one_that_replaces_it():
    served, begun, go, done = [], threading.Event(), threading.Event(), threading.Event()

    def serve(request):
        begun.set()
        assert go.wait(PATIENCE)
        served.append(request)
        if len(served) == 2:
            done.set()

    worker = LatestRequest(serve, merge=lambda old, new: new + old)
    worker.submit("a")
    assert begun.wait(PATIENCE)
    for name in "bcd":
        worker.submit(name)
    go.set()
    assert done.wait(PATIENCE)
    assert served == ["a", "dcb"]
    assert worker.close(PATIENCE)
