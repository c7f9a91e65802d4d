"""Write the result folder of a run: tables, maps, pictures and the summary."""
