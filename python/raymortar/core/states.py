"""The accepted step and the present unknowns of the contacts of a problem."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from .compat import Array
from .errors import raise_everywhere
from .state import (
    Owners,
    Quantity,
    State,
    common,
    copy_of,
    fault_of,
    of_function,
    of_part,
)
from .state import restore as write_all
from .system.coupled import CoupledSystem


class States:
    """Arrays of the accepted step and the present unknowns of contacts. Collective.

    Attributes
    ----------
    owners
        Have further arrays: ``contact.states.owners["motion"] = motion``.
    """

    def __init__(self, system: CoupledSystem) -> None:
        self._system, self.owners = system, Owners()

    @property
    def u_old(self) -> Array:
        """Displacement of the accepted step, of this rank's dofs. Not to be written."""
        return self._system.parts[0].present.u_old

    def quantities(self) -> Iterator[Quantity]:
        """Yield the arrays of the accepted step and the present unknowns, each once, with
        what further owners have."""
        yield from self._of_contact()
        yield from self.owners

    def _of_contact(self) -> Iterator[Quantity]:
        """Yield the arrays of contact itself."""
        unknowns, first = self._system.unknowns, 0
        yield common("contacts", [len(self._system.parts)], _other_number)
        for k, f in enumerate(unknowns.functions):
            yield of_function(f"unknown {k}", f, is_unknown=True)
        for k, one in enumerate(unknowns.displacements):
            yield self._accepted(k, one.u.function_space)
        for k, part in enumerate(self._system.parts):
            yield from part.present.quantities(k, first)
            first += len(part.zones)
        for k, body in enumerate(self._free):
            of = body.freedom.state, body.freedom.restore
            yield Quantity(f"free body {k}", *of, is_unknown=True)

    def _accepted(self, k: int, V: Any) -> Quantity:
        """The displacement of a mesh at the accepted step, which parts have alike."""
        places = self._system.unknowns.u_places(k)
        first, *others = [
            of_part(f"accepted {k}", part.present, "u_old", places, V)
            for part in self._system.parts
        ]

        def write(values: Array) -> None:
            for one in (first, *others):
                one.write(values)

        return replace(first, write=write)

    @property
    def _free(self) -> list[Any]:
        """The free rigid bodies, each once: several contacts may meet a body."""
        return list(
            dict.fromkeys(b for part in self._system.parts for b in part.layout.bodies)
        )

    def changing(self) -> list[Quantity]:
        """The arrays that a solve changes: unknowns, multipliers, free bodies."""
        return [one for one in self._of_contact() if one.is_unknown]

    def _fields(self) -> list[Quantity]:
        """Unknowns and multipliers."""
        return [one for one in self.changing() if one.by is not None]

    def values_of(self, state: State) -> Array:
        """All local unknowns in a state."""
        count = len(self._system.unknowns.functions)
        arrays = [state[f"unknown {k}"] for k in range(count)]
        return arrays[0] if count == 1 else np.concatenate(arrays)

    def u_of(self, state: State) -> Array:
        """The displacement in a state, of this rank's dofs."""
        return self.values_of(state)[self._system.unknowns.u_local]

    def state(self) -> State:
        """Copy of all unknowns, multipliers and histories, for `restore`: arrays by
        name, such as ``"unknown 0"`` and ``"accepted 0"``, the accepted displacement.
        """
        self._system.unknowns.pull()
        return copy_of(self.quantities())

    def restore(self, state: State) -> None:
        """Go back to a state of this object, or of one made alike. Collective.

        If there were results before, they are updated to this state.

        Raises
        ------
        ContactError
            If it is of other contacts, or of another mesh, partition or method; nothing
            is then changed.
        """
        raise_everywhere(self._system.comm, fault_of(state, self.quantities()))
        write_all(state, self.quantities())
        self.owners.note(state)
        for part in self._system.parts:
            part.present.restored()
        if any(part.present.updates for part in self._system.parts):
            self._system.update()

    def extrapolate(self, now: State, last: State, ratio: float) -> None:
        """Add a multiple of the change between two states to all unknowns."""
        for one in self._fields():
            values = np.asarray(one.read())
            one.write(values + ratio * (now[one.name] - last[one.name]))
        for k, body in enumerate(self._free):
            end, begin = (
                body.freedom.totals_of(s[f"free body {k}"]) for s in (now, last)
            )
            body.freedom.values = body.freedom.values + ratio * (end - begin)
        self._system.unknowns.pull()

    def go_back(self, begin: State, share: float) -> None:
        """Take back all but a share of the change of all unknowns since a state."""
        for one in self._fields():
            start = begin[one.name]
            one.write(start + share * (np.asarray(one.read()) - start))
        for k, body in enumerate(self._free):
            start = begin[f"free body {k}"][: len(body.freedom)]
            body.freedom.values = start + share * (body.freedom.values - start)
        self._system.unknowns.pull()


def _other_number(there: Array, here: Array) -> str:
    """Say that a state is of more contacts or fewer."""
    return f"the state is of {there[0]:.0f} contacts, here are {here[0]:.0f}"
