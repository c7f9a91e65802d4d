"""Live simulation while a mine works: the ground changes, many sources arrive at once, and answers must be fast."""
