"""Models and effects that a scene may name, and the bounds of their parameters."""
