"""Counts of the rocks of each parameter set in zones, areas and map cells and at barriers, and their intervals."""
