"""The coordinate reference system that a scene names, as georeferenced files need it."""

from rasterio.crs import CRS
from rasterio.errors import CRSError

from rpf3d_core.errors import InputError
from rpf3d_core.terrain.frame import Up


def reference_system(name: str | None, up: Up) -> CRS | None:
    """The reference system of plan coordinates in the input's own axes; None where the scene names none.

    None with `up: y` as well: plan coordinates are x and z there, z runs south, and no reference system has such axes.

    Raises
    ------
    InputError
        The name is not known, or is one of degrees.
    """
    if name is None:
        return None
    try:
        system = CRS.from_user_input(name)
    except CRSError as fault:
        raise InputError(
            f"terrain.crs is {name!r}, which is no known coordinate reference system; give one such as EPSG:31287"
        ) from fault
    if system.is_geographic:
        raise InputError(f"terrain.crs is {name!r}, which is in degrees; the terrain is in metres, and so must it be")
    return system if up == "z" else None
