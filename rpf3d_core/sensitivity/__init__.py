"""Which unknown of a scene moves which result: screening by Morris, and shares of the variance by Sobol."""
