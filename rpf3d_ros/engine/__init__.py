"""The threads of the simulator: they receive messages, build the terrain, fly rocks and decide on alerts."""
