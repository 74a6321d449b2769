"""Parts of compiled functions: translated to LLVM IR once, but optimised and made executable only within their callers.

Numba makes every function executable by itself, with a wrapper for Python, although most are only called by other
compiled functions; LLVM then optimises a function again in each of its callers. For a solver of a hundred small
functions that takes two thirds of the compile time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NoPythonBackend


def unliteral(argument: Any) -> Any:
    """Return int64 for the type of an integer constant, bool for that of a truth value, any other type as it is."""
    constant = isinstance(argument, (types.IntegerLiteral, types.BooleanLiteral))
    return argument.literal_type if constant else argument


class PartLibrary(JITCodeLibrary):
    """The LLVM IR of one function."""

    def finalize(self) -> None:
        """Close the library without optimising it: libraries that link it do that."""
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class OfferToCallers(LoweringPass):
    """Lets other compiled functions call and inline this one, together with the parts that it calls."""

    _name = 'offer_to_callers'

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Register the function under the entry point that its dispatcher looks up."""
        place = object()
        state.cr = state.cr._replace(entry_point=place)
        libraries = dict.fromkeys([state.library])
        for library in state.library._linking_libraries:
            libraries[library] = None
        state.targetctx.insert_user_function(place, state.cr.fndesc, list(libraries))
        return True


class PartCompiler(CompilerBase):
    """Numba's compiler without the steps that make a function executable."""

    def define_pipelines(self) -> list[Any]:
        """Return the usual passes, then OfferToCallers."""
        state = self.state
        state.flags.no_compile = True
        state.flags.no_cpython_wrapper = True
        state.flags.no_cfunc_wrapper = True
        state.library = PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        passes = DefaultPassBuilder.define_nopython_pipeline(state)
        passes.add_pass_after(OfferToCallers, NoPythonBackend)
        passes.finalize()
        return [passes]


def make_part(dispatcher: Any, for_python: Callable[..., Any], names: list[str]) -> None:
    """Let a dispatcher with PartCompiler keep what it compiles for compiled callers; Python calls `for_python`.

    `names` receives the name of the function each time that it is compiled.
    """

    def keep(result: Any) -> None:
        dispatcher.overloads[tuple(result.signature.args)] = result
        names.append(dispatcher.__name__)

    usual_template = dispatcher.get_call_template

    def template(arguments: Any, named: Any) -> Any:
        """Compile for int64, not for each integer constant that is passed: LLVM propagates the constants anyway."""
        values = {name: unliteral(value) for name, value in named.items()}
        return usual_template(tuple(map(unliteral, arguments)), values)

    dispatcher.add_overload = keep
    dispatcher.get_call_template = template
    dispatcher._compile_for_args = lambda *_, **__: for_python  # Numba calls the function that it returns
