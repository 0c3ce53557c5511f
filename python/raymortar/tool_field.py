"""The field on rigid tools as an unknown, such as the temperature of a punch."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .checked import is_real_number
from .errors import ContactError, require_agreement
from .system.tool_part import ToolPart


class ToolField:
    """The field on rigid tools as an unknown, one number, with a capacity.

    The tools store the flux through contact and their share of the heat of friction, by
    the implicit Euler method: capacity times change over `Contact.dt`. Give it to
    `Flux`; several fluxes may share it, and then their tools have one value.

    Parameters
    ----------
    value
        At the start.
    capacity
        What raises the value by one, >= 0: of a temperature, mass times specific heat.
        In 2D per thickness, of solids of revolution of a full turn. 0: what flows in
        flows out.
    source
        What flows into the tools from elsewhere, per time. It may be set again.

    Examples
    --------
    >>> punch = raymortar.ToolField(20.0, capacity=3.5)
    >>> flux = raymortar.Flux(contact, T, law, tool=punch)
    >>> LoadSteps(solver, apply, steps, on_accept=punch.accept)
    """

    def __init__(self, value: float, capacity: float, source: float = 0.0) -> None:
        self._start = _number("value", value)
        self.capacity, self._source = _number("capacity", capacity), 0.0
        if self.capacity < 0.0:
            raise ContactError(
                f"ToolField.capacity = {capacity!r} must not be negative"
            )
        self._part: ToolPart | None = None
        self.source = source

    def __repr__(self) -> str:
        return f"<ToolField with a capacity of {self.capacity}>"

    def of(self, comm: MPI.Comm) -> ToolPart:
        """Make the unknown, once; what stores it. Collective."""
        if self._part is None:
            require_agreement(
                comm, value=self._start, capacity=self.capacity, source=self._source
            )
            self._part = ToolPart(comm, self._start, self.capacity)
            self._part.source = self._source
        return self._part

    @property
    def _used(self) -> ToolPart:
        if self._part is None:
            raise ContactError("the ToolField is of no Flux yet: give it one, tool=")
        return self._part

    @property
    def value(self) -> float:
        """Present value. Collective."""
        return self._start if self._part is None else self._part.value

    @value.setter
    def value(self, value: float) -> None:
        self._start = _number("value", value)
        if self._part is not None:
            self._part.set(self._start)
            self._part.old = self._start

    @property
    def source(self) -> float:
        """Flux into the tools from elsewhere, per time."""
        return self._source

    @source.setter
    def source(self, source: float) -> None:
        self._source = _number("source", source)
        if self._part is not None:
            self._part.source = self._source

    @property
    def stored(self) -> float:
        """Heat that the tools have stored since the start, or since `value` was set.
        Collective."""
        return self.capacity * (self.value - self._start)

    def accept(self) -> None:
        """Accept the step: the next one starts from the present value. Collective."""
        self._used.old = self._used.value


def _number(name: str, value: Any) -> float:
    """Check a finite number."""
    if not (is_real_number(value) and np.isfinite(value)):
        raise ContactError(f"ToolField.{name} = {value!r} must be a finite number")
    return float(value)
