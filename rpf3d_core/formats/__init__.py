"""Readers and writers of files that know nothing of a scene."""
