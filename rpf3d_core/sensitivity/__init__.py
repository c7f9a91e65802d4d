"""Which unknown of a scene affects which result: screening by Morris, and shares of the variance by Sobol."""
