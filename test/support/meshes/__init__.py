"""Random meshes with hard places, and independent checks that no rock passes through them."""
