"""Compare designs with `rpf3d sweep`: fly a run for each combination of values of some keys of a scene."""
