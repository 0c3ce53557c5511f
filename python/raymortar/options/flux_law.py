"""A user's law of a flux: its values, its derivatives, and their check."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..discretization.slave_fields import FLUX_FIELD
from ..errors import ContactError
from .user_laws import check_fields, check_functions, offered

# Arguments of a law, in this order
ARGUMENTS = ("T_s", "T_m", "p", "g", "v")
# Arguments that are never negative
POSITIVE = ("p", "v")
# Step into the complex plane: its square is nothing beside any value
IMAGINARY = 1e-30
# Step of a difference, as a share of the largest value
SHARE = 1e-6
# By which derivatives may differ from differences, relatively
ALLOWED = 1e-3
# Slope that counts as none, relative to the largest
VANISHES = 1e-9
SAMPLES = 8


class FluxLaw:
    """A flux as a function of both fields, pressure, gap and slip rate.

    Parameters
    ----------
    law, derivatives, fields
        As of `Flux`.
    """

    def __init__(
        self,
        law: Callable[..., Array],
        derivatives: Callable[..., Sequence[Array]] | None,
        fields: Sequence[Function],
    ) -> None:
        self.law, self.derivatives, self.fields = law, derivatives, list(fields)
        check_functions("Flux", self._functions(), ARGUMENTS)
        check_fields("Flux", FLUX_FIELD, self.fields)
        if "fields" in self.arguments and not self.fields:
            raise ContactError(
                "Flux.law has the argument fields, and there are none: give "
                "Flux(..., fields=[...])"
            )

    def _functions(self) -> dict[str, Any]:
        more = {} if self.derivatives is None else {"derivatives": self.derivatives}
        return {"law": self.law, **more}

    @property
    def arguments(self) -> set[str]:
        """Names of the arguments after the first five."""
        return set().union(*map(_further, self._functions().values()))

    def _call(self, name: str, values: Any, given: Mapping[str, Any]) -> Any:
        """Call a function with copies of the arguments that it has."""
        function = getattr(self, name)
        more = {one: deepcopy(given[one]) for one in _further(function)}
        return function(*(one.copy() for one in values), **more)

    def values(self, at: Array, given: Mapping[str, Any]) -> Array:
        """Evaluate and check the flux at arguments (5, n), (n,)."""
        return _checked("law", self._call("law", at, given), at)

    def slopes(self, at: Array, given: Mapping[str, Any]) -> Array:
        """Differentiate the flux by its arguments (5, n), (n, 5)."""
        if self.derivatives is None:
            columns = [self._complex_step(at, given, k) for k in range(len(at))]
            return np.stack(columns, axis=1)
        found = self._call("derivatives", at, given)
        if len(found) != len(ARGUMENTS):
            raise ContactError(
                f"Flux.derivatives returns {len(found)} arrays: it must return the "
                f"derivatives by {', '.join(ARGUMENTS)}"
            )
        columns = [_checked("derivatives", one, at) for one in found]
        return np.stack(columns, axis=1)

    def _complex_step(self, at: Array, given: Mapping[str, Any], k: int) -> Array:
        """Differentiate by one argument."""
        shifted = [one.astype(complex) if i == k else one for i, one in enumerate(at)]
        shifted[k] = shifted[k] + 1j * IMAGINARY
        try:
            with warnings.catch_warnings():
                # A law that drops imaginary parts is found by its check
                warnings.simplefilter("ignore")
                q = np.asarray(self._call("law", shifted, given))
        except (TypeError, ValueError) as error:
            raise ContactError(
                f"Flux.law does not take a complex {ARGUMENTS[k]}, by which it is "
                f"differentiated ({error}): give derivatives"
            ) from error
        slope = np.broadcast_to(np.imag(q) / IMAGINARY, at.shape[1:])
        if not np.isfinite(slope).all():
            raise ContactError(
                f"Flux.law has no finite derivative by {ARGUMENTS[k]} at "
                f"{_shown(at, int(np.argmin(np.isfinite(slope))))}: give derivatives"
            )
        return slope

    def fault_of_slopes(self, at: Array, given: Mapping[str, Any]) -> str | None:
        """Name a derivative that lies beyond both one-sided differences.

        Tried at some of the points, at their arguments and at larger ones. At a kink any
        value between both differences is right.
        """
        some = np.unique(np.linspace(0, at.shape[1] - 1, SAMPLES).astype(int))
        base, given = at[:, some], _chosen(given, some)
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
        some = np.unique(np.linspace(0, at.shape[1] - 1, SAMPLES).astype(int))
        base, given = at[:, some], _chosen(given, some)
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
        q = self.values(at, given)
        above = (self.values(high, given) - q) / h
        has_lower = low[k] < at[k]
        step = np.where(has_lower, at[k] - low[k], 1.0)
        below = np.where(has_lower, (q - self.values(low, given)) / step, above)
        least, most = np.minimum(below, above), np.maximum(below, above)
        size = np.max(np.abs([least, most, found]), axis=0)
        rounding = 1e2 * np.finfo(float).eps * np.abs(q).max() / h + nothing
        beyond = np.maximum(least - found, found - most) - ALLOWED * size - rounding
        # Differences of a law that falls vertically depend on their step
        beyond[(at[k] == 0.0) & (ARGUMENTS[k] in POSITIVE)] = -np.inf
        worst = int(np.argmax(np.where(np.isfinite(beyond), beyond, -np.inf)))
        if not beyond[worst] > 0.0:
            return None
        given_by = (
            "the complex step of Flux.law"
            if self.derivatives is None
            else "Flux.derivatives"
        )
        return (
            f"dq/d{ARGUMENTS[k]} of {given_by} is {found[worst]:.6g} at "
            f"{_shown(at, worst)}, and differences of Flux.law give "
            f"{above[worst]:.6g}: "
            + (
                "it takes functions such as abs that drop imaginary parts; give "
                "derivatives"
                if self.derivatives is None
                else "correct derivatives, or leave them out"
            )
        )


def _further(function: Any) -> set[str]:
    """Names of the arguments after the first five that a function is given."""
    return offered(function, len(ARGUMENTS))


def _checked(name: str, values: Any, at: Array) -> Array:
    """Values of a law at points, or an error."""
    found = np.asarray(values)
    shape = at.shape[1:]
    if found.shape == () and name == "derivatives":
        found = np.broadcast_to(found, shape)
    if found.shape != shape or not np.isrealobj(found):
        raise ContactError(
            f"Flux.{name} returns values of type {found.dtype} and shape {found.shape} "
            f"for {at.shape[1]} points: they must be real, of shape {shape}"
        )
    if not np.isfinite(found).all():
        raise ContactError(
            f"Flux.{name} returns values that are not finite, at "
            f"{_shown(at, int(np.argmin(np.isfinite(found))))}"
        )
    return found.astype(np.float64)


def _shown(at: Array, k: int) -> str:
    """The arguments at one point, for a message."""
    return ", ".join(f"{name} = {one[k]:.6g}" for name, one in zip(ARGUMENTS, at))


def _spread(at: Array) -> Array:
    """Size of each argument, (5,): both fields have one."""
    sizes = np.max(np.abs(at), axis=1, initial=0.0)
    sizes[:2] = sizes[:2].max()
    return np.where(sizes > 0.0, sizes, 1.0)


def _chosen(given: Mapping[str, Any], some: Any) -> dict[str, Any]:
    """Further arguments at some of the points."""
    found = dict(given)
    found["x"], found["fields"] = given["x"][:, some], [
        f[some] for f in given["fields"]
    ]
    if given["slip"] is not None:
        found["slip"] = given["slip"][some]
    return found
