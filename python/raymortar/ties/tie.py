"""Surfaces tied to each other where they lie undeformed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from dolfinx.fem import Function

from ..core.contact import Contact
from ..core.errors import (
    ContactError,
    is_one_of,
    raise_everywhere,
    require_agreement,
    together,
    truth,
)
from ..core.options.methods import AugmentedLagrangian, Penalty, Search
from .masters import require_masters, warn_of_corners

ADJUST = ("keep", "close")


class Tie(Contact):
    """Slave surfaces that stay where they are on their masters. Collective.

    They are paired once, undeformed, and transmit any traction. With the gap ``g_0``
    along the slave's normal n between a slave's point and the one that it is tied to,

    .. math:: x_m - x_s - g_0 n = 0

    at every time: a rigid motion of both is free of stress, however large. A surface
    that is tied to a rigid body follows it: with the body's rotation R and shift b

    .. math:: R X + b - x_s = 0

    whatever the body's shape. A tie goes wherever a `Contact` does, alone or in a list
    with others.

    Parameters
    ----------
    u, facet_tags, pairs, quadrature_degree, search, names, axisymmetric
        The same as for `Contact`. The master of a pair is a tag, or a `rigid.Body`: one
        that is led or free, of any shape or a `rigid.Frame`. Search distances hold for
        the undeformed bodies: surfaces farther apart are not tied.
    method
        `AugmentedLagrangian`, whose multiplier is a vector here, or `Penalty`, whose
        coefficient holds all components. With a multiplier gamma changes no result.
    adjust
        ``"keep"``: gaps that the meshes have stay, without stress, and turn with the
        slave's surface; ``"close"``: they are closed, which deforms the bodies.
    partial
        Whether slave surfaces may reach beyond their masters; the part beyond is free.

    Attributes
    ----------
    tied
        `adjust` as it was given.

    Raises
    ------
    ContactError
        For the same faults as `Contact`; for slave nodes without a master, unless
        `partial`.

    Notes
    -----
    In ``points`` and `gap` the gap is how far a tie is open beyond what is kept, and
    ``distance`` the gap g_0 of the undeformed surfaces. ``status`` is 2 where a point
    is tied.
    """

    def __init__(
        self,
        u: Function | Sequence[Function],
        facet_tags: Any,
        pairs: Sequence[tuple[int | str, int | str]],
        method: AugmentedLagrangian | Penalty | None = None,
        adjust: str = "keep",
        quadrature_degree: int | None = None,
        search: Search | None = None,
        names: Mapping[str, int | tuple[int, int]] | None = None,
        partial: bool = False,
        axisymmetric: bool = False,
        **others: Any,
    ) -> None:
        _check(adjust, partial, method, others)
        self.tied = adjust
        super().__init__(
            u,
            facet_tags,
            pairs,
            method,
            quadrature_degree=quadrature_degree,
            search=search,
            names=names,
            axisymmetric=axisymmetric,
        )
        require_agreement(self.layout.comm, adjust=adjust, partial=partial)
        self._check_bodies()
        self._pair(partial)
        self.assembly.find_cross_points([self.surfaces])
        self.update()
        self.assembly.present.updates_for_room += 1  # of the start, not of a solve

    def _pair(self, partial: bool) -> None:
        """Pair the undeformed surfaces. Collective."""
        for zone in self.zones:
            with together(self.layout.comm):
                zone.cpp.pair()
        require_masters(self.surfaces, partial)
        cover = self.assembly.present.cover
        if cover is not None:
            cover.share()
            warn_of_corners(self.surfaces)

    def _check_bodies(self) -> None:
        """Raise for a surface that is to follow several bodies, and for gaps to close
        where there are none."""
        message = None
        for zone in self.zones:
            bodies = zone.facets.bodies
            if len(bodies) > 1:
                message = (
                    f"{zone.facets.spoken} is tied to the rigid {bodies[0].name} and the "
                    f"rigid {bodies[1].name}: a surface follows one body; split its tag"
                )
            elif bodies and self.tied == "close":
                message = (
                    f"{zone.facets.spoken} is tied to the rigid {bodies[0].name}, which "
                    "it follows from where it is: there is no gap to close, leave adjust "
                    "out"
                )
        raise_everywhere(self.layout.comm, message)

    def set_offset(self, offset: Any) -> NoReturn:
        """A tie has none: see `adjust` of `Tie`."""
        raise ContactError("a Tie has no offset: its gaps are kept or closed")

    def adjust(self, within: float) -> NoReturn:
        """A tie needs none: kept gaps are free of stress."""
        raise ContactError(
            "a Tie needs no adjust: with adjust='keep' it starts without stress"
        )


def _check(adjust: Any, partial: Any, method: Any, others: Mapping[str, Any]) -> None:
    """Raise for options that a tie does not have."""
    for name, why in (
        ("friction", "it holds all components of the displacement"),
        ("offset", "its gaps are kept or closed, see adjust"),
        ("measure", "it integrates over the undeformed surface"),
        ("tangent", "its points do not move"),
        ("smooth", "the gaps of straight facets are kept or closed"),
        ("frame", "it holds all components of the displacement"),
        ("adhesion", "it never opens; surfaces that may part are a Contact's"),
    ):
        if name in others:
            raise ContactError(f"a Tie takes no {name}: {why}")
    if others:
        raise TypeError(f"Tie has no argument {next(iter(others))!r}")
    if not is_one_of(adjust, ADJUST):
        raise ContactError(f"adjust must be 'keep' or 'close', not {adjust!r}")
    truth("partial", partial)
    if getattr(method, "multiplier", None) == "normal":
        raise ContactError("the multiplier of a Tie is a vector, not 'normal'")
    if getattr(method, "condition", None) == "nodes" or getattr(
        method, "is_dual", False
    ):
        raise ContactError("a Tie holds at points: it takes no condition='nodes'")
