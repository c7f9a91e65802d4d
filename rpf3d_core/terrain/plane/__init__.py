"""Geometry in a plane: convex hulls, and regions divided into triangles."""
