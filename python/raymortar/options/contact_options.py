"""Choices of the user for a `Contact` besides its mesh and its pairs."""

from __future__ import annotations

from dataclasses import dataclass

from ..checked import choice, is_truth_value, is_whole_number, truth
from ..errors import ContactError
from ..host.curving import Smooth
from ..host.slave_fields import OFFSET, FieldValue, check_field
from .friction import LAWS, Law
from .methods import FRAMES, MEASURES, TANGENTS, AugmentedLagrangian, Penalty, Search


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
        if not isinstance(self.method, (AugmentedLagrangian, Penalty)):
            raise ContactError(
                f"method must be AugmentedLagrangian or Penalty, not {self.method!r}"
            )
        if self.friction is not None and not isinstance(self.friction, LAWS):
            raise ContactError(
                "friction must be Coulomb, Tresca, Stick, Friction or None, not "
                f"{self.friction!r}"
            )
        if (
            self.friction is not None
            and getattr(self.method, "multiplier", None) == "normal"
        ):
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
        for part in (self.method, self.friction, self.search):
            if part is not None:
                part.check()
        if self.friction is not None and self.friction.quantity is not None:
            check_field(self.friction.quantity, self.friction.coefficient)
        if self.offset is not None:
            check_field(OFFSET, self.offset)
        degree = self.quadrature_degree
        if degree is not None and not (is_whole_number(degree) and 1 <= degree <= 30):
            raise ContactError(
                f"quadrature_degree = {degree!r} is not a whole number from 1 to 30"
            )

    @property
    def has_springs(self) -> bool:
        """Whether friction springs carry a traction from step to step."""
        if isinstance(self.method, Penalty) and self.method.tangential != "elastic":
            return False
        return self.friction is not None

    def multiplier_kind(self, p: int, dim: int, is_tie: bool) -> tuple[int, int]:
        """Degree and components of the multiplier; 0 components: no multiplier.

        Parameters
        ----------
        p
            Degree of the displacement.
        dim
            Dimension of space.
        is_tie
            Whether the multiplier is that of a `Tie`, which is a vector.
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
