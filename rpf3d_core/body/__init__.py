"""The mechanics of a rigid convex body: rotation in free flight, distances to facets, impacts at several contacts."""
