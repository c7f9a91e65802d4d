"""Readers of the files that mines have: DXF, LandXML, Surpac, OMF, clouds of points, GeoPackage and Shapefile."""
