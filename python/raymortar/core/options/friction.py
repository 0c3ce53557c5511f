"""Friction laws. A new one is a class here and one in cpp/raymortar/law/friction.h: see
docs/extending.md.

Laws that users write themselves are in `user_laws`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from mpi4py import MPI

import numpy as np

from ... import _cpp
from ..discretization.slave_fields import (
    FRICTION_BOUND,
    FRICTION_COEFFICIENT,
    FieldValue,
    Quantity,
    check_field,
    check_number,
    is_field,
    on_facets,
)
from ..errors import ContactError, Options, is_real_number, together


class Law(Options):
    """A friction law with a coefficient, or without."""

    quantity: ClassVar[Quantity | None] = None
    # Whether `at_points` gives an object, which knows bounds at closed points alone
    sends_bounds: ClassVar[bool] = False
    _make: ClassVar[Callable[..., Any]]
    _name = ""  # of the coefficient

    @property
    def coefficient(self) -> Any:
        """Its coefficient as it was given."""
        return getattr(self, self._name, None)

    @property
    def field(self) -> FieldValue | None:
        """The coefficient where that differs from point to point, else None."""
        return self.coefficient if is_field(self.coefficient) else None

    def cpp(self) -> Any:
        """The law for the C++ library; a field replaces its number."""
        if self.quantity is None:
            return type(self)._make()
        number = 0.0 if self.field is not None else float(self.coefficient)
        return type(self)._make(number)

    def spread(self, zones: Sequence[Any], mesh: Any) -> None:
        """Send a coefficient that is a field to zones. Collective."""
        if self.quantity is None or self.field is None:
            return
        with together(mesh.comm):
            check_field(self.quantity, self.field, mesh)
        for zone in zones:
            values = on_facets(self.quantity, self.field, zone.facets, mesh.comm)
            zone.cpp.set_field("friction_coefficient", values)

    def at_points(self, zones: Sequence[Any], comm: MPI.Comm) -> Any:
        """Object that sends the law's bounds to zones by ``send(dt)``, after each pairing;
        None: the C++ library evaluates the law."""
        return None

    def check(self) -> None:
        if self.quantity is not None and self.field is None:
            check_number(self.quantity, self.coefficient)


@dataclass(frozen=True)
class Coulomb(Law):
    """Coulomb friction: slip where the tangential traction reaches ``mu |p|``.

    Attributes
    ----------
    mu
        Friction coefficient, >= 0: a number; a scalar ``Function`` on the displacement's
        mesh; or a function of undeformed positions, (3, n) to (n,). It is taken at the
        nodes of the slave facets when `Contact` is made.
    elastic_slip
        Slip that is given back, a length >= 0: the tangential traction grows in
        proportion to the slip and reaches ``mu |p|`` at this length. 0: closed contact
        sticks rigidly.
    """

    quantity, _make, _name = FRICTION_COEFFICIENT, _cpp.Coulomb, "mu"
    mu: FieldValue
    elastic_slip: float = 0.0

    def cpp(self) -> _cpp.Coulomb:
        law: _cpp.Coulomb = super().cpp()
        law.elastic_slip = float(self.elastic_slip)
        return law

    def check(self) -> None:
        super().check()
        if not is_real_number(self.elastic_slip):
            raise ContactError(
                f"elastic_slip of Coulomb must be a number, not {self.elastic_slip!r}"
            )
        if not 0.0 <= self.elastic_slip < np.inf:
            raise ContactError(
                f"elastic_slip of Coulomb = {self.elastic_slip} must be a finite length "
                ">= 0"
            )


@dataclass(frozen=True)
class Tresca(Law):
    """Tresca friction: slip where the tangential traction reaches a given bound.

    Attributes
    ----------
    bound
        Largest tangential traction while closed, >= 0, given as Coulomb's ``mu``.
    """

    quantity, _make, _name = FRICTION_BOUND, _cpp.Tresca, "bound"
    bound: FieldValue


@dataclass(frozen=True)
class Stick(Law):
    """No slip while the contact is closed."""

    _make = _cpp.Stick
