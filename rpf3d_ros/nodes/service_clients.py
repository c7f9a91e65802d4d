"""Find which nodes have a client of a service, because ROS does not report which node has called the service."""

import time

from rclpy.node import Node, NodeNameNonExistentError

PATIENCE = 0.2
"""Longest time (s) to wait for a first node, because a request may arrive before ROS reports its sender."""

LOOK = 0.02
"""Time (s) between two looks at the nodes."""


def clients_of(node: Node, service: str) -> str:
    """Return the nodes that have a client of a service now, each with its enclave, as text; "" if none is known.

    The enclave is the identity of a node under SROS2; without security it is "/". If no node is known, wait for one,
    at most PATIENCE seconds.

    service : full name of the service
    """
    until = time.monotonic() + PATIENCE
    while not (found := _clients_now(node, service)) and time.monotonic() < until:
        time.sleep(LOOK)
    return ", ".join(sorted(found))


def _clients_now(node: Node, service: str) -> list[str]:
    found = []
    for name, namespace, enclave in node.get_node_names_and_namespaces_with_enclaves():
        try:
            services = node.get_client_names_and_types_by_node(name, namespace)
        except (NodeNameNonExistentError, RuntimeError):  # the node has just left
            continue
        if any(each == service for each, _kinds in services):
            found.append(f"{namespace.rstrip('/')}/{name} (enclave {enclave})")
    return found
