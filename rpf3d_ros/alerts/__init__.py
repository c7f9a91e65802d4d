"""The evidence of each topic and wall, the faults of the inputs, and the thread that decides on alerts."""
