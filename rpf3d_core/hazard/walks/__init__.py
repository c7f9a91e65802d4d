"""Follow the path of a rock over map cells and facets, and record the rock's visit to each of them."""
