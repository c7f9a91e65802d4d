"""The demo of a shift: nodes as processes on a simulated clock."""
