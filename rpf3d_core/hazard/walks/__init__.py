"""Walk the track of a rock over cells and facets, and gather what it does there."""
