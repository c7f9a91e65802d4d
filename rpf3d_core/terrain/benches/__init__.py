"""A parametric slope of bench faces and berms, for studies of catch benches without a mesh file."""
