"""Import the libraries of the extra `report`, which only reports need."""

import importlib
from typing import Any

from rpf3d_core.errors import InputError


def needed(module: str) -> Any:
    """Return a module of a library that writes reports, such as "plotly.graph_objects".

    Raises
    ------
    InputError
        The library is not installed; the message states how to install it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as fault:
        library = module.partition(".")[0]
        raise InputError(f"a report needs the library {library}, which is not installed ({fault}); install it with: "
                         "pip install 'rpf3d[report]'") from fault  # fmt: skip
