"""Friction laws. A new one is a class here and one in cpp/raymortar/law/friction.h: see
docs/extending.md."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from dolfinx.fem import Function

from ... import _cpp
from ..compat import Array
from ..discretization.slave_fields import (
    FRICTION_BOUND,
    FRICTION_COEFFICIENT,
    FRICTION_FIELD,
    FieldValue,
    Quantity,
    check_number,
    is_field,
)
from ..errors import ContactError, Options, is_real_number
from .user_laws import UserLaw


class Law(Options):
    """A friction law with a coefficient, or without."""

    quantity: ClassVar[Quantity | None] = None
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


@dataclass(frozen=True)
class Friction(UserLaw, Law):
    """A law of the user's: slip where the tangential traction reaches s(p, v).

    Attributes
    ----------
    bound
        s(p, v), from pressures p >= 0 and slip rates v >= 0 of the closed points, (n,)
        each, to tractions >= 0, (n,). The rate is the length of the slip increment over
        ``Contact.dt``. Further arguments are given by their names: ``x``, undeformed
        positions (3, n); ``slip``, the length of the slip of all accepted steps, (n,);
        ``dt``, the time of the step; ``fields``, a list of the values of `fields`, (n,)
        each.
    derivatives
        From the same to (ds/dp, ds/dv), (n,) each. None: by central differences.
    fields
        Scalar Functions on the slave's mesh. Each `Contact.update` evaluates them at
        the nodes of the slave facets.

    Notes
    -----
    Derivatives that are given are compared with differences once, where points are
    closed for the first time; a `ContactWarning` names the one that is wrong.

    Examples
    --------
    Friction that falls from a static to a kinetic coefficient (Stribeck), and that
    grows where the surfaces have rubbed:

    >>> def bound(p, v, slip):
    ...     return (0.2 + 0.1 * np.exp(-v) + 0.05 * np.tanh(slip)) * p
    >>> law = Friction(bound)
    """

    owner, function, first, kind = "Friction", "bound", ("p", "v"), "callable"
    of_fields, _make = FRICTION_FIELD, _cpp.PointBound
    bound: Callable[..., Array]
    derivatives: Callable[..., tuple[Array, Array]] | None = None
    fields: Sequence[Function] = ()

    def call(self, name: str, p: Any, v: Any, given: Mapping[str, Any]) -> Any:
        """Call ``bound`` or ``derivatives`` with the arguments that it has.

        They are copies, which it may write to.
        """
        return self._evaluate(name, (p, v), given)

    def bounds(self, p: Array, v: Array, given: Mapping[str, Any]) -> Array:
        """Evaluate and check the bound, (n,)."""
        found = self._values((p, v), given)
        if found.min(initial=0.0) < 0.0:
            raise ContactError(
                "Friction.bound returns a bound that is negative, at "
                f"{self._place((p, v), int(np.argmin(found)))}"
            )
        return found

    def given_slopes(
        self, p: Array, v: Array, given: Mapping[str, Any]
    ) -> tuple[Array, Array]:
        """Evaluate and check the derivatives by p and v, (n,) each."""
        by_p, by_v = self._given_slopes((p, v), given).T
        return by_p, by_v


LAWS = (Coulomb, Tresca, Stick, Friction)
