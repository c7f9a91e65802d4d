"""Hazard: where rocks pass and where they stop."""
