"""Run, check and compare scenes, in one process or in several processes."""
