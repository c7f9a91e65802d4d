"""Readers and writers of file formats, independent of scenes."""
