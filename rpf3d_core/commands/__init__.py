"""The commands of `rpf3d`, a file each; `cli.py` has them all and the way in."""
