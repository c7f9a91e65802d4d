"""Convert messages of the nodes to recordings for the viewer and to bags, live or from a stored bag."""
