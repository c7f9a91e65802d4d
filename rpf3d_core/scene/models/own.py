"""Models and effects of users: a class in a file outside the package, named in the scene by its import path.

rpf3d looks for the module next to the scene file, then on Python's module path. docs/howto/own-models.md shows an
example.
"""

import hashlib
import importlib.util
import inspect
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field, ValidationInfo, model_validator

from rpf3d_core.jit.cache import compile_apart
from rpf3d_core.scene.models.spec import Confirmed, ModelSpec
from rpf3d_core.scene.values import Name, Number, refuse


class OwnSpec(ModelSpec):
    """A user-defined model or effect: the class at an import path, with numbers as parameters."""

    PHYSICS: ClassVar[str] = ""
    SOURCE: ClassVar[str] = "the user's own"
    CONFIRMED: ClassVar[Confirmed] = "UNCONFIRMED"

    path: Name = Field(description="the import path module.Class of a class of your own")
    file: Path = Field(description="the file of that module")
    values: Mapping[str, Number] = Field(default_factory=dict, description="numbers, by the names of its parameters")

    @model_validator(mode="before")
    @classmethod
    def _found(cls, given: Any, info: ValidationInfo) -> Any:
        """Return the given fields and the `file` of the user's class, after a check of the class and its parameters."""
        path, values = given["path"], given["values"]
        module, _, _ = path.rpartition(".")
        file = _file_of(module, (info.context or {}).get("folder", Path()))
        _check_values(path, _class_at(path, file), values)
        return {**given, "file": file}

    def physics(self) -> type:
        """Return the user's class from its file; the file is run again if its content has changed."""
        return _class_at(self.path, self.file)  # type: ignore[no-any-return]

    def made(self) -> Any:
        """Return an object of the user's class with all parameters as floats, because compiled code needs one type."""
        return self.physics()(**{name: float(value) for name, value in self.values.items()})


def _class_at(path: str, file: Path) -> Any:
    """Return the user's class (a NamedTuple) at an import path, from the file of its module.

    Raises
    ------
    PydanticCustomError
        The file cannot be run, or does not contain a NamedTuple with this name.
    """
    module, _, name = path.rpartition(".")
    own = getattr(_loaded(module, file), name, None)
    if own is None:
        raise refuse(f"names {path!r}, but {file.name} has no {name!r}")
    if not (inspect.isclass(own) and issubclass(own, tuple) and hasattr(own, "_fields")):
        raise refuse(f"names {path!r}, which is no NamedTuple of numbers")
    return own


def _check_values(path: str, own: Any, values: Any) -> None:
    """Raise a PydanticCustomError for unknown or missing parameters of a user's class, or values that are not numbers.

    path : import path of the class, for the message; own : the class; values : values of the parameters, by name
    """
    if not isinstance(values, dict):
        raise refuse(f"gives {path} {values!r}, but must give a mapping of its parameters to numbers")
    for name, value in values.items():
        if name not in own._fields:
            raise refuse(f"gives {path} a {name!r}; it has no such parameter, but {', '.join(own._fields) or 'none'}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise refuse(f"gives {path} {value!r} as {name}, which must be a number")
    missing = [name for name in own._fields if name not in values and name not in own._field_defaults]
    if missing:
        raise refuse(f"names {path} without {', '.join(missing)}; write {{{path}: {{{missing[0]}: ...}}}}")


def _file_of(module: str, folder: Path) -> Path:
    """Return the file of a user's module, next to the scene file or on Python's module path.

    Raise a PydanticCustomError if there is no such file.

    folder : folder of the scene file
    """
    beside = folder.joinpath(*module.split(".")).with_suffix(".py")
    if beside.is_file():
        return beside.absolute()
    try:
        found = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        found = None
    if found is None or found.origin is None or not found.origin.endswith(".py"):
        raise refuse(f"names the module {module!r}, but it is neither {beside} nor where Python looks")
    return Path(found.origin)


def _loaded(name: str, file: Path) -> Any:
    """Return the user's module from its file; the file is run again if its content has changed.

    The module is put into `sys.modules`. From then on, compiled code is stored in a cache folder for this content of
    the file (`jit.cache.compile_apart`). Raise a PydanticCustomError if the file cannot be run.
    """
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    there = sys.modules.get(name)
    if getattr(there, "RPF3D_DIGEST", None) == digest:
        return there
    specification = importlib.util.spec_from_file_location(name, file)
    if specification is None or specification.loader is None:
        raise refuse(f"names {file.name}, which is no Python file")
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module  # numba finds the classes of compiled code by the names of their modules
    try:
        specification.loader.exec_module(module)
    except Exception as fault:
        del sys.modules[name]
        raise refuse(f"names {file.name}, which cannot be run: {type(fault).__name__}: {fault}") from fault
    module.RPF3D_DIGEST = digest  # type: ignore[attr-defined]
    compile_apart(digest)
    return module


OWN = "[own]"
"""Mark of users' classes in key paths of pydantic; messages do not show it."""


def is_own(name: Any) -> bool:
    """Return True if a name in a scene has the form of an import path of a user's class, such as `sand.Sand`."""
    return isinstance(name, str) and all(part.isidentifier() for part in name.split(".")) and "." in name
