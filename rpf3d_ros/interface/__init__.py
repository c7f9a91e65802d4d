"""The interface of a node: its topics with their quality of service, its parameters and its health."""
