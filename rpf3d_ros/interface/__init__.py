"""What other programs see of a node: topics with their quality of service, parameters and diagnostics."""
