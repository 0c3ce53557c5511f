"""Arguments of a `Contact` besides its mesh and its pairs: method, search and the rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from dolfinx.fem import Function

from ... import _cpp
from ..discretization.slave_fields import FieldValue
from ..discretization.surfaces import Smooth
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
from .friction import Law

STRATEGIES = ("bvh", "pang", "brute-force")
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
        on the rows of one node, for a law at nodes. None: dual where a condition None
        may choose it; else the vector with friction, which needs it, and with
        ``frame="master"``, as a scalar cannot follow normals of the master that turn
        within a facet; else the scalar.
    degree
        Degree of the multiplier. None: that of the displacement in 2D, 1 in 3D.
    condition
        Where the law holds: ``"points"``, at integration points in the weak mean;
        ``"nodes"``, at the multiplier's nodes for the mean gap and slip around them; or
        None: at nodes with a displacement of degree 1, at points with degree 2, but at
        nodes where bodies bend. ``repr`` of the contact says what it is, and why.
    """

    # Over the softer side's stiffness (theory (5.2))
    automatic_factor: ClassVar[float] = 1.0
    cpp: ClassVar[_cpp.Method] = _cpp.Method.augmented_lagrangian
    gamma: float | Function | None = None
    multiplier: str | None = None
    degree: int | None = None
    condition: str | None = "points"

    @property
    def is_dual(self) -> bool:
        """Whether the multiplier is of dual functions."""
        return self.multiplier == "dual"

    def chosen(
        self, degree: int, is_narrow: bool
    ) -> tuple[AugmentedLagrangian, str | None]:
        """Choose a condition that is None, for a displacement of a degree and, if masters
        are smaller than a slave facet, narrow contact.

        Returns
        -------
        The method with its condition, and why it is that; None: it was given.
        """
        if self.condition is not None:
            return self, None
        if self.is_dual:
            why = "its multiplier is dual"
            return replace(self, condition="nodes"), why
        why = f"displacements have degree {degree}"
        if degree == 1 and is_narrow:
            why = "a master is smaller than the slave's facets"
        if degree > 1 or is_narrow:
            return replace(self, condition="points"), why
        multiplier = "dual" if self.multiplier is None else self.multiplier
        return replace(self, condition="nodes", multiplier=multiplier), why

    def check(self) -> None:
        check_coefficient(self.gamma)
        known = is_one_of(self.multiplier, MULTIPLIERS)
        if self.multiplier is not None and not known:
            raise ContactError(
                f"multiplier must be 'normal' or 'vector', not {self.multiplier!r}, or "
                "with condition='nodes' 'dual'"
            )
        if self.condition is not None:
            choice("condition", self.condition, CONDITIONS)
        if self.is_dual and self.condition == "points":
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
        ``"bvh"``, a tree of boxes; ``"pang"``, from neighbour to neighbour on both
        surfaces; or ``"brute-force"``, every pair of facets. All find the same pairs.
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
        if not (friction is None or isinstance(friction, Law)):
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
    def leaves_law_open(self) -> bool:
        """Whether the method chooses where the law holds."""
        return self.method.condition is None

    def with_law(
        self, degree: int, is_tie: bool, is_narrow: bool
    ) -> tuple[ContactOptions, str | None]:
        """Choose what the method leaves open, see `AugmentedLagrangian.chosen`; return
        why, too. A tie holds at points."""
        if not self.leaves_law_open or isinstance(self.method, Penalty):
            return self, None
        if is_tie:
            return replace(self, method=replace(self.method, condition="points")), None
        method, why = self.method.chosen(degree, is_narrow)
        return replace(self, method=method), why

    @property
    def has_springs(self) -> bool:
        """Whether friction springs carry a traction from step to step."""
        kept = getattr(self.method, "tangential", "elastic") == "elastic"
        return kept and self.friction is not None

    @property
    def has_elastic_slip(self) -> bool:
        """Whether friction gives a part of the slip back."""
        return getattr(self.friction, "elastic_slip", 0.0) > 0.0

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
