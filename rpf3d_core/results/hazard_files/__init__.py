"""Write the hazard maps as GeoTIFF, GeoJSON and CSV, and make the sentences about the maps for the user."""
