"""The commands of `rpf3d`, one file for each command; `cli.py` combines them into the program."""
