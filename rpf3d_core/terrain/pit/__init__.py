"""The synthetic open pit, for demos and tests: its design, its relief and its mesh."""
