"""`rpf3d sweep` compares designs: it makes a run for each combination of values of some keys of a scene."""
