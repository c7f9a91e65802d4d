"""Calibrate unknown parameters on field data, and measure which unknown moves which result."""
