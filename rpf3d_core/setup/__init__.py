"""From a scene to what flies: terrain, sources, materials, models and maps."""
