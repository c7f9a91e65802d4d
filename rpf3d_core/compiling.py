"""What the package needs of numba, and how to do without it: physics written once for both engines.

`kernel` marks a function that both engines call, `model_function` a choice among models, `loop` a loop that is
compiled where numba is there. Without numba all three leave plain Python, and the reference engine works.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol, TypeVar

numba: ModuleType | None
try:
    import numba
    import numba.extending
    from numba.core import types
except ImportError:
    numba = None

try:  # these may move with a release of numba; without them `prefetch` does nothing
    from numba.core import cgutils
    from numba.core.cgutils import ir  # type: ignore[attr-defined]  # llvmlite's, of the version that numba wants
except ImportError:
    ir = None

Inlined: Any = None
with suppress(ImportError):  # the same: without it the first call takes half as long again
    from rpf3d_core.inlining import Inlined

HAS_NUMBA = numba is not None

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS = {"error_model": "numpy", "_nrt": False}
"""For all compiled code. Nothing in it allocates, so it needs no reference counts (`_nrt`): without them it is three
times as fast, because each look at an array inside a NamedTuple would count up and down."""

INLINED = OPTIONS | {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""For what only compiled code calls: it is copied into its callers."""
if Inlined is not None:
    INLINED["pipeline_class"] = Inlined


class ModelFunction(Protocol):
    """A function with one rule per class of its first argument."""

    __name__: str

    def __call__(self, model: Any, *args: Any) -> Any:
        """Call the rule of the model's class."""

    def rule(self, cls: type) -> Callable[[F], F]:
        """Register the rule of a class."""

    def otherwise(self, function: F) -> F:
        """Register the rule of all classes that have none of their own."""

    def has_rule(self, cls: type) -> bool:
        """Whether a class has a rule of its own."""


def kernel(function: F) -> F:
    """Mark a function of plain values so that compiled code can call it; Python calls it as it is."""
    if numba is None:
        return function
    marked: F = numba.extending.register_jitable(**INLINED)(function)
    return marked


def loop(function: F) -> F:
    """Compile a loop over rocks or facets, without the interpreter's lock, on first call, into the disk cache.

    It runs on the calling thread; `ensemble/fly.py` spreads batches over threads, which serves progress and Ctrl-C
    as well. `py_func` keeps the undecorated function. Order of summation is kept (no fastmath, no contraction), so
    that both engines agree to the last bit.
    """
    if numba is None:
        function.py_func = function  # type: ignore[attr-defined]
        return function
    with _cache_folder() as usable:
        compiled: F = numba.njit(nogil=True, cache=usable, **OPTIONS)(function)
    _loops.append(compiled)
    return compiled


_loops: list[Any] = []
"""Every loop, so that `compile_apart` can tell them where to keep what they compile from then on."""
_foreign: set[str] = set()
"""Digests of the user's own code that kernels call."""


def compile_apart(digest: str) -> None:
    """From now on keep what is compiled in a folder of its own: kernels call code of another digest than the sources'.

    Otherwise an edit in that code would go unnoticed, and a process that has not loaded it could not read the index.
    """
    _foreign.add(digest)
    for each in _loops:
        with _cache_folder() as usable:
            if usable:
                each.enable_caching()


def compiled_apart() -> list[str]:
    """The digests that `compile_apart` was told of, for another process that is to keep things in the same folder."""
    return sorted(_foreign)


def model_function(stub: Callable[..., Any]) -> ModelFunction:
    """Turn a stub `f(model, *args)` into a dispatch on the class of `model`.

    `@f.rule(Model)` registers the rule of a class: a NamedTuple of numbers where it must compile. `@f.otherwise` that
    of all classes without one, None among them: where a scene names nothing, nothing else is compiled.

    Raises
    ------
    TypeError
        When called with a class that has no rule.
    """
    rules: dict[type | str, Callable[..., Any]] = {}

    def rule_of(cls: type) -> Callable[..., Any]:
        found = rules.get(cls, rules.get(OTHERWISE))
        if found is None:
            raise TypeError(f"{stub.__name__} has no rule for {cls.__name__}")
        return found

    def call(model, *args):  # type: ignore[no-untyped-def]
        return rule_of(type(model))(model, *args)

    if numba is not None:
        # numba compares parameter lists with annotations, so neither side may have any
        @numba.extending.overload(call, jit_options=INLINED)
        def compiled(model, *args):  # type: ignore[no-untyped-def]
            rule = rule_of(_class_of(model))
            return lambda model, *args: rule(model, *args)

    def rule(cls: type) -> Callable[[F], F]:
        def register(function: F) -> F:
            rules[cls] = kernel(function)
            return function

        return register

    def otherwise(function: F) -> F:
        rules[OTHERWISE] = kernel(function)
        return function

    call.rule, call.otherwise, call.has_rule = rule, otherwise, rules.__contains__  # type: ignore[attr-defined]
    call.__doc__, call.__name__, call.__module__ = stub.__doc__, stub.__name__, stub.__module__
    return call  # type: ignore[return-value]


OTHERWISE = "otherwise"
"""Where a model function keeps the rule of classes that have none of their own."""


def _class_of(kind: Any) -> type:
    """The class of the values of a numba type: NamedTuples and None have theirs, no others have rules."""
    if isinstance(kind, types.NoneType):
        return type(None)
    return getattr(kind, "instance_class", type(kind))


def _ask_for(array, row, column):  # type: ignore[no-untyped-def]  # numba wants the parameters of both alike
    """Ask for the line of the cache that holds an element (row, column), to be written soon; nothing but a hint."""


prefetch: Callable[[Any, Any, Any], None] = _ask_for

if numba is not None and ir is None:

    @numba.extending.overload(_ask_for, jit_options=INLINED)
    def _no_prefetch(array, row, column):  # type: ignore[no-untyped-def]
        return lambda array, row, column: None


if numba is not None and ir is not None:

    @numba.extending.intrinsic
    def _prefetch(typing_context, array, row, column):  # type: ignore[no-untyped-def]
        """What LLVM has for it: https://llvm.org/docs/LangRef.html#llvm-prefetch-intrinsic."""

        def build(context, builder, signature, args):  # type: ignore[no-untyped-def]
            word, kind = cgutils.int32_t, signature.args[0]
            parts = context.make_array(kind)(context, builder, args[0])
            place = [context.cast(builder, args[k], signature.args[k], types.intp) for k in (1, 2)]
            at = cgutils.get_item_pointer(context, builder, kind, parts, place, wraparound=False)
            at = builder.bitcast(at, cgutils.voidptr_t)
            hint = ir.FunctionType(ir.VoidType(), [at.type, word, word, word])
            to_write, keep_everywhere, data = (word(value) for value in (1, 3, 1))
            ask = builder.module.declare_intrinsic("llvm.prefetch", [at.type], hint)
            builder.call(ask, [at, to_write, keep_everywhere, data])
            return context.get_dummy_value()

        return types.none(array, row, column), build

    @numba.extending.overload(_ask_for, jit_options=INLINED)
    def _compiled_prefetch(array, row, column):  # type: ignore[no-untyped-def]
        return lambda array, row, column: _prefetch(array, row, column)


def guarded(instead: F) -> Callable[[F], F]:
    """Mark a kernel `f(*args)` whose arithmetic may fail: `instead(*args)` is the answer where Python raises.

    Compiled code never raises: a root of a negative number is NaN there, a division by zero infinite, and it goes on.
    """

    def mark(function: F) -> F:
        inner = kernel(function)

        def call(*args):  # type: ignore[no-untyped-def]
            try:
                return inner(*args)
            except (ArithmeticError, ValueError):
                return instead(*args)

        if numba is not None:

            @numba.extending.overload(call, jit_options=INLINED)
            def compiled(*args):  # type: ignore[no-untyped-def]
                return lambda *args: inner(*args)

        call.__doc__, call.__name__, call.__module__ = function.__doc__, function.__name__, function.__module__
        return call  # type: ignore[return-value]

    return mark


def cache_folder() -> Path:
    """Where these sources keep what has been compiled of them."""
    digest = source_digest()
    if _foreign:
        digest += "-" + hashlib.sha256("".join(sorted(_foreign)).encode()).hexdigest()[:16]
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rpf3d" / digest


def is_cached(function: str, *classes: type) -> bool:
    """Whether a `loop` function of this name has been compiled for arguments of some classes, and is on disk."""
    with suppress(OSError):
        indexes = [path.read_bytes() for path in cache_folder().rglob(f"*.{function}-*.nbi")]
        return any(all(cls.__name__.encode() in index for cls in classes) for index in indexes)
    return False


def keeps_compiled() -> bool:
    """Whether what is compiled is kept on disk."""
    with _cache_folder() as usable:
        return usable


@contextmanager
def _cache_folder() -> Iterator[bool]:
    """Point numba's cache at a folder named after the sources; yields whether it can be used.

    numba checks only the file of the decorated function: an edit in a file that it calls would run stale code. A home
    that cannot be written to costs a compilation a process, for numba's own choice of folder has no such guard.
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


NO_KERNELS = (
    "accuracy", "builders", "commands", "io", "recordings",
    "check.py", "check_effects.py", "choices.py", "compiling_beside.py", "cli.py", "prepared.py", "run.py", "series.py",
    "__init__.py",
)  # fmt: skip
"""Folders and files that hold no compiled code: an edit there need not compile anything again."""


def source_digest() -> str:
    """First 16 hex digits of the SHA-256 of the source files that kernels are compiled from."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        if path.relative_to(root).parts[0] not in NO_KERNELS:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
