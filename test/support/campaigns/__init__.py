"""The programs of the campaigns of the Makefile, except never_green: run one with `python -m campaigns.NAME`."""
