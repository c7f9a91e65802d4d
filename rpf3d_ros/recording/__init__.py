"""Messages to recordings and bags, live or afterwards."""
