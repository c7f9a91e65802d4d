"""From a scene to everything that a run needs: terrain, sources, materials, models and maps."""
