"""Write small valid files in formats that mines use, where possible with a library that rpf3d does not contain."""

from pathlib import Path

import numpy as np

EAST, NORTH = 457_000.0, 7_654_000.0
"""Easting and northing (m) of the terrains in these files: in UTM zone 19 south, EPSG:32719."""


def at_site(vertices: np.ndarray) -> np.ndarray:
    """Return vertices (V, 3) m moved to survey coordinates, rounded to the millimetre."""
    return np.round(vertices + np.array([EAST, NORTH, 800.0]), 3)


def write_dxf(path: Path, vertices: np.ndarray, triangles: np.ndarray, units: int = 6) -> Path:
    """Write a mesh as 3DFACE entities of a DXF file, alternately on the layers wall and floor, with ezdxf.

    units : value of $INSUNITS, 6 for metres
    """
    import ezdxf

    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = units
    for k, corners in enumerate(vertices[triangles]):
        document.modelspace().add_3dface(corners, dxfattribs={"layer": ("wall", "floor")[k % 2]})
    document.saveas(path)
    return path


def write_dxf_layers(path: Path, faces: list[tuple[str, list[tuple[float, float, float]]]]) -> Path:
    """Write quadrangles as 3DFACE entities of a DXF file, with ezdxf; faces : pairs of a layer and the corners (m)."""
    import ezdxf

    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 6
    for layer, corners in faces:
        document.modelspace().add_3dface(corners, dxfattribs={"layer": layer})
    document.saveas(path)
    return path


def write_landxml(path: Path, vertices: np.ndarray, triangles: np.ndarray, name: str = "topo") -> Path:
    """Write a mesh as a TIN surface of a LandXML file, which has the northing first; name : surface name."""
    points = "".join(f'<P id="{i}">{y!r} {x!r} {z!r}</P>\n' for i, (x, y, z) in enumerate(vertices.tolist(), start=1))
    faces = "".join(f"<F>{a + 1} {b + 1} {c + 1}</F>\n" for a, b, c in triangles.tolist())
    path.write_text(
        '<?xml version="1.0"?>\n<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2">\n'
        '<Units><Metric linearUnit="meter"/></Units>\n<CoordinateSystem epsgCode="32719"/>\n'
        f'<Surfaces><Surface name="{name}"><Definition surfType="TIN">\n<Pnts>\n{points}</Pnts>\n<Faces>\n{faces}'
        "</Faces></Definition></Surface></Surfaces></LandXML>\n"
    )
    return path


def write_surpac(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    """Write a mesh as a .dtm file of Surpac and the .str file of its points, which has the northing first."""
    points = "".join(f"32000, {y:.3f}, {x:.3f}, {z:.3f},\n" for x, y, z in vertices.tolist())
    path.with_suffix(".str").write_text(
        f"{path.stem}, 24-Nov-26,,points\n0, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000\n{points}"
        "0, 0.000, 0.000, 0.000,\n0, 0.000, 0.000, 0.000, END\n"
    )
    rows = "".join(f"{k}, {a + 1}, {b + 1}, {c + 1}, 0, 0, 0,\n" for k, (a, b, c) in enumerate(triangles.tolist(), 1))
    path.write_text(
        f"{path.stem}.str,\n0, 0.000, 0.000, 0.000, END\nOBJECT, 1,\n"
        f"TRISOLATION, 1, neighbours=no,validated=true,closed=no\n{rows}END\n"
    )
    return path


def write_omf(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    """Write a mesh as the surface `topo` of an OMF 1 file, with the library omf."""
    import omf

    geometry = omf.SurfaceGeometry(vertices=vertices - [EAST, NORTH, 0.0], triangles=triangles)
    project = omf.Project(name="site", origin=[EAST, NORTH, 0.0])
    project.elements = [omf.SurfaceElement(name="topo", geometry=geometry)]
    omf.OMFWriter(project, str(path))
    return path


def write_las(path: Path, points: np.ndarray, classes: np.ndarray | None = None, crs: int | None = None) -> Path:
    """Write points (N, 3) m as a LAS or LAZ file, depending on the extension, with laspy.

    classes : (N,) class of each point, None for no classes; crs : EPSG code, None for no reference system
    """
    import laspy

    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = np.floor(points.min(axis=0)), [0.001] * 3
    if crs is not None:
        from pyproj import CRS

        header.add_crs(CRS.from_epsg(crs))
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    if classes is not None:
        data.classification = classes
    data.write(str(path))
    return path


def write_e57(path: Path, points: np.ndarray) -> Path:
    """Write points (N, 3) m as one scan of an E57 file, in single precision, with pye57."""
    import pye57

    file = pye57.E57(str(path), mode="w")
    columns = {f"cartesian{axis}": np.ascontiguousarray(points[:, k]) for k, axis in enumerate("XYZ")}
    file.write_scan_raw(columns)
    file.close()
    return path


def write_vector(
    path: Path, shapes: list[object], crs: str | None = "EPSG:32719", layer: str = "areas", kind: str = "Polygon"
) -> Path:
    """Write shapely geometries as a GeoPackage or Shapefile with pyogrio; an existing GeoPackage gets a new layer.

    kind : kind of geometry of a layer without shapes
    """
    import pyogrio
    import shapely

    kinds = {shapely.get_type_id(shape): shape.geom_type for shape in shapes}  # type: ignore[attr-defined]
    has_z = any(shapely.has_z(shapes))
    pyogrio.raw.write(
        path, geometry=shapely.to_wkb(np.array(shapes, dtype=object), flavor="iso"), field_data=[], fields=[],
        geometry_type=next(iter(kinds.values()), kind) + " Z" * has_z, crs=crs,
        **({"layer": layer, "append": path.exists()} if path.suffix == ".gpkg" else {}),
    )  # fmt: skip
    return path
