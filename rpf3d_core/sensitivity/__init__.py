"""Measure how much each unknown of a scene affects each result, by the methods of Morris and of Sobol."""
