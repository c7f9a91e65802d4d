"""Live simulation while a mine works: the terrain changes, many sources arrive at once, and answers must be fast."""
