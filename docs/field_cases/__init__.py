"""The validation page: field cases, the models that fly on them, the search that calibrates them, and the text."""
