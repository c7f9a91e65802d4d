"""The price list of accuracy: the error of each setting on a user's own scene, and its cost."""
