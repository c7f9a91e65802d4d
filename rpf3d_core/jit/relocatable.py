"""Let all installed copies of one version of the package share the disk cache of compiled code.

numba puts the path of the source file into the path of its cache, so that a new workspace, container or checkout would
compile everything again. After an edit of a docstring, numba would compile the functions of the file again, too. The
folder of `cache.py` is already chosen by the code in the sources, so neither the place of the sources nor their text
need count. This file depends on numba's internals: if the internals change, the import of this file fails,
and `cache.py` works without this file.
"""

from pathlib import Path
from typing import Any

import numba
from numba.core.caching import CacheImpl, UserProvidedCacheLocator

PACKAGE = f"{__name__.partition('.')[0]}."


class ByModule(UserProvidedCacheLocator):
    """Cache location of a module's compiled code: a folder named after the module and the version of numba.

    Modules outside the package keep numba's default location, because modules of different projects may have the same
    name. Each version of numba has a separate folder, so that two versions never replace each other's code.
    """

    def __init__(self, py_func: Any, py_file: str) -> None:
        """Choose the cache folder of the function `py_func`, which is defined in the file `py_file`."""
        super().__init__(py_func, py_file)  # type: ignore[no-untyped-call]
        config: Any = numba.config
        self._cache_path = str(Path(config.CACHE_DIR) / f"{py_func.__module__}-numba-{numba.__version__}")

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "ByModule | None":
        """Return the place of a function of the package; None for other functions, or if the folder is not writable."""
        if not py_func.__module__.startswith(PACKAGE):
            return None
        found: ByModule | None = super().from_function(py_func, py_file)  # type: ignore[no-untyped-call]
        return found

    def get_source_stamp(self) -> str:
        """Return the same stamp for all versions of the source file: each version of its code has its own folder."""
        return ""

    def get_disambiguator(self) -> str:
        """Return the same text for all lines of a file: no two compiled functions of a file have the same name."""
        return ""


if not isinstance(getattr(CacheImpl, "_locator_classes", None), list):
    raise ImportError(f"numba's {CacheImpl.__name__} has no list of places any more")
CacheImpl._locator_classes.insert(0, ByModule)
