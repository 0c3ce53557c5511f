"""Options of the enforcement of contact and of the search for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from dolfinx.fem import Function

from .. import _cpp
from ..checked import Options, is_one_of, is_real_number, is_whole_number, truth
from ..errors import ContactError

STRATEGIES = ("bvh", "advancing-front", "pang", "brute-force")
FRAMES = ("automatic", "slave", "master")
MEASURES = ("reference", "current")
TANGENTS = ("fixed", "full")


def check_coefficient(gamma: Any) -> None:
    """Raise unless gamma is None, a Function or a positive finite number."""
    if gamma is None or isinstance(gamma, Function):
        return
    if not is_real_number(gamma):
        raise ContactError(
            f"gamma must be a positive number, a Function or None, not {gamma!r}"
        )
    if not (np.isfinite(gamma) and gamma > 0.0):
        raise ContactError(f"gamma = {gamma} must be positive and finite")


@dataclass(frozen=True)
class AugmentedLagrangian(Options):
    """Augmented Lagrangian: a multiplier, and no penetration but discretisation's.

    Attributes
    ----------
    gamma
        Augmentation coefficient, traction per length: a positive number, a scalar
        ``Function``, or None: from the user's own stiffness, for each pair of bodies
        about the softer one's modulus over its mesh size. It changes the path of
        Newton's method, and the answer hardly.
    multiplier
        ``"normal"``: one scalar, the normal traction; ``"vector"``: the traction in
        global coordinates. None: the vector with friction, which needs it, and with
        ``frame="master"``, as a scalar has no direction of its own where the master's
        normals turn within a facet; else the scalar.
    degree
        Degree of the multiplier. None: that of the displacement in 2D, 1 in 3D.
    """

    # Over the softer side's stiffness (theory (5.2))
    automatic_factor: ClassVar[float] = 1.0
    gamma: float | Function | None = None
    multiplier: str | None = None
    degree: int | None = None

    def cpp(self) -> _cpp.Method:
        """The method for the C++ library."""
        return _cpp.Method.augmented_lagrangian

    def check(self) -> None:
        check_coefficient(self.gamma)
        known = is_one_of(self.multiplier, ("normal", "vector"))
        if self.multiplier is not None and not known:
            raise ContactError(
                f"multiplier must be 'normal' or 'vector', not {self.multiplier!r}"
            )
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
        sink into each other by pressure over gamma. None: ten times as much as there,
        for an error of about 1 %.
    tangential
        ``"elastic"``: friction springs carry on from the traction accepted at the
        last step; ``"rate"``: from zero, a viscous regularisation in which a body
        held in stick creeps.
    """

    automatic_factor: ClassVar[float] = 10.0
    gamma: float | Function | None = None
    tangential: str = "elastic"

    def cpp(self) -> _cpp.Method:
        """The method for the C++ library."""
        return _cpp.Method.penalty

    def check(self) -> None:
        check_coefficient(self.gamma)
        if not is_one_of(self.tangential, ("elastic", "rate")):
            raise ContactError(
                f"tangential must be 'elastic' or 'rate', not {self.tangential!r}"
            )


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
            if value is None:
                continue
            if not is_real_number(value):
                raise ContactError(f"search {name} = {value!r} is not a number")
            if not (np.isfinite(value) and value >= 0.0):
                raise ContactError(f"search {name} = {value} must not be negative")
