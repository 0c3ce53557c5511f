"""Options of a contact: methods, search and friction laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from dolfinx.fem import Function

from .. import _cpp
from ..compat import Array
from ..discretization.curving import Smooth
from ..discretization.slave_fields import (
    FRICTION_BOUND,
    FRICTION_COEFFICIENT,
    FRICTION_FIELD,
    FieldValue,
    Quantity,
    check_number,
    is_field,
)
from ..errors import (
    ContactError,
    Options,
    choice,
    is_one_of,
    is_real_number,
    is_truth_value,
    is_whole_number,
    truth,
)
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
    """

    quantity, _make, _name = FRICTION_COEFFICIENT, _cpp.Coulomb, "mu"
    mu: FieldValue


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


STRATEGIES = ("bvh", "advancing-front", "pang", "brute-force")
FRAMES = ("automatic", "slave", "master")
MEASURES = ("reference", "current")
TANGENTS = ("fixed", "full")
CONDITIONS = ("points", "nodes")
MULTIPLIERS = ("normal", "vector", "dual")


def check_coefficient(gamma: Any) -> None:
    """Raise unless gamma is None, a Function or a positive finite number."""
    is_number = is_real_number(gamma)
    if not (gamma is None or isinstance(gamma, Function) or is_number):
        raise ContactError(
            f"gamma must be a positive number, a Function or None, not {gamma!r}"
        )
    if is_number and not 0.0 < gamma < np.inf:
        raise ContactError(f"gamma = {gamma} must be positive and finite")


@dataclass(frozen=True)
class AugmentedLagrangian(Options):
    """Augmented Lagrangian: a multiplier, without penetration except by discretisation.

    Attributes
    ----------
    gamma
        Augmentation coefficient, traction per length: a positive number, a scalar
        ``Function``, or None: from the user's own stiffness, for each pair of bodies
        about the softer one's modulus over its mesh size. It changes the path of
        Newton's method, but hardly the answer.
    multiplier
        ``"normal"``: one scalar, the normal traction; ``"vector"``: the traction in
        global coordinates; ``"dual"``: the same by dual functions, of which each acts
        on the rows of one node, for ``condition="nodes"``. None: the vector with
        friction, which needs it, and with ``frame="master"``, as a scalar cannot follow
        normals of the master that turn within a facet; else the scalar.
    degree
        Degree of the multiplier. None: that of the displacement in 2D, 1 in 3D.
    condition
        Where the law holds: ``"points"``, at integration points in the weak mean; or
        ``"nodes"``, at the multiplier's nodes for the mean gap and slip around them.
    """

    # Over the softer side's stiffness (theory (5.2))
    automatic_factor: ClassVar[float] = 1.0
    cpp: ClassVar[_cpp.Method] = _cpp.Method.augmented_lagrangian
    gamma: float | Function | None = None
    multiplier: str | None = None
    degree: int | None = None
    condition: str = "points"

    @property
    def is_dual(self) -> bool:
        """Whether the multiplier is of dual functions."""
        return self.multiplier == "dual"

    def check(self) -> None:
        check_coefficient(self.gamma)
        known = is_one_of(self.multiplier, MULTIPLIERS)
        if self.multiplier is not None and not known:
            raise ContactError(
                f"multiplier must be 'normal' or 'vector', not {self.multiplier!r}, or "
                "with condition='nodes' 'dual'"
            )
        choice("condition", self.condition, CONDITIONS)
        if self.is_dual and self.condition != "nodes":
            raise ContactError("multiplier='dual' needs condition='nodes'")
        degree = self.degree
        if degree is not None and not (is_whole_number(degree) and degree in (1, 2)):
            raise ContactError(f"multiplier degree {self.degree!r} is not 1 or 2")


@dataclass(frozen=True)
class Penalty(Options):
    """Penalty: traction ``gamma min(0, g) n``, no multiplier.

    Attributes
    ----------
    gamma
        Traction per length of penetration, given as for `AugmentedLagrangian`. Bodies
        penetrate each other by pressure over gamma. None: ten times the value there,
        for an error of about 1 %.
    tangential
        ``"elastic"``: friction springs start from the traction of the last accepted
        step; ``"rate"``: from zero, a viscous regularisation in which a body held in
        stick creeps.
    exact
        Whether solves are repeated, each with the tractions of the last one added,
        until gaps close to 1e-4 of a facet in the mean around each node. It takes a few
        iterations more, and gamma then hardly matters.
    """

    automatic_factor: ClassVar[float] = 10.0
    cpp: ClassVar[_cpp.Method] = _cpp.Method.penalty
    condition: ClassVar[str] = "points"
    is_dual: ClassVar[bool] = False
    gamma: float | Function | None = None
    tangential: str = "elastic"
    exact: bool = False

    def check(self) -> None:
        check_coefficient(self.gamma)
        choice("tangential", self.tangential, ("elastic", "rate"))
        truth("exact", self.exact)


@dataclass(frozen=True)
class Search(Options):
    """Distances and strategy of the search for surfaces. Lengths.

    Attributes
    ----------
    strategy
        ``"bvh"``, a tree of boxes; ``"advancing-front"``, the tree for patches of
        neighbours; ``"pang"``, from neighbour to neighbour on both surfaces; or
        ``"brute-force"``, every pair of facets. All find the same pairs.
    reach
        Largest gap that is still seen. None: twice the facet's size.
    depth
        Largest penetration that is still contact, not the far side of a thin body. Along
        a ray that meets the master obliquely, times the cosine of incidence. None: twice
        the facet's size; beyond the thickness of the bodies then only where the slave
        was in front of the master at the last accepted step.
    skin
        Margin within which candidates stay valid. None: half the facet's size.
    subdivide
        Split quadratic facets at their mid nodes before they are projected: closer
        to strongly curved surfaces, and four times the work.

    Notes
    -----
    The size of a slave facet is its diameter, or the mean of its surface where that is
    larger.
    """

    strategy: str = "bvh"
    reach: float | None = None
    depth: float | None = None
    skin: float | None = None
    subdivide: bool = False

    def check(self) -> None:
        if not is_one_of(self.strategy, STRATEGIES):
            raise ContactError(
                f"search strategy {self.strategy!r} is not one of {STRATEGIES}"
            )
        truth("search subdivide", self.subdivide)
        for name in ("reach", "depth", "skin"):
            value = getattr(self, name)
            if not (value is None or is_real_number(value)):
                raise ContactError(f"search {name} = {value!r} is not a number")
            if value is not None and not 0.0 <= value < np.inf:
                raise ContactError(f"search {name} = {value} must not be negative")


@dataclass(frozen=True, eq=False)
class ContactOptions:
    """Arguments of a `Contact`; see there.

    They are as the user gave them: `check` says whether they can be what their types
    promise.
    """

    method: AugmentedLagrangian | Penalty
    friction: Law | None
    quadrature_degree: int | None
    measure: str
    search: Search
    tangent: str
    offset: FieldValue | None
    axisymmetric: bool
    smooth: Smooth
    frame: str

    def check(self) -> None:
        """Raise for options that do not exist."""
        friction = self.friction
        if not isinstance(self.method, (AugmentedLagrangian, Penalty)):
            raise ContactError(
                f"method must be AugmentedLagrangian or Penalty, not {self.method!r}"
            )
        if not (friction is None or isinstance(friction, LAWS)):
            raise ContactError(
                f"friction must be Coulomb, Tresca, Stick, Friction or None, not {friction!r}"
            )
        if friction and getattr(self.method, "multiplier", None) == "normal":
            raise ContactError("friction needs multiplier='vector', not 'normal'")
        choice("measure", self.measure, MEASURES)
        choice("frame", self.frame, FRAMES)
        choice("tangent", self.tangent, TANGENTS)
        truth("axisymmetric", self.axisymmetric)
        if not (is_truth_value(self.smooth) or callable(self.smooth)):
            raise ContactError(
                f"smooth = {self.smooth!r} must be True, False, or a function of points "
                "(3, n) to points of the true surface (3, n)"
            )
        if not isinstance(self.search, Search):
            raise ContactError(f"search must be a Search, not {self.search!r}")
        for part in filter(None, (self.method, friction, self.search)):
            part.check()
        degree = self.quadrature_degree
        if degree is not None and not (is_whole_number(degree) and 1 <= degree <= 30):
            raise ContactError(
                f"quadrature_degree = {degree!r} is not a whole number from 1 to 30"
            )

    @property
    def has_springs(self) -> bool:
        """Whether friction springs carry a traction from step to step."""
        kept = getattr(self.method, "tangential", "elastic") == "elastic"
        return kept and self.friction is not None

    def multiplier_kind(self, p: int, dim: int, is_tie: bool) -> tuple[int, int]:
        """Degree and components of the multiplier; 0 components: no multiplier.

        For a displacement of degree p. The multiplier of a tie is a vector.
        """
        default = p if dim == 2 else 1
        if isinstance(self.method, Penalty):
            return default, 0
        degree = default if self.method.degree is None else int(self.method.degree)
        if degree > default:
            raise ContactError(
                f"multiplier degree {degree} is not stable: at most {default} with a "
                f"displacement of degree {p} in {dim}D"
            )
        # A scalar acts along each point's own normal, where these turn within a facet
        is_vector = is_tie or self.friction is not None or self.frame == "master"
        needed = "vector" if is_vector else "normal"
        chosen = needed if is_tie else self.method.multiplier or needed
        return degree, 1 if chosen == "normal" else dim
