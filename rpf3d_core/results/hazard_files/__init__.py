"""Write the hazard maps as GeoTIFF, GeoJSON and CSV, with the sentences on them."""
