"""Law of a flux, given by a user: its values, its derivatives, and their checks."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array
from ..core.discretization.slave_fields import Quantity
from ..core.errors import ContactError
from ..user_laws.arguments import UserLaw, beyond_differences, chosen, samples

FLUX_FIELD = Quantity("a field of Flux", "must be finite", np.isfinite)
# Arguments of the law of a flux, in this order
ARGUMENTS = ("T_s", "T_m", "p", "g", "v")
# Arguments that are never negative
POSITIVE = ("p", "v")
# Step into the complex plane: its square is nothing beside any value
IMAGINARY = 1e-30
# Step of a difference, as a share of the largest value
SHARE = 1e-6
# Slope that counts as none, relative to the largest
VANISHES = 1e-9


@dataclass(eq=False)
class FluxLaw(UserLaw):
    """A flux as a function of both fields, pressure, gap and slip rate."""

    owner, function, first, of_fields = "Flux", "law", ARGUMENTS, FLUX_FIELD
    law: Callable[..., Array]
    derivatives: Callable[..., Sequence[Array]] | None
    fields: Sequence[Function]

    def __post_init__(self) -> None:
        self.check()
        self._require_fields()

    def values(self, at: Array, given: Mapping[str, Any]) -> Array:
        """Evaluate and check the flux at arguments (5, n), (n,)."""
        return self._values(at, given)

    def slopes(self, at: Array, given: Mapping[str, Any]) -> Array:
        """Differentiate the flux by its arguments (5, n), (n, 5)."""
        if self.derivatives is not None:
            return self._given_slopes(at, given)
        columns = [self._complex_step(at, given, k) for k in range(len(at))]
        return np.stack(columns, axis=1)

    def _checked(self, name: str, values: Any, at: Array) -> Array:
        if np.shape(values) == () and name == "derivatives":
            values = np.broadcast_to(values, at.shape[1:])
        return super()._checked(name, values, at)

    def _complex_step(self, at: Array, given: Mapping[str, Any], k: int) -> Array:
        """Differentiate by one argument."""
        shifted = [one.astype(complex) if i == k else one for i, one in enumerate(at)]
        shifted[k] = shifted[k] + 1j * IMAGINARY
        try:
            with warnings.catch_warnings():
                # A law that drops imaginary parts is found by its check
                warnings.simplefilter("ignore")
                q = np.asarray(self._evaluate("law", shifted, given))
        except (TypeError, ValueError) as error:
            raise ContactError(
                f"Flux.law does not take a complex {ARGUMENTS[k]}, by which it is "
                f"differentiated ({error}): give derivatives"
            ) from error
        slope = np.broadcast_to(np.imag(q) / IMAGINARY, at.shape[1:])
        if not np.isfinite(slope).all():
            raise ContactError(
                f"Flux.law has no finite derivative by {ARGUMENTS[k]} at "
                f"{self._place(at, int(np.argmin(np.isfinite(slope))))}: give derivatives"
            )
        return slope

    def fault_of_slopes(self, at: Array, given: Mapping[str, Any]) -> str | None:
        """Name a derivative that lies beyond both one-sided differences.

        Tried at some of the points, at their arguments and at larger ones. At a kink any
        value between both differences is right.
        """
        some = samples(at.shape[1])
        base, given = at[:, some], chosen(given, some)
        larger = base + _spread(base)[:, None] * (
            np.array([[1.0], [0.0], [1.0], [0.0], [1.0]])
        )
        largest = np.zeros(len(ARGUMENTS))
        for one in (larger, base):
            # A law may refuse what does not occur
            with np.errstate(all="ignore"), suppress(ContactError, ArithmeticError):
                slopes = self.slopes(one, given)
                # Slopes may vanish, as that of T^4 at 0; differences do not
                largest = np.maximum(largest, np.abs(slopes).max(axis=0, initial=0.0))
                largest[:2] = largest[:2].max()
                for k in range(len(ARGUMENTS)):
                    fault = self._fault_of_slope(
                        one, given, k, slopes[:, k], VANISHES * largest[k]
                    )
                    if fault is not None:
                        return fault
        return None

    def flows_uphill(self, at: Array, given: Mapping[str, Any]) -> bool:
        """Whether a closed contact without slip lets the flux go from low to high.

        Tried at some of the points, with a difference of the field and a pressure.
        """
        some = samples(at.shape[1])
        base, given = at[:, some], chosen(given, some)
        size = _spread(base)
        base[0] = base[1] + 0.1 * size[0]
        base[2] = np.maximum(base[2], size[2])
        base[3:] = 0.0
        with np.errstate(all="ignore"), suppress(ContactError, ArithmeticError):
            down = self.values(base, given)
            base[0] = base[1] - 0.1 * size[0]
            up = self.values(base, given)
            return bool((down < 0.0).all() and (up > 0.0).all())
        return False

    def _fault_of_slope(
        self, at: Array, given: Mapping[str, Any], k: int, found: Array, nothing: float
    ) -> str | None:
        """Compare the derivatives by one argument with differences."""
        h = SHARE * _spread(at)[k]
        low, high = at.copy(), at.copy()
        high[k] += h
        low[k] -= h
        if ARGUMENTS[k] in POSITIVE:
            low[k] = np.maximum(low[k], 0.0)
        q_low, q, q_high = (self.values(one, given) for one in (low, at, high))
        rounding = 1e2 * np.finfo(float).eps * np.abs(q).max() / h + nothing
        # Differences of a law that falls vertically depend on their step
        vertical = (at[k] == 0.0) & (ARGUMENTS[k] in POSITIVE)
        places, values = (low[k], at[k], high[k]), (q_low, q, q_high)
        beyond = beyond_differences(found, places, values, rounding, vertical)
        if beyond is None:
            return None
        worst, difference = beyond
        given_by, remedy = "Flux.derivatives", "correct derivatives, or leave them out"
        if self.derivatives is None:
            given_by = "the complex step of Flux.law"
            remedy = (
                "it takes functions such as abs that drop imaginary parts; give "
                "derivatives"
            )
        return (
            f"dq/d{ARGUMENTS[k]} of {given_by} is {found[worst]:.6g} at "
            f"{self._place(at, worst)}, and differences of Flux.law give "
            f"{difference:.6g}: {remedy}"
        )


def _spread(at: Array) -> Array:
    """Size of each argument, (5,): both fields have one."""
    sizes = np.max(np.abs(at), axis=1, initial=0.0)
    sizes[:2] = sizes[:2].max()
    return np.where(sizes > 0.0, sizes, 1.0)
