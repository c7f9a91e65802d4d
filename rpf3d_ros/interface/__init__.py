"""What a node shows to the outside: its topics and how they are offered, its parameters and its health."""
