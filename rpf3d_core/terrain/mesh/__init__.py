"""Find and repair the faults of a mesh: welding, winding, edges, borders."""
