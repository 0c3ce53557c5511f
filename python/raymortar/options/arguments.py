"""Checks of what a `Contact` is given besides its mesh."""

from __future__ import annotations

from typing import Any

from ..checked import is_one_of, is_truth_value, is_whole_number
from ..errors import ContactError
from ..host.slave_fields import OFFSET, check_field
from .friction import LAWS
from .methods import MEASURES, TANGENTS, AugmentedLagrangian, Penalty, Search


def check_options(
    method: Any,
    friction: Any,
    quadrature_degree: Any,
    measure: Any,
    search: Any,
    tangent: Any,
    offset: Any,
    axisymmetric: Any,
) -> None:
    """Raise for options that do not exist."""
    if not isinstance(method, (AugmentedLagrangian, Penalty)):
        raise ContactError(
            f"method must be AugmentedLagrangian or Penalty, not {method!r}"
        )
    if friction is not None and not isinstance(friction, LAWS):
        raise ContactError(
            "friction must be Coulomb, Tresca, Stick, Friction or None, not "
            f"{friction!r}"
        )
    if friction is not None and getattr(method, "multiplier", None) == "normal":
        raise ContactError("friction needs multiplier='vector', not 'normal'")
    if not is_one_of(measure, MEASURES):
        raise ContactError(f"measure must be one of {MEASURES}, not {measure!r}")
    if not is_one_of(tangent, TANGENTS):
        raise ContactError(f"tangent must be one of {TANGENTS}, not {tangent!r}")
    if not is_truth_value(axisymmetric):
        raise ContactError(f"axisymmetric = {axisymmetric!r} must be True or False")
    if not isinstance(search, Search):
        raise ContactError(f"search must be a Search, not {search!r}")
    for part in (method, friction, search):
        if part is not None:
            part.check()
    if friction is not None and friction.quantity is not None:
        check_field(friction.quantity, friction.coefficient)
    if offset is not None:
        check_field(OFFSET, offset)
    degree = quadrature_degree
    if degree is not None and not (is_whole_number(degree) and 1 <= degree <= 30):
        raise ContactError(
            f"quadrature_degree = {degree!r} is not a whole number from 1 to 30"
        )
