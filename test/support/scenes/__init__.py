"""Scene files for tests: a small pit, benches, sweeps; and price lists of a scene's accuracy."""
