"""Lists of what a scene may hold: the catalogue of models and effects, the fields, and the JSON Schema."""
