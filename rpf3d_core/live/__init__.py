"""Live simulation while a mine works: the ground changes, sources come in bursts, and the first answer cannot wait."""
