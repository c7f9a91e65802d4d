"""The demo: five minutes of a working shift in a mine; the nodes run as processes on a simulated clock."""
