"""Import the libraries of the optional extras of the package, which some commands and formats need."""

import importlib
from typing import Any

from rpf3d_core.errors import InputError


def library_of(extra: str, module: str, user: str, fault: type[InputError] = InputError) -> Any:
    """Return a module of a library that an extra installs, such as "plotly.graph_objects".

    user : first words of the message, which state what needs the library, such as "a report needs"
    fault : class of the error to raise, `InputError` or a class derived from it

    Raises
    ------
    InputError
        The library is not installed; the message states how to install it. The class of the error is `fault`.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise fault(
            f"{user} the library {module.partition('.')[0]}, which is not installed ({error}); install it with: "
            f"pip install 'rpf3d[{extra}]'"
        ) from error
