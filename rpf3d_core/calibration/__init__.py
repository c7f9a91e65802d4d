"""Calibrate the unknown parameters of a scene on field data, and judge the result."""
