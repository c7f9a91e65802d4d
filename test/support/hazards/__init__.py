"""Hazard maps and tallies, computed a second time without the code of the simulator."""
