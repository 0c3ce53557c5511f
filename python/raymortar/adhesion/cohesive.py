"""The bilinear cohesive law: traction, damage and dissipated energy at points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..core.compat import Array
from ..core.errors import ContactError, Options, choice, is_real_number, positive
from ..core.terms import Adhesion
from .bond import Bond

MODES = ("benzeggagh-kenane", "power")
# Exponents of both by default
EXPONENTS = {"benzeggagh-kenane": 2.0, "power": 1.0}


class Response(NamedTuple):
    """The law at points, (n,) each.

    Energies are twice those of undamaged springs: what damage leaves of them is stored.
    """

    damage: Array  # of the present state, not less than that of the accepted step
    by_normal: Array  # its derivative by the energy of opening
    by_shear: Array  # and by that of shear
    dissipated: Array  # in the step, energy per area


@dataclass(frozen=True)
class Cohesive(Options, Adhesion):
    """Adhesion by a bilinear cohesive law: `Contact(..., adhesion=Cohesive(...))`.

    Surfaces that lie on each other undeformed are bonded. The traction rises to the
    strength and falls to zero; the area below is the toughness. Damage stays: unloading
    goes along the secant [theory (4.46)-(4.50)]. The contact adds
    compression and friction, before and after separation.

    Attributes
    ----------
    strength
        Largest traction in opening, or the pair of those in opening and shear.
    toughness
        Energy per area that separation takes in opening, or the pair of those in opening
        and shear.
    mode
        Toughness of mixed modes: ``"benzeggagh-kenane"`` or ``"power"``.
    exponent
        Exponent of the mode, at least 1. None: 2 for Benzeggagh-Kenane, 1 for the power
        law.
    elastic
        Share of the critical opening up to which nothing is damaged, between 0 and 1.
        It makes the initial stiffness, and changes neither strength nor toughness.
    within
        Undeformed surfaces are bonded where they are no further apart. Length. None: a
        twentieth of the slave's facets.
    where
        Function of undeformed positions (3, n) that says which points are bonded, (n,).
        None: all.

    Raises
    ------
    ContactError
        For values that are not positive, or a mode that does not exist.

    Examples
    --------
    >>> glue = raymortar.Cohesive(strength=(30e6, 40e6), toughness=(280.0, 790.0))
    >>> contact = raymortar.Contact(u, facet_tags, [("tape", "plate")], adhesion=glue)
    >>> contact.bond.dissipated()
    """

    strength: float | tuple[float, float]
    toughness: float | tuple[float, float]
    mode: str = "benzeggagh-kenane"
    exponent: float | None = None
    elastic: float = 0.02
    within: float | None = None
    where: Callable[[Array], Any] | None = None

    def check(self) -> None:
        for name in ("strength", "toughness"):
            _pair(name, getattr(self, name))
        choice("Cohesive.mode", self.mode, MODES)
        m = self.exponent
        if m is not None and positive("Cohesive.exponent", m) < 1.0:
            raise ContactError(f"Cohesive.exponent = {m} must be at least 1")
        r = self.elastic
        if not (is_real_number(r) and 0.0 < r < 1.0):
            raise ContactError(f"Cohesive.elastic = {r!r} must be between 0 and 1")
        if self.within is not None:
            positive("Cohesive.within", self.within)
        if self.where is not None and not callable(self.where):
            raise ContactError(
                f"Cohesive.where = {self.where!r} must be a function of points (3, n) to "
                "(n,)"
            )

    def bond(
        self, contact: Any, u: Any, facet_tags: Any, pairs: Any, names: Any
    ) -> Bond:
        """Bond the surfaces of a contact. Collective."""
        return Bond(self, contact, u, facet_tags, pairs, names)

    @property
    def stiffness(self) -> tuple[float, float]:
        """Initial stiffness in opening and shear [theory (4.46)]. Traction per length."""
        found = [
            s**2 / (2.0 * self.elastic * G)
            for s, G in zip(_pair("", self.strength), _pair("", self.toughness))
        ]
        return found[0], found[1]

    def toughness_at(self, mixity: Array) -> tuple[Array, Array]:
        """Toughness at shares of shear in the energy, and its derivative [theory
        (4.48)]."""
        G, H = _pair("", self.toughness)
        m = EXPONENTS[self.mode] if self.exponent is None else float(self.exponent)
        B = mixity
        if self.mode == "benzeggagh-kenane":
            return G + (H - G) * B**m, (H - G) * m * B ** (m - 1.0)
        total = ((1.0 - B) / G) ** m + (B / H) ** m
        grows = B ** (m - 1.0) / H**m - (1.0 - B) ** (m - 1.0) / G**m
        found: Array = total ** (-1.0 / m)
        return found, -found / total * grows

    def respond(self, normal: Array, shear: Array, accepted: Array) -> Response:
        """Evaluate the law.

        Parameters
        ----------
        normal, shear
            Twice the energies of undamaged springs in opening and shear, (n,).
        accepted
            Damage at the accepted step, (n,).
        """
        r, total = self.elastic, normal + shear
        some = np.where(total > 0.0, total, 1.0)
        mixity = np.where(total > 0.0, shear / some, 0.0)
        G, slope = self.toughness_at(mixity)
        square = 0.5 * r * total / G  # of the opening over the critical one
        opening = np.clip(np.sqrt(square), r, 1.0)
        trial = (1.0 - r / opening) / (1.0 - r)
        grows = trial > accepted
        damage = np.where(grows, trial, accepted)
        # By the square of the opening, where damage grows and is not yet whole
        rate = grows & (square < 1.0)
        by_square = np.where(rate, 0.5 * r / (opening**3 * (1.0 - r)), 0.0)
        turn = square * slope / (G * some)
        by_normal = by_square * (0.5 * r / G + turn * mixity)
        by_shear = by_square * (0.5 * r / G - turn * (1.0 - mixity))
        taken = G * (self._worn(damage) - self._worn(accepted))
        return Response(damage, by_normal, by_shear, taken)

    def _worn(self, damage: Array) -> Array:
        """Share of the toughness that damage has taken [theory (4.50)]."""
        r = self.elastic
        found: Array = r * damage / (1.0 - (1.0 - r) * damage)
        return found


def _pair(name: str, value: Any) -> tuple[float, float]:
    """Values in opening and shear: a number is both."""
    name, pair = f"Cohesive.{name}", value
    if not isinstance(value, (tuple, list)):
        pair = value, value
    if len(pair) != 2:
        raise ContactError(f"{name} = {value!r} must be a number, or a pair of numbers")
    return positive(name, pair[0]), positive(name, pair[1])
