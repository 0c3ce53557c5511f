"""Parameters by which functionals are differentiated: all, and coefficients of forms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem

from ..core.compat import Array
from ..core.errors import ContactError
from .forms import by_constant, by_function, has
from .linear import Linearised


def _in_cpp(given: Any) -> Any:
    """The C++ object of a Constant or Function."""
    return getattr(given, "_cpp_object", given)


class Control(ABC):
    """A parameter. Derivatives of several steps are added up in `start`'s arrays."""

    @abstractmethod
    def check(self, problem: Any, forms: Sequence[Any]) -> None:
        """Raise unless the problem and the functional, of some forms, have it, and a
        derivative by it is known here. Not collective."""

    def check_state(self, problem: Any) -> None:
        """Raise unless the derivative at the present state is known. Not collective."""

    def kink(self) -> str | None:
        """Tell why there is no derivative by it at this state; None where there is one.
        Not collective."""
        return None

    def is_value_of(self, bc: Any) -> bool:
        """Whether a Dirichlet condition has its value."""
        return False

    @abstractmethod
    def start(self, problem: Any) -> Array:
        """Set up; its derivative before any step: zeros. Collective."""

    def by_forms(self, forms: Sequence[Any], signs: Sequence[float]) -> Array | float:
        """Derivative of some functionals in UFL, times a sign each. Collective."""
        return 0.0

    def by_contact(self, at: Linearised) -> Array | float:
        """Derivative of contact's residual, times the weights of `at`. Collective."""
        return 0.0

    def result(self, found: Array) -> Any:
        """Return the derivative as users take it."""
        return found


class OfForm(Control):
    """A Constant or a Function that is a coefficient of the forms."""

    def __init__(self, given: Any) -> None:
        self._given, self._is_function = given, isinstance(given, fem.Function)

    def check(self, problem: Any, forms: Sequence[Any]) -> None:
        given, unknowns = self._given, problem.contact.unknowns.functions
        if not any(has(form, given) for form in forms):
            name = given.name if self._is_function else "a Constant"
            raise ContactError(
                f"controls: {name} is neither in the forms of the problem nor in J"
            )
        if any(given is f for f in unknowns):
            raise ContactError(f"controls: {given.name} is an unknown of the problem")
        if self._is_function:
            return
        meshes = [f.function_space.mesh for f in unknowns]
        fits = [m for m in meshes if m.ufl_domain() == given.ufl_domain()]
        if not fits:
            raise ContactError(
                "controls: a Constant is on a mesh that no unknown of the problem is on"
            )
        self._mesh = fits[0]

    def is_value_of(self, bc: Any) -> bool:
        values = getattr(bc, "g", None), getattr(bc, "value", None)
        return any(v is self._given or v is _in_cpp(self._given) for v in values)

    def start(self, problem: Any) -> Array:
        if self._is_function:
            return np.zeros(len(self._given.x.array))
        return np.zeros(self._given.ufl_shape)

    def by_forms(self, forms: Sequence[Any], signs: Sequence[float]) -> Array | float:
        found: Array | float = 0.0
        for form, sign in zip(forms, signs):
            if not has(form, self._given):
                continue
            if self._is_function:
                found = found + sign * by_function(form, self._given)
            else:
                found = found + sign * by_constant(form, self._given, self._mesh)
        return found

    def result(self, found: Array) -> Any:
        if not self._is_function:
            return float(found) if found.ndim == 0 else found
        return function_of(self._given.function_space, found)


def function_of(V: Any, values: Array) -> Any:
    """A Function with given values of its dofs."""
    f = fem.Function(V, name="gradient")
    f.x.array[:] = values
    return f


def as_control(given: Any) -> Control:
    """A control of anything that may be one."""
    if isinstance(given, Control):
        return given
    if isinstance(given, (fem.Constant, fem.Function)):
        return OfForm(given)
    raise ContactError(
        "controls must be Constants and Functions of the forms, or those of adjoint such "
        f"as offset(contact), not {given!r}"
    )
