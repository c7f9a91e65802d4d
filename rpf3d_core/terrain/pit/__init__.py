"""The synthetic open pit: its design, its relief and its mesh."""
