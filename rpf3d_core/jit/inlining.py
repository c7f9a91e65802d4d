"""Save time at the first call: copy the code of kernels into the loops that call them, and compile only the loops.

numba optimises every function and generates its machine code, as if Python called the function directly. For kernels,
this work is not needed and takes a third of the time of a first call. This file depends on numba's internals: if the
internals change, the import of this file fails, and `dispatch.py` works without this file.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager

NEEDLESS = frozenset((
    "WithLifting", "InlineClosureLikes", "MakeFunctionToJitFunction", "InlineInlinables", "FindLiterallyCalls",
    "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads", "NopythonRewrites", "AnnotateTypes",
))  # fmt: skip
"""Compilation steps of numba that kernels do not need, and that are left out to save time.

These are the steps for `with`, functions within functions, loops over mixed tuples, arithmetic of whole arrays, and
listings. A kernel with such code does not compile.
"""

for _name in ("codegen", "get_pointer_to_function", "_optimize_final_module", "_finalize_final_module", "_finalized"):
    if not hasattr(JITCodeLibrary, _name):
        raise ImportError(f"numba's {JITCodeLibrary.__name__} has no {_name} any more")


class _NoMachineCode:
    """A replacement for numba's code generator (`codegen`) that does nothing, because kernels have no machine code."""

    def set_env(self, name: str, env: Any) -> None:
        """Do nothing: a kernel needs no Python objects."""


class _Copied(JITCodeLibrary):
    """The simplified code of one kernel and of the kernels that it calls, to be copied into a loop."""

    @property
    def codegen(self) -> _NoMachineCode:
        """The code generator that numba uses for this kernel; it generates nothing."""
        return _NoMachineCode()

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0 as the address: the kernel is copied into the loop that calls it, and has no machine code itself."""
        return 0

    def _optimize_final_module(self) -> None:
        """Do nothing: the loop that contains the kernel is optimised as a whole."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


class Inlined(Compiler):
    """The compiler of kernels, without the steps in NEEDLESS; `pipeline_class` in numba's options selects it."""

    def define_pipelines(self) -> list[PassManager]:
        """Return the compilation steps of a kernel: numba's usual steps without the steps that kernels do not need."""
        state: Any = self.state
        state.library = _Copied(state.targetctx.codegen(), state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        state.library.enable_object_caching()
        usual: Any = super().define_pipelines()  # type: ignore[no-untyped-call]
        steps: Any = PassManager("inlined")
        for step, why in usual[0].passes:
            if step.__name__ not in NEEDLESS:
                steps.add_pass(step, why)
        steps.finalize()
        return [steps]
