"""The scene file: its sections, its models and effects, and its faults."""
