"""Users' friction laws at the closed points of zones: bounds and their derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..discretization.facets import shape_functions
from ..discretization.slave_fields import (
    FRICTION_FIELD,
    check_field,
    check_function,
    on_facets,
)
from ..errors import SetUpError, format_point, raise_everywhere, together, warn
from ..options.friction import Friction, Law
from ..options.user_laws import OFFERED, beyond_differences, chosen, samples
from .point_results import CLOSED, accumulated_slip, nodes, undeformed
from .zone_data import ZoneData

# Pressures and slip rates at which laws of ranks are compared
SIZES = 10.0 ** np.arange(-12.0, 15.0, 3.0)
# Step of a difference along a facet, in its reference coordinates
STEP = 1e-5
# Step of a difference, as a share of the value and of its scale
SHARE, FLOOR = 1e-6, 1e-10
# Pressures and slip rates at which derivatives are checked, of their scales
LADDER = 10.0 ** np.arange(-6.0, 1.0)


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


def spread_coefficient(law: Law | None, zones: Sequence[ZoneData], mesh: Any) -> None:
    """Send a friction coefficient that is a field to the zones. Collective."""
    if isinstance(law, Friction):
        with together(mesh.comm):
            for one in law.fields:
                check_function(FRICTION_FIELD, one, mesh)
        _require_one_law(law, mesh.comm)
    if law is None or law.quantity is None or law.field is None:
        return
    with together(mesh.comm):
        check_field(law.quantity, law.field, mesh)
    for zone in zones:
        values = on_facets(law.quantity, law.field, zone.facets, mesh.comm)
        zone.cpp.set_field("friction_coefficient", values)


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


# Of all users' laws


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
