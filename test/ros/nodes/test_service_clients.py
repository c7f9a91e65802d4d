"""Tests that the caller of a service is found for the decision log, even if the middleware lists it with a delay."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.nodes import service_clients
from rpf3d_ros.nodes.service_clients import clients_of

SERVICE = "/rpf3d_simulator/acknowledge"


class Graph:
    """Stands in for a node that lists the caller of a service only from the `known`-th query on."""

    def __init__(self, known):
        self.looks, self.known = 0, known

    def get_node_names_and_namespaces_with_enclaves(self):
        self.looks += 1
        callers = [("rpf3d_acknowledge", "/pit_a", "/")] if self.looks >= self.known else []
        return [("rpf3d_simulator", "/pit_a", "/"), *callers]

    def get_client_names_and_types_by_node(self, name, namespace):
        return [(SERVICE, ["std_srvs/srv/Trigger"])] if name == "rpf3d_acknowledge" else []


@pytest.mark.parametrize("known", [1, 3])
def test_a_caller_is_named_as_soon_as_it_is_known(known):
    graph = Graph(known)
    assert clients_of(graph, SERVICE) == "/pit_a/rpf3d_acknowledge (enclave /)"
    assert graph.looks == known


def test_a_caller_that_is_never_known_has_no_name_and_holds_up_the_node_for_a_moment_only(monkeypatch):
    times = iter([0.0, *(0.05 * step for step in range(1, 100))])
    monkeypatch.setattr(service_clients.time, "monotonic", lambda: next(times))
    monkeypatch.setattr(service_clients.time, "sleep", lambda seconds: None)
    graph = Graph(known=1000)
    assert clients_of(graph, SERVICE) == ""
    assert graph.looks <= 5
