"""What is not known about a site: parameter sets, how they are drawn, and what they do to the intervals of a result."""
