"""The disk cache of compiled code, and the sources that it depends on."""

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

numba: ModuleType | None
try:
    import numba
except ImportError:
    numba = None

SOURCES = Path(__file__).parents[1]
"""The package whose sources are compiled."""
MARK = re.compile(r"^@(?:kernel|loop|guarded|model_function|\w+\.(?:rule|otherwise))\b", re.MULTILINE)
"""Matches a decorator that registers a function for compiled code."""
IMPORT = re.compile(r"^\s*from rpf3d_core([\w.]*) import (?:\(([^)]*)\)|(.*))$", re.MULTILINE)

LOOPS: list[Any] = []
"""All loops, so that `compile_apart` can change the cache folder of each."""
_foreign: set[str] = set()
"""Digests of user code that kernels call."""


def compile_apart(digest: str) -> None:
    """Keep all code compiled from here on in a separate folder, because kernels call code with another digest.

    Otherwise an edit in that code would go unnoticed, and a process that has not loaded that code could not read the
    index.
    """
    _foreign.add(digest)
    for each in LOOPS:
        with in_cache_folder() as usable:
            if usable:
                each.enable_caching()


def compiled_apart() -> list[str]:
    """Return all digests given to `compile_apart`, for another process that must use the same folder."""
    return sorted(_foreign)


def cache_folder() -> Path:
    """Return the folder for the compiled code of these sources."""
    digest = source_digest()
    if _foreign:
        digest += "-" + hashlib.sha256("".join(sorted(_foreign)).encode()).hexdigest()[:16]
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rpf3d" / digest


def is_cached(function: str, *classes: type) -> bool:
    """True if a `loop` function of this name is on disk, compiled for arguments of the given classes."""
    with suppress(OSError):
        indexes = [path.read_bytes() for path in cache_folder().rglob(f"*.{function}-*.nbi")]
        return any(all(cls.__name__.encode() in index for cls in classes) for index in indexes)
    return False


def keeps_compiled() -> bool:
    """True if compiled code is kept on disk."""
    with in_cache_folder() as usable:
        return usable


@contextmanager
def in_cache_folder() -> Iterator[bool]:
    """Point numba's cache at a folder named after the sources; yield whether the folder is usable.

    numba checks only the file of the decorated function: after an edit in a file that the function calls, stale code
    would run. If the folder is not writable, each process compiles again; numba's own choice of folder would lack this
    guard.
    """
    config: Any = numba.config if numba else None
    before = config.CACHE_DIR
    folder = cache_folder()
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    usable = os.access(folder, os.W_OK | os.X_OK)
    config.CACHE_DIR = str(folder) if usable else before
    try:
        yield usable
    finally:
        config.CACHE_DIR = before


def source_digest() -> str:
    """Return the first 16 hex digits of the SHA-256 of the source files that compiled code comes from."""
    return _digest(SOURCES)


@lru_cache
def _digest(root: Path) -> str:
    digest = hashlib.sha256()
    texts = {path.relative_to(root).with_suffix("").as_posix(): path.read_text("utf-8") for path in root.rglob("*.py")}
    for name in sorted(kernel_sources(texts)):
        digest.update(name.encode() + texts[name].encode())
    return digest.hexdigest()[:16]


def kernel_sources(texts: Mapping[str, str]) -> set[str]:
    """Return the files that register compiled functions, and all files that these import, directly or not.

    Compiled code keeps the values of the globals that it reads, so an edit in an imported file counts as well.

    Parameters
    ----------
    texts : file of the package, without its suffix (`terrain/facets`) -> its source
    """
    found = {name for name, text in texts.items() if MARK.search(text)}
    waiting = list(found)
    while waiting:
        new = {name for name in _imported(texts[waiting.pop()]) if name in texts} - found
        found |= new
        waiting += new
    return found


def _imported(text: str) -> Iterator[str]:
    """Yield what a source imports from the package: files, or names in files; both look alike."""
    for match in IMPORT.finditer(text):
        package = match[1].strip(".").replace(".", "/")
        yield package
        for name in (match[2] or match[3]).split(","):
            yield f"{package}/{name.split(' as ')[0].strip()}".lstrip("/")
