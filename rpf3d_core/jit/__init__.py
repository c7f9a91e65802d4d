"""Compilation: physics written once, run by Python or compiled by numba."""
