"""Hazard: where rocks pass and where they come to rest."""
