"""Builders: they make the models and effects of a scene that need more than copies of numbers in the scene."""
