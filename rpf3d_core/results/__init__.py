"""The folder that a run writes: tables, maps, pictures and the summary."""
