"""Prepare a scene for a run: read its files, build terrain, sources, models and maps, and refuse wrong input."""
