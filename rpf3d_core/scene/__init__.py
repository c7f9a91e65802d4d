"""The scene file: its sections, its models and effects, and what is wrong with it."""
