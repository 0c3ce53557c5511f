"""Friction laws. A new one is a class here and one in cpp/raymortar/law/friction.h."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _cpp
from .errors import ContactError
from .options import Options, is_real_number


def _check(name: str, value: Any) -> None:
    if not (is_real_number(value) and np.isfinite(value)):
        raise ContactError(f"{name} must be a finite number, not {value!r}")
    if value < 0.0:
        raise ContactError(f"{name} = {value} must not be negative")


@dataclass(frozen=True)
class Coulomb(Options):
    """Coulomb friction: slip where the tangential traction reaches ``mu |p|``.

    Attributes
    ----------
    mu
        Friction coefficient, >= 0.
    """

    mu: float

    def check(self) -> None:
        _check("friction coefficient mu", self.mu)

    def cpp(self) -> _cpp.Coulomb:
        """The law for the C++ library."""
        return _cpp.Coulomb(float(self.mu))


@dataclass(frozen=True)
class Tresca(Options):
    """Tresca friction: slip where the tangential traction reaches a given bound.

    Attributes
    ----------
    bound
        Largest tangential traction while closed, >= 0.
    """

    bound: float

    def check(self) -> None:
        _check("friction bound", self.bound)

    def cpp(self) -> _cpp.Tresca:
        """The law for the C++ library."""
        return _cpp.Tresca(float(self.bound))


@dataclass(frozen=True)
class Stick(Options):
    """No slip while the contact is closed."""

    def cpp(self) -> _cpp.Stick:
        """The law for the C++ library."""
        return _cpp.Stick()


LAWS = (Coulomb, Tresca, Stick)
