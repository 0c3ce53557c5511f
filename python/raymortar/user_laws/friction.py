"""Users' friction laws: bounds at closed points, and their derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, ClassVar

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from .. import _cpp
from ..core.compat import Array
from ..core.discretization.slave_fields import Quantity, check_function, on_facets
from ..core.errors import (
    ContactError,
    SetUpError,
    format_point,
    raise_everywhere,
    together,
    warn,
)
from ..core.interface.point_results import CLOSED, nodes
from ..core.interface.zone_data import ZoneData
from ..core.options.friction import Law
from .arguments import (
    UserLaw,
    along_facets,
    beyond_differences,
    chosen,
    further,
    samples,
)

FRICTION_FIELD = Quantity("a field of Friction", "must be finite", np.isfinite)
# Pressures and slip rates at which laws of ranks are compared
SIZES = 10.0 ** np.arange(-12.0, 15.0, 3.0)
# Step of a difference, as a share of the value and of its scale
SHARE, FLOOR = 1e-6, 1e-10
# Pressures and slip rates at which derivatives are checked, of their scales
LADDER = 10.0 ** np.arange(-6.0, 1.0)


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

    sends_bounds: ClassVar[bool] = True
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

    def spread(self, zones: Sequence[ZoneData], mesh: Any) -> None:
        with together(mesh.comm):
            for one in self.fields:
                check_function(FRICTION_FIELD, one, mesh)
        _require_one_law(self, mesh.comm)

    def at_points(self, zones: Sequence[ZoneData], comm: MPI.Comm) -> PointFriction:
        return PointFriction(self, zones, comm)


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
        places = np.meshgrid(samples(len(self.p)), LADDER, [0.0, *LADDER])
        q, p, v = (x.ravel() for x in places)
        given = chosen(self.given, q.astype(int))
        return Sample(self.scales[0] * p, self.scales[1] * v, given, self.scales)

    def sides(self, axis: int) -> tuple[Array, Array, Array]:
        """Values of p or v below, here and above, none negative."""
        z = (self.p, self.v)[axis]
        h = SHARE * z + SHARE * FLOOR * self.scales[axis]
        return np.maximum(z - h, 0.0), z, z + h

    def bounds(self, law: Friction, axis: int, *values: Array) -> list[Array]:
        """Evaluate a law's bound at other values of p or v."""
        pairs = [(z, self.v) if axis == 0 else (self.p, z) for z in values]
        found = [law.call("bound", *pair, self.given) for pair in pairs]
        return [np.asarray(one, dtype=np.float64) for one in found]


def slopes(law: Friction, at: Sample) -> tuple[Array, Array]:
    """Differentiate a bound: as the user does, else by central differences."""
    if law.derivatives is not None:
        return law.given_slopes(at.p, at.v, at.given)

    def slope(axis: int) -> Array:
        low, _, high = at.sides(axis)
        below, above = at.bounds(law, axis, low, high)
        return (above - below) / (high - low)

    return slope(0), slope(1)


def fault_of(law: Friction, at: Sample) -> str | None:
    """Name a derivative that lies beyond both one-sided differences, and its place."""
    for axis, found in enumerate(slopes(law, at)):
        low, z, high = at.sides(axis)
        s_low, s, s_high = at.bounds(law, axis, low, z, high)
        rounding = 1e2 * np.finfo(float).eps * np.abs(s) / (high - z)
        places, values = (low, z, high), (s_low, s, s_high)
        beyond = beyond_differences(found, places, values, rounding)
        if beyond is not None:
            (k, difference), X = beyond, at.given["x"]
            return (
                f"ds/d{'pv'[axis]} is {found[k]:.6g} at p = {at.p[k]:.6g}, v = "
                f"{at.v[k]:.6g}, x = {format_point(X[:, k], X)}, and "
                f"differences of bound give {difference:.6g}"
            )
    return None


def warn_of_wrong_slopes(law: Friction, sample: Sample | None, comm: MPI.Comm) -> None:
    """Compare the user's derivatives with differences at closed points. Collective."""
    fault = None
    if sample is not None:
        with _in_silence(), suppress(Exception):  # a law may refuse what does not occur
            fault = fault_of(law, sample.ladder())
    for text in [one for one in comm.allgather(fault) if one is not None][:1]:
        warn(
            f"Friction.derivatives: {text}. Correct them, or leave them out",
            page="contact",
        )


@contextmanager
def _in_silence() -> Iterator[None]:
    """Keep back warnings: a law is tried where it need not have values."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _require_one_law(law: Friction, comm: MPI.Comm) -> None:
    """Raise unless a law has the same bounds on all ranks. Collective.

    They are compared over all sizes of pressures and rates, at one place without slip.
    """
    if comm.size == 1:
        return
    p, v = (one.ravel() for one in np.meshgrid(SIZES, [0.0, *SIZES]))
    none = np.zeros(len(p))
    fields = [none] * len(law.fields)
    given = {"x": np.zeros((3, len(p))), "slip": none, "dt": 1.0, "fields": fields}
    with _in_silence():
        try:
            bounds = law.call("bound", p, v, given)
            mine = np.asarray(bounds, dtype=np.float64).tolist()
        except Exception as error:  # where it has no value, if it has none on all ranks
            mine = type(error).__name__
    differs = repr(mine) != repr(comm.bcast(mine, root=0))
    message = "Friction.bound differs between ranks: all must be given the same law"
    raise_everywhere(comm, message if differs else None, SetUpError)


class PointFriction:
    """Evaluates a user's law at the closed points of zones, and sends its bounds."""

    def __init__(
        self, law: Friction, zones: Sequence[ZoneData], comm: MPI.Comm
    ) -> None:
        self._law, self._zones, self._comm = law, zones, comm
        self._is_checked = law.derivatives is None

    def send(self, dt: float) -> None:
        """Evaluate the law once for each paired zone, and send the bounds. Collective."""
        found = [ClosedPoints(self._law, zone, dt, self._comm) for zone in self._zones]
        if not self._is_checked:
            samples = [one.sample() for one in found if one.closed.any()]
            if self._comm.allreduce(len(samples)):
                first = samples[0] if samples else None
                warn_of_wrong_slopes(self._law, first, self._comm)
                self._is_checked = True
        with together(self._comm):
            for zone, one in zip(self._zones, found):
                zone.cpp.set_friction_bounds(*one.bounds(), zone.has_law_at_nodes)


class ClosedPoints:
    """Collects the arguments of a law at the closed points of a zone. Collective."""

    def __init__(
        self, law: Friction, zone: ZoneData, dt: float, comm: MPI.Comm
    ) -> None:
        self._law, self._zone, self._dt = law, zone, dt
        self._nodal = [
            on_facets(FRICTION_FIELD, one, zone.facets, comm) for one in law.fields
        ]
        self._points = nodes(zone) if zone.has_law_at_nodes else zone.points()
        points = self._points
        self.closed = points["status"] >= CLOSED
        self._facet, self._xi = points["slave"][self.closed], points["xi"][self.closed]

    def sample(self) -> Sample:
        """Collect pressures, slip rates and further arguments."""
        points, surface = self._points, self._zone.facets.slave_surface
        p = np.maximum(points["pressure"][self.closed], 0.0)
        v = np.linalg.norm(points["slip"][self.closed], axis=1) / self._dt
        nodes = surface.X[surface.facet_nodes[self._facet[:1]]]
        size = float(np.linalg.norm(np.ptp(nodes, axis=1)))
        scales = float(points["gamma"].max(initial=0.0)) * size, size / self._dt
        return Sample(p, v, self._given(self._xi), scales)

    def bounds(self) -> tuple[Array, Array, Array, Array]:
        """Evaluate the bound of all points and its derivatives.

        They are by the normal traction, by the length of the slip and along the facet.
        """
        n, width = self._points["xi"].shape
        values, along = np.zeros((3, n)), np.zeros((n, width))
        if self.closed.any():
            at = self.sample()
            values[0, self.closed] = self._law.bounds(at.p, at.v, at.given)
            values[1:, self.closed] = slopes(self._law, at)
            if self._law.arguments - {"dt"} and not self._zone.has_law_at_nodes:
                along[self.closed] = along_facets(
                    lambda xi: self._law.bounds(at.p, at.v, self._given(xi)), self._xi
                )
        s, by_p, by_v = values
        # The library's pressure is the normal traction, which is negative
        return s, -by_p, by_v / self._dt, along

    def _given(self, xi: Array) -> dict[str, Any]:
        """Further arguments of the law at places on the points' facets."""
        return further(self._zone, self._facet, xi, self._dt, self._nodal)
