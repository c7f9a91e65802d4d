"""Tests that the exit code of rpf3d_acknowledge distinguishes an unknown result from a missing answer."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import rclpy.node

from rpf3d_core.errors import InputError
from rpf3d_ros.nodes import acknowledge

WORDS = ["A. Foreman", "the slope was inspected", "--node", "/rpf3d_simulator"]


class Clients:
    """A node whose services are all there."""

    def __init__(self, *_, **__):
        pass

    def create_client(self, *_):
        return SimpleNamespace(wait_for_service=lambda seconds: True, call_async=lambda request: None)


@pytest.mark.parametrize(("answers", "code"), [(0, 2), (1, acknowledge.NOT_YET), (2, 0)])
def test_an_acknowledgement_without_a_reply_is_not_known_and_not_unsent(monkeypatch, capsys, answers, code):
    """The first answer is that of the parameter with the person's name, the second that of the acknowledgement."""
    taken = SimpleNamespace(results=[SimpleNamespace(successful=True)], success=True, message="lowered to normal")
    received = [taken] * answers

    def answer(node, asked, options):
        if not received:
            raise InputError("/rpf3d_simulator has not answered within 5 s: see alerts for the result")
        return received.pop()

    monkeypatch.setattr(rclpy.node, "Node", Clients)
    monkeypatch.setattr(acknowledge, "_answer", answer)
    assert acknowledge.main(WORDS) == code
    assert ("has not answered" in capsys.readouterr().err) == (code != 0)
