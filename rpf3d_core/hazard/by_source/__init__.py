"""Counts of the rocks of each source in zones, areas and map cells and at barriers; the worst source of a place."""
