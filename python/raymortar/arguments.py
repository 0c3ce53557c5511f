"""Checks of what a `Contact` is given besides its mesh."""

from __future__ import annotations

from typing import Any

from dolfinx.fem import Function

from . import compat
from .errors import ContactError
from .friction import LAWS
from .methods import MEASURES, TANGENTS, AugmentedLagrangian, Penalty, Search
from .options import is_one_of, is_whole_number


def check_coefficient_function(gamma: Function, u: Function) -> None:
    """Raise unless gamma is a scalar on the displacement's mesh."""
    components = compat.element_info(gamma.function_space).value_shape
    if components:
        raise ContactError(
            f"gamma must be a scalar Function, not one with values of shape {components}"
        )
    if not compat.on_mesh(gamma, u.function_space.mesh):
        raise ContactError("gamma is a Function on another mesh than the displacement")


def check_options(
    method: Any,
    friction: Any,
    quadrature_degree: Any,
    measure: Any,
    search: Any,
    tangent: Any,
) -> None:
    """Raise for options that do not exist."""
    if not isinstance(method, (AugmentedLagrangian, Penalty)):
        raise ContactError(
            f"method must be AugmentedLagrangian or Penalty, not {method!r}"
        )
    if friction is not None and not isinstance(friction, LAWS):
        raise ContactError(
            f"friction must be Coulomb, Tresca, Stick or None, not {friction!r}"
        )
    if friction is not None and getattr(method, "multiplier", None) == "normal":
        raise ContactError("friction needs multiplier='vector', not 'normal'")
    if not is_one_of(measure, MEASURES):
        raise ContactError(f"measure must be one of {MEASURES}, not {measure!r}")
    if not is_one_of(tangent, TANGENTS):
        raise ContactError(f"tangent must be one of {TANGENTS}, not {tangent!r}")
    if not isinstance(search, Search):
        raise ContactError(f"search must be a Search, not {search!r}")
    for part in (method, friction, search):
        if part is not None:
            part.check()
    degree = quadrature_degree
    if degree is not None and not (is_whole_number(degree) and 1 <= degree <= 30):
        raise ContactError(
            f"quadrature_degree = {degree!r} is not a whole number from 1 to 30"
        )
