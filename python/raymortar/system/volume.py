"""The user's forms: residual and tangent of everything but contact."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from petsc4py import PETSc

from .. import compat
from ..compat import Array
from .linear_volume import Inputs, LinearVolume
from .split import Split, without_zeros
from .volume_forms import VolumeForms


class Volume:
    """Residual and tangent of compiled forms, of all unknowns of a host. Collective.

    Parameters
    ----------
    contact
        Contact, or several.
    L, a
        Compiled residual and tangent, as lists where there are several unknowns.
    forms
        The residual in UFL, if the tangent is its derivative: of integrals whose
        derivative does not depend on the unknowns the tangent is assembled once, and
        the residual is a product with it. Else None.
    pattern
        Of the tangent, where it may be kept.
    compiled
        Compiles forms, or lists of them.
    """

    def __init__(
        self,
        contact: Any,
        L: Any,
        a: Any,
        forms: Any = None,
        pattern: Any = None,
        compiled: Callable[[Any], Any] = compat.form,
    ) -> None:
        self.contact = contact
        self._whole = VolumeForms(contact, L, a)
        # What is kept, its forms, and those that are assembled each time
        self._kept: LinearVolume | None = None
        self._linear: VolumeForms | None = None
        self._rest: VolumeForms | None = self._whole
        if forms is not None:
            self._keep(forms, pattern, compiled)

    def _keep(self, forms: Any, pattern: Any, compiled: Callable[[Any], Any]) -> None:
        """Keep what pays. Collective."""
        functions = self.contact.host.functions
        split = Split(forms if self.has_several else [forms], functions)
        is_whole = not without_zeros(split.rest)
        if not (is_whole or split.pays):
            return
        tangents = split.tangents(split.linear)
        if is_whole:
            self._linear, self._rest = self._whole, None
        else:
            self._linear = self._part(split.linear, tangents, compiled)
            of_rest = split.tangents(split.rest)
            self._rest = self._part(split.rest, of_rest, compiled)
        of_residual = Inputs(without_zeros(split.linear), functions)
        of_tangent = Inputs(without_zeros(itertools.chain(*tangents)), functions)
        self._kept = LinearVolume(
            self.contact, pattern, of_residual, of_tangent, is_whole
        )

    def _part(
        self, forms: Any, tangents: Any, compiled: Callable[[Any], Any]
    ) -> VolumeForms:
        """A part of the forms."""
        if not self.has_several:
            (forms,), ((tangents,),) = forms, tangents
        return VolumeForms(self.contact, compiled(forms), compiled(tangents))

    @property
    def L(self) -> Any:
        """Compiled residual, as a list where there are several unknowns."""
        return self._whole.L

    @property
    def a(self) -> Any:
        """Compiled tangent, as lists where there are several unknowns."""
        return self._whole.a

    @property
    def is_linear(self) -> bool:
        """Whether all of the tangent is kept."""
        return self._rest is None

    @property
    def kept(self) -> LinearVolume | None:
        """What is kept, of all integrals or of some, as of the last residual or
        tangent. None: nothing."""
        return self._kept

    @property
    def has_several(self) -> bool:
        """Whether there are forms for several unknowns."""
        return self._whole.has_several

    def with_form_of_u(self, L: Any, a: Any) -> tuple[Any, Any]:
        """L and a, with others in the place of those in the displacement's test
        function."""
        if not self.has_several:
            return L, a
        at = self.contact.host.only.at
        forms, table = list(self.L), list(map(list, self.a))
        forms[at], table[at][at] = L, a
        return forms, table

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Residual at the present state, of the owned unknowns. Collective."""
        return self.residual(bcs, None)

    def residual(self, bcs: Sequence[Any], increment: Array | None) -> Array:
        """Residual of the owned unknowns, with the effect of prescribed increments if
        they are given. Collective."""
        if self._kept is None and self._rest is not None:
            return self._rest.residual(bcs, increment)
        kept, host, parts = self._renewed(bcs), self.contact.host, []
        if kept is not None:
            values = host.owned_values()
            if increment is not None:
                values += host.owned_part(increment)
            parts.append(kept.forces(values))
        if self._rest is not None:
            parts.append(self._rest.residual(bcs, increment))
        found: Array = sum(parts[1:], parts[0])
        return found

    def _renewed(self, bcs: Sequence[Any]) -> LinearVolume | None:
        """What is kept, as it is for present conditions. Collective."""
        if self._kept is None or self._linear is None:
            return None
        fixed, linear = self.contact.host.owned_prescribed(bcs), self._linear
        assemble = partial(linear.add_tangent, bcs=())
        self._kept.renew(fixed, assemble, linear.residual)
        return self._kept

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent, with ones for constrained unknowns. Collective."""
        kept = self._renewed(bcs)
        if kept is not None:
            kept.add_tangent(A)
        if self._rest is not None:
            # Sets the ones anew: none is there twice
            self._rest.add_tangent(A, bcs)
