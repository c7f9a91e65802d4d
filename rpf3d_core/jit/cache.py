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
PACKAGE = f"{__name__.partition('.')[0]}."
STUB = re.compile(r"^@model_function\ndef (\w+)", re.MULTILINE)
"""Matches the registration of a model function."""
RULE = re.compile(r"^@(\w+)\.(?:rule|otherwise)\b", re.MULTILINE)
"""Matches the registration of a rule of a model function."""
IMPORT = re.compile(r"^\s*from rpf3d_core([\w.]*) import (?:\(([^)]*)\)|([^#\n]*))", re.MULTILINE)

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
        with in_cache_folder(each.__module__) as usable:
            if usable:
                each.enable_caching()


def compiled_apart() -> list[str]:
    """Return all digests given to `compile_apart`, for another process that must use the same folder."""
    return sorted(_foreign)


def cache_folder(module: str) -> Path:
    """Return the folder for the compiled code of the loops of a module: one for each state of their sources."""
    digest = source_digest(module)
    if _foreign:
        digest += "-" + hashlib.sha256("".join(sorted(_foreign)).encode()).hexdigest()[:16]
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rpf3d" / digest


def is_cached(loop: Any, *classes: type) -> bool:
    """True if a loop is on disk, compiled for arguments of the given classes."""
    with suppress(OSError):
        found = cache_folder(loop.__module__).rglob(f"*.{loop.__name__}-*.nbi")
        return any(all(cls.__name__.encode() in index for cls in classes) for index in map(Path.read_bytes, found))
    return False


def keeps_compiled(loop: Any) -> bool:
    """True if the compiled code of a loop is kept on disk."""
    with in_cache_folder(loop.__module__) as usable:
        return usable


@contextmanager
def in_cache_folder(module: str) -> Iterator[bool]:
    """Point numba's cache at the folder for the loops of a module; yield whether the folder is usable.

    numba checks only the file of the decorated function: after an edit in a file that the function calls, stale code
    would run. If the folder is not writable, each process compiles again; numba's own choice of folder would lack this
    guard.
    """
    config: Any = numba.config if numba else None
    before = config.CACHE_DIR
    folder = cache_folder(module)
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    usable = os.access(folder, os.W_OK | os.X_OK)
    config.CACHE_DIR = str(folder) if usable else before
    try:
        yield usable
    finally:
        config.CACHE_DIR = before


def source_digest(module: str) -> str:
    """Return the first 16 hex digits of the SHA-256 of the source files that the loops of a module come from."""
    return _digest(SOURCES, module.removeprefix(PACKAGE).replace(".", "/"))


@lru_cache
def _digest(root: Path, file: str) -> str:
    digest, package = hashlib.sha256(), _package(root)
    for name in sorted(package.kernel_sources(file)):
        digest.update(name.encode() + package.texts[name].encode())
    return digest.hexdigest()[:16]


@lru_cache(maxsize=1)
def _package(root: Path) -> "PackageSources":
    return PackageSources(
        {path.relative_to(root).with_suffix("").as_posix(): path.read_text("utf-8") for path in root.rglob("*.py")}
    )


class PackageSources:
    """The sources of a package, and which of them the compiled code of a file depends on.

    texts : file of the package, without its suffix (`terrain/facets`) -> its source
    """

    def __init__(self, texts: Mapping[str, str]) -> None:
        """Find the files that register a model function, and those that register a rule."""
        self.texts = texts
        self._stubs = {name: set(STUB.findall(text)) for name, text in texts.items()}
        self._rules = {name: set(RULE.findall(text)) for name, text in texts.items()}
        known = set().union(*self._stubs.values())
        self._always = {name for name, rules in self._rules.items() if rules - known}

    def kernel_sources(self, file: str) -> set[str]:
        """Return the files that loops of a file can be compiled from; the file itself is one of them.

        These are the files that they import, directly or not, because compiled code keeps the values of the globals
        that it reads; and for each model function among them the files that register a rule for it. A rule of a name
        that no model function has may belong to any: it counts for all loops. A file outside the package may import
        all files.
        """
        if file not in self.texts:
            return set(self.texts)
        found = {file, *self._always}
        waiting = list(found)
        while waiting:
            name = waiting.pop()
            used = {each for each in _imported(self.texts[name]) if each in self.texts}
            if stubs := self._stubs[name]:
                used |= {each for each, rules in self._rules.items() if rules & stubs}
            waiting += used - found
            found |= used
        return found


def _imported(text: str) -> Iterator[str]:
    """Yield what a source imports from the package: files, or names in files; both look alike."""
    for match in IMPORT.finditer(text):
        package = match[1].strip(".").replace(".", "/")
        yield package
        for name in (match[2] or match[3]).split(","):
            yield f"{package}/{name.split(' as ')[0].strip()}".lstrip("/")
