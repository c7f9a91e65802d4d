"""Run, check and compare scenes, in one process or over many."""
