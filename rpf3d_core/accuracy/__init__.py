"""The price list of accuracy: how far off each setting is on a user's own scene, and what it costs."""
