"""What is wrong with a mesh, and its repair: welding, winding, edges, borders."""
