"""Settings of programs beside a step, which files have: places of tools, coefficients."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.errors import is_real_number
from ..core.interface.coefficients import SAME, PairCoefficients
from ..core.problem import CoupledProblem
from ..core.state import Quantity
from ..rigid.body import Body


def settings(problem: CoupledProblem, bodies: Sequence[Body]) -> Iterator[Quantity]:
    """Yield the steps so far, places of tools, and coefficients."""

    def count(steps: Array) -> None:
        problem.steps_accepted = int(steps)

    yield Quantity("steps", lambda: np.array(problem.steps_accepted), count)
    for k, body in enumerate(bodies):
        for name in ("moved", "turned"):
            of = partial(getattr, body.cpp, name), partial(setattr, body.cpp, name)
            yield Quantity(f"{name} {k}", *of)
    for k, one in enumerate(problem.contact.contacts):
        yield from _coefficients(one, k)


def _coefficients(contact: Any, k: int) -> Iterator[Quantity]:
    """Yield the coefficient of a contact, a number or one by pair of bodies, and whether
    it is that of (5.16): a path may have changed it, and automatic ones differ by
    rounding with the partition. A Function is the program's."""
    assembly = contact.assembly

    def read() -> Array | None:
        own = assembly.own_gamma
        tables = getattr(own, "tables", [own] if is_real_number(own) else None)
        if tables is None:
            return None
        return np.concatenate([np.ravel(table) for table in tables])

    def write(values: Array | None) -> None:
        if values is None:
            return
        if len(values) == 1:
            contact.set_gamma(float(values[0]))
            return
        own = read()
        if own is not None and len(own) == len(values):
            # On another partition bodies have other numbers
            ratio = np.sort(values) / np.sort(own)
            if np.ptp(ratio) <= SAME * ratio[0]:
                if abs(ratio[0] - 1.0) > SAME:
                    contact.set_gamma(ratio[0] * assembly.own_gamma)
                return
        of = contact.surfaces.interfaces
        shapes = [(len(a), len(b)) for a, b in zip(of.slave, of.master)]
        parts = np.split(values, np.cumsum([a * b for a, b in shapes])[:-1])
        tables = [part.reshape(shape) for part, shape in zip(parts, shapes)]
        contact.set_gamma(PairCoefficients(of, tables))

    def soften(is_soft: Array) -> None:
        if is_soft:
            assembly.soft_gamma = assembly.own_gamma

    yield Quantity(f"gamma {k}", read, write, may_lack=True)
    yield Quantity(f"soft {k}", lambda: np.array(int(assembly.gamma_is_soft)), soften)
