"""Rocks with a shape on the validation page: their shapes, the search that calibrates them, and the three sites."""
