"""Live simulation while a mine works: terrain changes, many sources arrive together, and answers must be fast."""
