"""Find which nodes have a client of a service, because ROS does not report which node has called the service."""

from rclpy.node import Node, NodeNameNonExistentError


def clients_of(node: Node, service: str) -> str:
    """Return the nodes that have a client of a service now, each with its enclave, as text; "" if none is known.

    The enclave is the identity of a node under SROS2; without security it is "/".

    service : full name of the service
    """
    found = []
    for name, namespace, enclave in node.get_node_names_and_namespaces_with_enclaves():
        try:
            services = node.get_client_names_and_types_by_node(name, namespace)
        except (NodeNameNonExistentError, RuntimeError):  # the node has just left
            continue
        if any(each == service for each, _kinds in services):
            found.append(f"{namespace.rstrip('/')}/{name} (enclave {enclave})")
    return ", ".join(sorted(found))
