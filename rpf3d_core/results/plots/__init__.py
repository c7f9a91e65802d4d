"""Draw every picture of results: maps, profiles, sections, hazard, convergence, cost, calibration, sweep."""
