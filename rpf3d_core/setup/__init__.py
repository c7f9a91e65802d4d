"""Prepare a scene for a run: terrain, sources, materials, models and maps."""
