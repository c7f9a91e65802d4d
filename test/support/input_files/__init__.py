"""Small input files of every format, also damaged ones."""
