"""Measure how accurate each setting is on a user's own scene, and what it costs: the price list of `rpf3d cost`."""
