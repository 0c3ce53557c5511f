"""Derivatives of a user's friction law: complex steps, differences, and their check."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..errors import ContactWarning
from ..options.friction import Friction

# Of a complex step: its square is below all rounding, whatever the units
TINY = 1e-30
# Of a difference, of the value and of its scale
SHARE, FLOOR = 1e-6, 1e-10
# Pressures and slip rates at which derivatives are checked, of their scales
LADDER = 10.0 ** np.arange(-6.0, 1.0)
# By which derivatives may differ from differences, relatively
ALLOWED = 1e-3
SAMPLES = 8


@dataclass
class Sample:
    """Points of a law with what it is given there, and scales of p and v.

    A pressure of gamma times the facet's size is about the modulus of the bodies; a
    slip rate of its size in a step is fast.
    """

    p: Array
    v: Array
    given: Mapping[str, Any]
    scales: tuple[float, float]

    def ladder(self) -> Sample:
        """Spread pressures and rates over their scales, at some of the points."""
        some = np.unique(np.linspace(0, len(self.p) - 1, SAMPLES).astype(int))
        q, p, v = np.meshgrid(some, LADDER, [0.0, *LADDER], indexing="ij")
        q = q.ravel()
        given = dict(self.given)
        given["x"], given["slip"] = given["x"][:, q], given["slip"][q]
        given["fields"] = [one[q] for one in given["fields"]]
        P, V = self.scales
        return Sample(P * p.ravel(), V * v.ravel(), given, self.scales)

    def sides(self, axis: int) -> tuple[Array, Array]:
        """Values of p or v below and above, none negative."""
        z = (self.p, self.v)[axis]
        h = SHARE * z + SHARE * FLOOR * self.scales[axis]
        return np.maximum(z - h, 0.0), z + h


Slopes = Callable[[Friction, Sample], tuple[Array, Array]]


def by_derivatives(law: Friction, at: Sample) -> tuple[Array, Array]:
    """Take the derivatives that the user gives."""
    return law.given_slopes(at.p, at.v, at.given)


def by_complex_steps(law: Friction, at: Sample) -> tuple[Array, Array]:
    """Differentiate a bound that takes complex numbers, to rounding."""
    step = 1j * TINY
    by_p = law.call("bound", at.p + step, at.v.astype(complex), at.given)
    by_v = law.call("bound", at.p.astype(complex), at.v + step, at.given)
    return np.imag(by_p) / TINY, np.imag(by_v) / TINY


def by_differences(law: Friction, at: Sample) -> tuple[Array, Array]:
    """Differentiate a bound by central differences; at zero from above."""
    found = []
    for axis in range(2):
        low, high = at.sides(axis)
        change = _bound(law, at, axis, high) - _bound(law, at, axis, low)
        found.append(change / (high - low))
    return found[0], found[1]


def _bound(law: Friction, at: Sample, axis: int, values: Array) -> Array:
    """Evaluate a bound at other values of p or v."""
    p, v = (values, at.v) if axis == 0 else (at.p, values)
    found: Array = np.asarray(law.call("bound", p, v, at.given), dtype=np.float64)
    return found


def fault_of(law: Friction, slopes: Slopes, at: Sample) -> str | None:
    """Name a derivative that lies beyond both one-sided differences, and its place.

    At a kink any value between both is right.
    """
    s = _bound(law, at, 0, at.p)
    for axis, found in enumerate(slopes(law, at)):
        z, (low, high) = (at.p, at.v)[axis], at.sides(axis)
        above = (_bound(law, at, axis, high) - s) / (high - z)
        below = (_bound(law, at, axis, low) - s) / (low - z)
        below = np.where(low > 0.0, below, above)
        least, most = np.minimum(below, above), np.maximum(below, above)
        size = np.maximum(np.maximum(np.abs(least), np.abs(most)), np.abs(found))
        rounding = 1e2 * np.finfo(float).eps * np.abs(s) / (high - z)
        beyond = np.maximum(least - found, found - most) - ALLOWED * size - rounding
        k = int(np.argmax(np.where(np.isfinite(beyond), beyond, -np.inf)))
        if beyond[k] > 0.0:
            x = ", ".join(f"{one:.6g}" for one in at.given["x"][:, k])
            return (
                f"ds/d{'pv'[axis]} is {found[k]:.6g} at p = {at.p[k]:.6g}, v = "
                f"{at.v[k]:.6g}, x = ({x}), and differences of bound give {above[k]:.6g}"
            )
    return None


def chosen_slopes(law: Friction, sample: Sample | None, comm: MPI.Comm) -> Slopes:
    """Choose how a law is differentiated, after a check. Collective.

    Parameters
    ----------
    sample
        Closed points of this rank; None if it has none.
    """
    given = law.derivatives is not None
    slopes = by_derivatives if given else by_complex_steps
    fault = None
    if sample is not None:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of parts that are lost
            try:
                fault = fault_of(law, slopes, sample.ladder())
            # A law may refuse values that do not occur, and complex ones
            except Exception as error:
                fault = None if given else str(error)
    fault = next((one for one in comm.allgather(fault) if one is not None), None)
    if fault is None:
        return slopes
    if not given:
        return by_differences
    warnings.warn(
        f"Friction.derivatives: {fault}. Newton's method takes more iterations, or fails: "
        "correct them, or leave them out",
        ContactWarning,
        stacklevel=2,
    )
    return slopes
