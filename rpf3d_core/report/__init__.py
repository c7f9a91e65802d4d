"""Reports of runs to hand in: one HTML file with a view of the terrain to turn, and the same as PDF."""
