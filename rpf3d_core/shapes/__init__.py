"""The shapes of rocks: convex polyhedra with their volume and moments of inertia, families of blocks, block files."""
