"""Convert messages to recordings and bags, live or from a stored bag."""
