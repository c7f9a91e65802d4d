"""The use of numba in the package: the physics is written once, and runs compiled or, without numba, in plain Python.

`kernel` marks a function that both engines call; its compiled code is copied into each caller. `routine` marks a large
function for both engines; its compiled code is called, not copied. `model_function` marks a function with one rule for
each model. `loop` marks a loop that is compiled if numba is installed. Without numba, all marked functions stay plain
Python functions, and only the reference engine works.
"""

from collections.abc import Callable
from contextlib import suppress
from types import ModuleType
from typing import Any, Protocol, TypeVar

from rpf3d_core.jit.cache import LOOPS, in_cache_folder, save_in_turn

numba: ModuleType | None
try:
    import numba
    import numba.extending
    from numba.core import types
except ImportError:
    numba = None

Inlined: Any = None
with suppress(ImportError):  # a numba release may break `inlining`; without it the first call takes 50 % longer
    from rpf3d_core.jit.inlining import Inlined

HAS_NUMBA = numba is not None

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS = {"error_model": "numpy", "_nrt": False}
"""Options of all compiled code.

A division by zero gives an infinite number or NaN, and no exception (`error_model`). Compiled code allocates no memory,
so reference counts are switched off (`_nrt`). The code is then three times as fast, because otherwise each access to an
array in a NamedTuple would change a reference count twice.
"""

CALLED = OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Options of large functions that only compiled code calls."""

INLINED = CALLED | {"forceinline": True}
"""Options of functions that only compiled code calls: they are copied into their callers."""
if Inlined is not None:
    INLINED["pipeline_class"] = Inlined


class ModelFunction(Protocol):
    """A function with one rule per model: the class of its first argument selects the rule."""

    __name__: str

    def __call__(self, model: Any, *args: Any) -> Any:
        """Call the rule for the class of `model`, and return its result."""

    def rule(self, cls: type) -> Callable[[F], F]:
        """Return a decorator that registers a function as the rule for a class."""

    def otherwise(self, function: F) -> F:
        """Register a function as the rule for all classes for which no rule is registered."""

    def has_rule(self, cls: type) -> bool:
        """Return True if a rule is registered for this class; the rule of `otherwise` does not count."""


def kernel(function: F) -> F:
    """Mark a function of numbers and NamedTuples so that both engines can call it.

    Compiled code gets a compiled copy of the function in each caller; in Python the function stays unchanged.
    """
    if numba is None:
        return function
    marked: F = numba.extending.register_jitable(**INLINED)(function)
    return marked


def routine(function: F) -> F:
    """Mark a large function of numbers, NamedTuples and arrays for both engines; it is compiled once, not copied.

    A kernel is copied into each of its callers, so a large kernel with several callers takes long to compile. But each
    call of a routine passes all numbers of its records one by one, and seven or more numbers for each array: up to 300
    for `Physics`, `Body` and `BodyRoom`. So a large function with only one caller should be a kernel.
    """
    if numba is None:
        return function
    marked: F = numba.extending.register_jitable(**CALLED)(function)
    return marked


def loop(function: F) -> F:
    """Mark a loop over rocks or facets, to be compiled on its first call and stored in the disk cache.

    The loop runs on the calling thread, and other threads can run at the same time. `ensemble/fly.py` spreads batches
    over threads, which also allows progress reports and Ctrl-C. The attribute `py_func` is the undecorated function.
    The order of summation is kept (no fastmath, no contraction), so that both engines agree to the last bit.
    """
    if numba is None:
        function.py_func = function  # type: ignore[attr-defined]
        return function
    with in_cache_folder(function.__module__) as usable:
        compiled: F = numba.njit(nogil=True, cache=usable, **OPTIONS)(function)
    save_in_turn(compiled)
    LOOPS.append(compiled)
    return compiled


def model_function(stub: Callable[..., Any]) -> ModelFunction:
    """Turn a stub `f(model, *args)` into a function that calls the rule for the class of `model`.

    `@f.rule(Model)` registers the rule of a class; the class must be a NamedTuple of numbers if the rule must compile.
    `@f.otherwise` registers the rule of all other classes, including the class of None: if a scene names no model, the
    model is None, and no other rule is compiled.

    Raises
    ------
    TypeError
        By the returned function, if it is called with a `model` whose class has no rule.
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
        # numba compares parameter lists including annotations, so neither function may have annotations
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
"""Key, among the rules of a model function, of the rule for all classes for which no rule is registered."""


def _class_of(kind: Any) -> type:
    """Return the Python class that belongs to a numba type; the class selects the rule of a model function.

    Only NamedTuples and None have such a class. For another type the result is the class of the numba type, for which
    no rule is registered.

    kind : numba type of the first argument of the model function
    """
    if isinstance(kind, types.NoneType):
        return type(None)
    return getattr(kind, "instance_class", type(kind))


def guarded(instead: F) -> Callable[[F], F]:
    """Return a decorator for a kernel `f(*args)` whose arithmetic may fail, so that a failure ends only one rock.

    In Python, the decorated kernel returns `instead(*args)` if `f` raises ArithmeticError or ValueError. Compiled code
    never raises: the root of a negative number is NaN, a division by zero is infinite, and the computation continues.

    instead : function with the arguments of the kernel, which returns the result after a failure
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
