"""Readers and writers of file formats (terrain, grids, points, polygons, YAML), independent of scenes."""
