"""Draw every picture of results: maps, profiles, sections, hazard, convergence, price list, calibration, sweep."""
