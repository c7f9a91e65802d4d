"""Walk the track of a rock over cells and facets, and gather the rock's visits to them."""
