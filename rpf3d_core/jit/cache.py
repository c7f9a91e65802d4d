"""The disk cache of compiled code, and the source files that the compiled code depends on."""

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

numba: ModuleType | None
try:
    import numba
except ImportError:
    numba = None
with suppress(ImportError):  # a numba release may break `relocatable`; each copy of the package then has its own cache
    from rpf3d_core.jit import relocatable  # noqa: F401
fcntl: ModuleType | None
try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None

SOURCES = Path(__file__).parents[1]
"""Folder of the package whose sources are compiled."""
PACKAGE = f"{__name__.partition('.')[0]}."
STUB = re.compile(r"^@model_function\ndef (\w+)", re.MULTILINE)
"""Pattern that finds the registration of a model function in a source file."""
RULE = re.compile(r"^@(\w+)\.(?:rule|otherwise)\b", re.MULTILINE)
"""Pattern that finds the registration of a rule of a model function in a source file."""
DOCSTRING = re.compile(r'^[ \t]*r?"""(?s:.*?)"""\s*', re.MULTILINE)
"""Pattern of docstrings, which are strings in triple quotes at the beginning of a line, and the space after them."""
IMPORT = re.compile(r"^\s*from rpf3d_core([\w.]*) import (?:\(([^)]*)\)|([^#\n]*))", re.MULTILINE)

LOOPS: list[Any] = []
"""All compiled loops, so that `compile_apart` can change the cache folder of each."""
_foreign: set[str] = set()
"""Digests of the user's own models that compiled code calls; such code has a separate cache folder."""


def compile_apart(digest: str) -> None:
    """Store all code compiled from now on in a separate cache folder, because this code calls the user's own code.

    In the common folder, numba would not notice an edit of the user's code, and a process without the user's code could
    not read the index of the cache.

    digest : of the user's code, which selects the folder
    """
    _foreign.add(digest)
    for each in LOOPS:
        with in_cache_folder(each.__module__) as usable:
            if usable:
                each.enable_caching()
                save_in_turn(each)


def save_in_turn(loop: Any) -> None:
    """Make processes store the compiled code of a loop one after another, with a lock file next to numba's index.

    numba takes no lock. Two processes that store code for different argument types at the same time could choose the
    same file. Later calls with one type would then run the code compiled for the other type.
    """
    files = getattr(getattr(loop, "_cache", None), "_cache_file", None)
    index = getattr(files, "_index_path", None)
    if files is None or index is None or fcntl is None:
        return
    save = files.save

    def save_alone(key: Any, data: Any) -> None:
        with ExitStack() as stack:
            with suppress(OSError):  # some network folders have no locks, and another user may own the file
                lock = stack.enter_context(Path(f"{index}.lock").open("a"))
                fcntl.flock(lock, fcntl.LOCK_EX)
            save(key, data)

    files.save = save_alone


def compiled_apart() -> list[str]:
    """Return all digests given to `compile_apart`, so that another process can use the same cache folder."""
    return sorted(_foreign)


def cache_folder(module: str) -> Path:
    """Return the disk cache folder for the loops of a module; each version of its source files has its own folder."""
    digest = source_digest(module)
    if _foreign:
        digest += "-" + hashlib.sha256("".join(sorted(_foreign)).encode()).hexdigest()[:16]
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rpf3d" / digest


def is_cached(loop: Any, *classes: type) -> bool:
    """Return True if the disk cache has compiled code of a loop for arguments of given classes, so that a call is fast.

    classes : classes that must be among the argument types, such as the classes of the models; without classes, any
        compiled code of the loop counts
    """
    with suppress(OSError):
        found = cache_folder(loop.__module__).rglob(f"*.{loop.__name__}-*.nbi")
        return any(all(cls.__name__.encode() in index for cls in classes) for index in map(Path.read_bytes, found))
    return False


def keeps_compiled(loop: Any) -> bool:
    """Return True if the compiled code of a loop can be stored in the disk cache for the next process."""
    with in_cache_folder(loop.__module__) as usable:
        return usable


@contextmanager
def in_cache_folder(module: str) -> Iterator[bool]:
    """Make numba use the folder of `cache_folder` for the loops of a module; yield True if the folder is usable.

    numba itself checks only whether the file of the decorated function has changed. In numba's own folder, outdated
    code would therefore run after an edit of another file whose functions the loop calls. If the folder is not
    writable, each process compiles the loops again.
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
    """Return a digest of all source files that the loops of a module depend on: 16 hex digits of the SHA-256.

    If one of the files changes, the digest changes, so that outdated compiled code is not used. Docstrings do not
    count, because compiled code does not have them.
    """
    return _digest(SOURCES, module.removeprefix(PACKAGE).replace(".", "/"))


@lru_cache
def _digest(root: Path, file: str) -> str:
    """Return the digest of `source_digest`; root : folder of the package; file : path in the folder, without suffix."""
    digest, package = hashlib.sha256(), _package(root)
    for name in sorted(package.kernel_sources(file)):
        digest.update(name.encode() + DOCSTRING.sub("", package.texts[name]).encode())
    return digest.hexdigest()[:16]


@lru_cache(maxsize=1)
def _package(root: Path) -> "PackageSources":
    """Return the source files of the package in the folder `root`."""
    return PackageSources(
        {path.relative_to(root).with_suffix("").as_posix(): path.read_text("utf-8") for path in root.rglob("*.py")}
    )


class PackageSources:
    """The source files of the package, to find out which files the compiled code of one file depends on.

    texts : mapping from a file of the package, without its suffix (`terrain/facets`), to its text
    """

    def __init__(self, texts: Mapping[str, str]) -> None:
        """Find the files that define model functions, and the files that register rules of model functions."""
        self.texts = texts
        self._stubs = {name: set(STUB.findall(text)) for name, text in texts.items()}
        self._rules = {name: set(RULE.findall(text)) for name, text in texts.items()}
        known = set().union(*self._stubs.values())
        self._always = {name for name, rules in self._rules.items() if rules - known}

    def kernel_sources(self, file: str) -> set[str]:
        """Return all source files that the compiled loops of a file may depend on, including the file itself.

        The result contains all files that the file imports, directly or indirectly, because compiled code contains the
        values of their globals. For each model function in these files, the result contains the files that register
        rules of this function. A file that registers a rule of a model function outside the package is in every result.
        For a file outside the package, the result is all files of the package.
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
    """Yield the paths of all files that a source file may import from the package, such as `terrain/facets`.

    For each name that is imported from a file or folder, the path of the file or folder and the path with the name
    added are yielded, because the name may itself be a file.

    text : content of the source file
    """
    for match in IMPORT.finditer(text):
        package = match[1].strip(".").replace(".", "/")
        yield package
        for name in (match[2] or match[3]).split(","):
            yield f"{package}/{name.split(' as ')[0].strip()}".lstrip("/")
