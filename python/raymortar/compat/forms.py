"""Compiled forms."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from dolfinx import fem

from .generation import unwrap

# Options of the form compiler and of just-in-time compilation, before DOLFINx 0.6
_FORM_OPTIONS = {"form_compiler_options": "form_compiler_params"}
_FORM_OPTIONS["jit_options"] = "jit_params"


_SEVERAL = (
    "forms of several unknowns: DOLFINx's own Newton solver takes one form, "
    "raymortar.NewtonSolver(problem) takes them all"
)


class _Forms(list[Any]):
    """Name the solver that takes several forms in the errors of DOLFINx's own."""

    def __repr__(self) -> str:
        return _SEVERAL

    @property
    def _cpp_object(self) -> Any:
        raise AttributeError(_SEVERAL)


def form(
    ufl_form: Any,
    form_compiler_options: Mapping[str, Any] | None = None,
    jit_options: Mapping[str, Any] | None = None,
) -> Any:
    """Compile a form, or lists of them with None for what is zero. Collective (the
    first rank compiles).

    Parameters
    ----------
    form_compiler_options, jit_options
        As of ``dolfinx.fem.form``; None: none.
    """
    if isinstance(ufl_form, (list, tuple)):
        options = form_compiler_options, jit_options
        return _Forms(form(one, *options) for one in ufl_form)
    if ufl_form is None:
        return None
    names = inspect.signature(fem.form).parameters
    known = {}
    for name, given in zip(_FORM_OPTIONS, (form_compiler_options, jit_options)):
        if given is not None:
            known[name if name in names else _FORM_OPTIONS[name]] = dict(given)
    return fem.form(ufl_form, **known)


def is_same_space(V: Any, W: fem.FunctionSpace) -> bool:
    """Whether two spaces are one: in a like one DOLFINx passes over W's conditions."""
    return V is W or unwrap(V) == unwrap(W)


def compiled_rank(form: Any) -> int | None:
    """Rank of a compiled form; None for anything else."""
    spaces = getattr(unwrap(form), "function_spaces", None)
    return None if spaces is None else len(spaces)


def test_space(form: Any) -> Any:
    """C++ space of a compiled form's test function."""
    return unwrap(form).function_spaces[0]
