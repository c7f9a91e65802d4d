"""The threads of the simulator: they take in messages, build ground, fly rocks and decide on alerts."""
