"""Write formal reports of runs: one HTML file with a rotatable 3D view of the terrain, and a PDF with the same content.

The PDF has a sentence in place of the 3D view.
"""
