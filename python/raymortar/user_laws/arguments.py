"""Users' laws: the arguments of their functions, their values and derivatives."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Container, Mapping, Sequence
from copy import deepcopy
from typing import Any, ClassVar

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array
from ..core.discretization.facets import shape_functions
from ..core.discretization.slave_fields import Quantity, check_function
from ..core.errors import ContactError, described
from ..core.interface.point_results import accumulated_slip, undeformed
from ..core.interface.zone_data import ZoneData

# Arguments that functions may have after the first ones, by name
OFFERED = ("x", "slip", "dt", "fields")
# Step of a difference along a facet, in its reference coordinates
STEP = 1e-5
# By which derivatives may differ from differences, relatively
ALLOWED = 1e-3
# Points at which derivatives are compared with differences
SAMPLES = 8


def further_arguments(function: Any, first: int) -> list[inspect.Parameter]:
    """Arguments of a law's function after the first ones."""
    try:
        return list(inspect.signature(function).parameters.values())[first:]
    except (TypeError, ValueError):  # some built-in functions have no signature
        return []


def offered(function: Any, first: int) -> set[str]:
    """Names of the further arguments that a function is given."""
    return {one.name for one in further_arguments(function, first)} & set(OFFERED)


def check_functions(
    owner: str,
    functions: Mapping[str, Any],
    first: Sequence[str],
    may_have: Sequence[str] = OFFERED,
    kind: str = "function",
) -> None:
    """Raise unless functions of a law take its arguments, named in their order.

    Messages name what is asked for by its `kind`, as the law's page does.
    """
    named = f"{', '.join(first[:-1])} and {first[-1]}"
    for name, function in functions.items():
        if not callable(function):
            raise ContactError(
                f"{owner}.{name} must be a {kind} of {named}, not {function!r}"
            )
        if not _takes(function, len(first)):
            shown = ", ".join(inspect.signature(function).parameters) or "nothing"
            raise ContactError(
                f"{owner}.{name} is a function of {shown}: it must take "
                f"{len(first)} arguments, {named}"
                + (f", and may take any of {', '.join(may_have)}" if may_have else "")
            )
        for argument in further_arguments(function, len(first)):
            kinds = argument.VAR_POSITIONAL, argument.VAR_KEYWORD
            needed = argument.default is argument.empty and argument.kind not in kinds
            if needed and argument.name not in may_have:
                raise ContactError(
                    f"{owner}.{name} has the argument {argument.name!r}: after {named} "
                    f"a law may have any of {', '.join(may_have)}"
                )


def _takes(function: Any, count: int) -> bool:
    """Whether a function takes so many arguments by their order."""
    try:
        inspect.signature(function).bind_partial(*range(count))
    except TypeError:
        return False
    except ValueError:  # no signature
        return True
    return True


def real_values(name: str, values: Any, count: int) -> Array:
    """Convert what a law's function returns for so many points, or raise."""
    found = np.asarray(values)
    if found.shape != (count,) or not np.isrealobj(found):
        raise ContactError(
            f"{name} returns values of type {found.dtype} and shape {found.shape} for "
            f"{count} points: they must be real, of shape ({count},)"
        )
    return found.astype(np.float64)


class UserLaw:
    """Functions of a user's law, which get the arguments that they name.

    A law has the attributes `derivatives` and `fields`, and the function `function`.
    """

    owner: ClassVar[str]  # class of the law, for messages
    function: ClassVar[str]
    kind: ClassVar[str] = "function"  # what messages call it
    first: ClassVar[tuple[str, ...]]  # arguments by their order
    of_fields: ClassVar[Quantity]
    derivatives: Callable[..., Any] | None
    fields: Sequence[Function]

    def check(self) -> None:
        check_functions(self.owner, self._functions(), self.first, kind=self.kind)
        for one in self.fields:
            if not isinstance(one, Function):
                raise ContactError(
                    f"{self.owner}.fields has {described(one)}, which is no Function"
                )
            check_function(self.of_fields, one)

    def _require_fields(self) -> None:
        """Raise for a law of fields that has none."""
        if "fields" in self.arguments and not self.fields:
            raise ContactError(
                f"{self.owner}.{self.function} has the argument fields, and there are "
                f"none: give {self.owner}(..., fields=[...])"
            )

    def _functions(self) -> dict[str, Any]:
        """The functions of the law, by name."""
        more = {} if self.derivatives is None else {"derivatives": self.derivatives}
        return {self.function: getattr(self, self.function), **more}

    @property
    def arguments(self) -> set[str]:
        """Names of the arguments after the first ones."""
        known = (offered(one, len(self.first)) for one in self._functions().values())
        return set().union(*known)

    def _evaluate(self, name: str, at: Any, given: Mapping[str, Any]) -> Any:
        """Call a function with copies of the arguments that it has."""
        self._require_fields()
        function = getattr(self, name)
        more = offered(function, len(self.first))
        copies = {one: deepcopy(given[one]) for one in more}
        return function(*(one.copy() for one in at), **copies)

    def _values(self, at: Any, given: Mapping[str, Any]) -> Array:
        """Evaluate and check the law at arguments (n,) each, (n,)."""
        found = self._evaluate(self.function, at, given)
        return self._checked(self.function, found, at)

    def _given_slopes(self, at: Any, given: Mapping[str, Any]) -> Array:
        """Evaluate and check the user's derivatives by the arguments, (n, arguments)."""
        found = self._evaluate("derivatives", at, given)
        if len(found) != len(self.first):
            raise ContactError(
                f"{self.owner}.derivatives must return the derivatives by "
                f"{', '.join(self.first)}: it returns {len(found)} arrays"
            )
        columns = [self._checked("derivatives", one, at) for one in found]
        return np.stack(columns, axis=1)

    def _checked(self, name: str, values: Any, at: Any) -> Array:
        """Values of a function at points, or an error."""
        found = real_values(f"{self.owner}.{name}", values, len(at[0]))
        if not np.isfinite(found).all():
            raise ContactError(
                f"{self.owner}.{name} returns values that are not finite, at "
                f"{self._place(at, int(np.argmin(np.isfinite(found))))}"
            )
        return found

    def _place(self, at: Any, k: int) -> str:
        """The arguments at one point, for a message."""
        pairs = zip(self.first, at)
        return ", ".join(f"{name} = {one[k]:.6g}" for name, one in pairs)


def beyond_differences(
    found: Array,
    places: Sequence[Array],
    values: Sequence[Array],
    rounding: Any,
    vertical: Any = False,
) -> tuple[int, float] | None:
    """Find which of the derivatives (n,) lies farthest beyond both one-sided differences.

    At a kink any value between both is right. Arguments and values are those below, at
    and above each point, (n,) each. Differences have rounding errors; those at vertical
    points depend on their step. Returns the number of the point and its upper
    difference; None if all are right.
    """
    (low, z, high), (q_low, q, q_high) = places, values
    above = (q_high - q) / (high - z)
    has_lower = low < z
    below = np.where(has_lower, (q - q_low) / np.where(has_lower, z - low, 1.0), above)
    least, most = np.minimum(below, above), np.maximum(below, above)
    size = np.max(np.abs([least, most, found]), axis=0)
    beyond = np.maximum(least - found, found - most) - ALLOWED * size - rounding
    beyond[vertical] = -np.inf
    worst = int(np.argmax(np.where(np.isfinite(beyond), beyond, -np.inf)))
    return (worst, float(above[worst])) if beyond[worst] > 0.0 else None


def chosen(given: Mapping[str, Any], some: Any) -> dict[str, Any]:
    """Take the further arguments of a law at some of its points."""
    slip, fields = given["slip"], [one[some] for one in given["fields"]]
    slip = None if slip is None else slip[some]
    return {**given, "x": given["x"][:, some], "slip": slip, "fields": fields}


def samples(count: int) -> Any:
    """Spread a few numbers over so many points."""
    return np.unique(np.linspace(0, count - 1, SAMPLES).astype(int))


def further(
    zone: ZoneData,
    facet: Any,
    xi: Array,
    dt: float,
    nodal: Sequence[Array],
    wanted: Container[str] = OFFERED,
) -> dict[str, Any]:
    """Collect further arguments of a law at places on slave facets, by name.

    Fields are given by their values at the facets' nodes. What is not wanted is None.
    """
    surface = zone.facets.slave_surface
    N, _ = shape_functions(surface.shape, surface.displacement_degree, xi)
    found: dict[str, Any] = {"dt": dt, "x": None, "slip": None}
    found["fields"] = [np.einsum("qa,qa->q", N, one[facet]) for one in nodal]
    if "x" in wanted:
        X = undeformed(surface, facet, xi)
        found["x"] = np.pad(X, ((0, 0), (0, 3 - surface.gdim))).T
    if "slip" in wanted:
        has_slip = zone.slip is not None
        found["slip"] = (
            accumulated_slip(zone, facet, xi) if has_slip else 0.0 * xi[:, 0]
        )
    return found


def along_facets(values: Callable[[Array], Array], xi: Array) -> Array:
    """Differentiate a function of places along facets, (n, d - 1)."""
    steps = STEP * np.eye(xi.shape[1])
    high, low = ([values(xi + way * h) for h in steps] for way in (1.0, -1.0))
    return (np.array(high) - np.array(low)).T / (2.0 * STEP)
