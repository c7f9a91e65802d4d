"""Reports of runs to hand in: one HTML file with a rotatable 3D view of the terrain, and a PDF with equal content."""
