"""How a kernel becomes part of the loops that call it: copied into them, and turned into machine code there alone.

numba optimises every function to the end and makes machine code of it, as if something might call it by itself. Of
kernels within kernels that was a third of the seconds of a first call, and thrown away. This file rests on numba's
inner workings: where they have moved it cannot be imported, and `compiling.py` does without it.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager

NEEDLESS = frozenset((
    "WithLifting", "InlineClosureLikes", "MakeFunctionToJitFunction", "InlineInlinables", "FindLiterallyCalls",
    "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads", "NopythonRewrites", "AnnotateTypes",
))  # fmt: skip
"""Steps for what no kernel has: `with`, functions within functions, loops over mixed tuples, arithmetic of arrays as a
whole; and listings. A kernel that had any of these would not compile."""

for _name in ("codegen", "get_pointer_to_function", "_optimize_final_module", "_finalize_final_module", "_finalized"):
    if not hasattr(JITCodeLibrary, _name):
        raise ImportError(f"numba's {JITCodeLibrary.__name__} has no {_name} any more")


class _NoMachineCode:
    """Stands where numba looks for the machine code of a function, to tell it of Python objects that it may need."""

    def set_env(self, name: str, env: Any) -> None:
        """Nothing: a kernel needs none."""


class _Copied(JITCodeLibrary):
    """The code of one kernel, simplified, and that of the kernels that it calls."""

    @property
    def codegen(self) -> _NoMachineCode:
        """What would have the machine code."""
        return _NoMachineCode()

    def get_pointer_to_function(self, name: str) -> int:
        """Where the machine code of a function begins: nowhere."""
        return 0

    def _optimize_final_module(self) -> None:
        """Nothing: the loop that it is copied into is optimised as a whole."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


class Inlined(Compiler):
    """Compiles a kernel: `pipeline_class` of numba's options."""

    def define_pipelines(self) -> list[PassManager]:
        """What is done with a kernel, step by step."""
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
