"""Hazard maps: where rocks pass and stop, with how much energy, counted while the rocks fly."""
