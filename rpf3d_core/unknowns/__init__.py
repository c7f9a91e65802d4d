"""Unknown values of a site: parameter sets, how they are drawn, and how they widen the intervals of results."""
