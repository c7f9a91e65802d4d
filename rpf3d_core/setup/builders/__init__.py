"""Models and effects that take more to build than copying numbers from the scene."""
