"""Functions that build the models and effects of a scene, if copies of the scene's numbers are not enough."""
