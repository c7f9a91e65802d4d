"""The interface of the nodes to other programs: topics with their quality of service, parameters and diagnostics."""
