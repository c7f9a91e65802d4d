"""Import the libraries of the extra `report`, which only reports need."""

from typing import Any

from rpf3d_core.formats.extras import library_of


def needed(module: str) -> Any:
    """Return a module of a library that writes reports, such as "plotly.graph_objects".

    Raises
    ------
    InputError
        The library is not installed; the message states how to install it.
    """
    return library_of("report", module, "a report needs")
