"""Lists of what a scene may contain: the catalogue of models and effects, the fields, and the JSON Schema."""
