"""`rpf3d sweep`: designs side by side: a run for each combination of values of some keys of a scene."""
