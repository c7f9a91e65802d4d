"""Builders of models and effects whose parameters are not mere copies of numbers in the scene."""
