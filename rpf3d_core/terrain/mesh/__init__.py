"""Faults of a mesh and their repair: welding, winding, edges, borders."""
