"""The threads of the simulator: what waits, what builds ground, what flies, what decides."""
