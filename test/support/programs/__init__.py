"""Start commands, the desk, browsers and second processes; wait for them, look at them and end them."""
