"""What makes the parameters of a model or an effect from a scene where there is more to it than copying numbers."""
