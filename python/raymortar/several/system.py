"""The coupled system of several contacts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from dolfinx.fem import Function

from ..core.discretization.layout import CoupledRows
from ..core.discretization.unknowns import Unknowns
from ..core.system.assembly import ContactAssembly
from ..core.system.coupled import CoupledSystem


class SeveralSystem(CoupledSystem):
    """Matrices and vectors over [u, multipliers of each contact, bodies]. Collective."""

    def __init__(self, unknowns: Unknowns, parts: Sequence[ContactAssembly]) -> None:
        super().__init__(unknowns, parts)
        del self.layout  # of the first alone

    @cached_property
    def layout(self) -> CoupledRows:  # type: ignore[override]
        """Rows of the unknowns. Contacts that no problem has yet, as in one's own
        assembly, are solved for together from here on. Collective."""
        self.solve_for(self.unknowns.functions)
        return self.layout

    def solve_for(self, functions: Sequence[Function]) -> None:
        partners = tuple(part.number for part in self.parts)
        for part in self.parts:
            part.set_functions(functions, partners)
        self.layout = CoupledRows(self.unknowns, [part.layout for part in self.parts])
        surfaces = [part.surfaces for part in self.parts]
        for part in self.parts:
            part.send_rows()
            part.find_cross_points(surfaces)
