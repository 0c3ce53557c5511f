"""Friction laws. A new one is a class here and one in cpp/raymortar/law/friction.h."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from .. import _cpp
from ..checked import Options
from ..compat import Array
from ..errors import ContactError
from ..host.slave_fields import (
    FRICTION_BOUND,
    FRICTION_COEFFICIENT,
    FieldValue,
    Quantity,
    check_number,
    is_field,
)


class Law(Options):
    """A friction law with a coefficient, or without."""

    quantity: ClassVar[Quantity | None] = None

    @property
    def coefficient(self) -> Any:
        """Its coefficient as it was given."""
        return None

    @property
    def field(self) -> FieldValue | None:
        """The coefficient where that differs from point to point, else None."""
        return self.coefficient if is_field(self.coefficient) else None

    def cpp(self) -> Any:
        """The law for the C++ library."""
        raise NotImplementedError

    def check(self) -> None:
        if self.quantity is not None and self.field is None:
            check_number(self.quantity, self.coefficient)

    def _number(self) -> float:
        """The coefficient of all points; of a field, which replaces it, any."""
        return 0.0 if self.field is not None else float(self.coefficient)


@dataclass(frozen=True)
class Coulomb(Law):
    """Coulomb friction: slip where the tangential traction reaches ``mu |p|``.

    Attributes
    ----------
    mu
        Friction coefficient, >= 0: a number; a scalar ``Function`` on the displacement's
        mesh; or a function of undeformed positions, (3, n) to (n,). It is taken at the
        nodes of the slave facets when `Contact` is made.
    """

    quantity = FRICTION_COEFFICIENT
    mu: FieldValue

    @property
    def coefficient(self) -> FieldValue:
        return self.mu

    def cpp(self) -> _cpp.Coulomb:
        """The law for the C++ library."""
        return _cpp.Coulomb(self._number())


@dataclass(frozen=True)
class Tresca(Law):
    """Tresca friction: slip where the tangential traction reaches a given bound.

    Attributes
    ----------
    bound
        Largest tangential traction while closed, >= 0, given as Coulomb's ``mu``.
    """

    quantity = FRICTION_BOUND
    bound: FieldValue

    @property
    def coefficient(self) -> FieldValue:
        return self.bound

    def cpp(self) -> _cpp.Tresca:
        """The law for the C++ library."""
        return _cpp.Tresca(self._number())


@dataclass(frozen=True)
class Stick(Law):
    """No slip while the contact is closed."""

    def cpp(self) -> _cpp.Stick:
        """The law for the C++ library."""
        return _cpp.Stick()


@dataclass(frozen=True)
class Friction(Law):
    """A law of the user's: slip where the tangential traction reaches s(p, v).

    Attributes
    ----------
    bound
        s(p, v), from pressures p >= 0 and slip rates v >= 0 of the closed points, (n,)
        each, to tractions >= 0, (n,). The rate is the length of the slip increment over
        ``Contact.dt``.
    derivatives
        From the same to (ds/dp, ds/dv), (n,) each.

    Examples
    --------
    Friction that falls from a static to a kinetic coefficient (Stribeck):

    >>> def bound(p, v):
    ...     return (0.2 + 0.1 * np.exp(-v)) * p
    >>> def derivatives(p, v):
    ...     return 0.2 + 0.1 * np.exp(-v), -0.1 * np.exp(-v) * p
    >>> law = Friction(bound, derivatives)
    """

    bound: Callable[[Array, Array], Array]
    derivatives: Callable[[Array, Array], tuple[Array, Array]]

    def check(self) -> None:
        for name in ("bound", "derivatives"):
            if not callable(getattr(self, name)):
                raise ContactError(
                    f"Friction.{name} must be a callable of pressures and slip rates, "
                    f"not {getattr(self, name)!r}"
                )

    def cpp(self) -> _cpp.PointBound:
        """The law for the C++ library."""
        return _cpp.PointBound()

    def at(self, p: Array, v: Array) -> Array:
        """s, ds/dp and ds/dv, (3, n), at pressures and slip rates, (n,) each."""
        if not len(p):
            return np.empty((3, 0))
        given = [np.asarray(self.bound(p, v))]
        given += [np.asarray(one) for one in self.derivatives(p, v)]
        for name, one in zip(("bound", "derivatives", "derivatives"), given):
            if one.shape != p.shape or not np.isrealobj(one):
                raise ContactError(
                    f"Friction.{name} returns values of type {one.dtype} and shape "
                    f"{one.shape} for {len(p)} points: they must be real, of shape "
                    f"({len(p)},)"
                )
        if len(given) != 3:
            raise ContactError("Friction.derivatives must return (ds/dp, ds/dv)")
        found = np.array(given, dtype=np.float64)
        if not (np.isfinite(found).all() and found[0].min() >= 0.0):
            raise ContactError(
                "Friction has a bound that is negative, or values that are not finite, "
                f"at pressures up to {p.max():.3e} and slip rates up to {v.max():.3e}"
            )
        return found


LAWS = (Coulomb, Tresca, Stick, Friction)
