"""One contact or several: states, steps that are accepted, results."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from operator import attrgetter
from typing import Any

from .compat import Array
from .discretization.bodies import Bodies
from .discretization.unknowns import Unknowns
from .errors import raise_everywhere
from .interface.pairs import Pair, PairTable
from .interface.state import JointState, State
from .results.points import PointResults
from .results.sums import Statistics, statistics
from .rigid.body import Body
from .system.assembly import ContactAssembly
from .system.coupled import CoupledSystem

# Without Python frames: each iterate asks
_REVISION = attrgetter("present.revision")


class Interaction(PointResults, CoupledSystem):
    """One contact, or several in one problem: the base of `Contact`.

    Parts add to matrices and vectors, and each part's ``present`` pairs surfaces.
    """

    def __init__(
        self, unknowns: Unknowns, parts: Sequence[ContactAssembly], pairs: PairTable
    ) -> None:
        super().__init__(unknowns, parts)
        self.pair_table = pairs

    @property
    @abstractmethod
    def contacts(self) -> tuple[Any, ...]:
        """The contacts, in the order of their multipliers' rows."""

    @property
    def pairs(self) -> list[Pair]:
        """All pairs, each once, in the order in which they were given.

        Tags, names and the label of their columns in a `History`; ``points()["pair"]``
        and `resultants` count by them.
        """
        return self.pair_table.pairs

    @property
    def bodies(self) -> Bodies:
        """Parts of the mesh that are connected, by displacement node."""
        return self.parts[0].surfaces.bodies

    # State

    @property
    def revision(self) -> int:
        """Changes so far of what an assembled residual depends on, `u` and `multiplier`
        aside: pairing, history, coefficient."""
        return sum(map(_REVISION, self.parts))

    @property
    def u_old(self) -> Array:
        """Displacement of the accepted step, of this rank's dofs. Not to be written."""
        return self.parts[0].present.u_old

    def advance(self) -> None:
        """Accept the step: the present state becomes the old one. Collective.

        The history is the old displacement, and with friction what its springs hold on
        each slave facet (none with ``tangential="rate"``), for which results are brought
        up to date if the state is another than at the last `update`. They stay those of
        the accepted step until the next one.
        """
        if self.updates and any(part.present.has_friction for part in self.parts):
            self.unknowns.pull()
            if self.cpp.has_moved():
                self.update()
        for part in self.parts:
            part.present.accept()

    def state(self) -> Any:
        """Copy of all unknowns, multipliers and histories, for `restore`."""
        copies = tuple(part.present.copy() for part in self.parts)
        return copies[0] if len(copies) == 1 else JointState(copies)

    def restore(self, state: State) -> None:
        """Go back to a state of this object, or of one made alike. Collective.

        Where there were results before, those are of this state now.

        Raises
        ------
        ContactError
            If it is of other contacts, or of another mesh, partition or method; nothing
            is then changed.
        """
        raise_everywhere(self._comm, self._fault_of(state))
        for part, one in zip(self.parts, state.parts):
            part.present.restore(one)
        if any(part.present.updates for part in self.parts):
            self.update()

    def _fault_of(self, state: Any) -> str | None:
        """Return why the contacts cannot go back to a state, if so."""
        presents = [part.present for part in self.parts]
        if len(presents) == 1:
            return presents[0].fault_of(state)
        if not isinstance(state, JointState):
            return (
                f"state must be that of {len(presents)} contacts, as "
                f"problem.contact.state() gives it, not {type(state).__name__}"
            )
        if len(state.parts) != len(presents):
            return (
                f"the state is of {len(state.parts)} contacts, here are {len(presents)}"
            )
        faults = [one.fault_of(part) for one, part in zip(presents, state.parts)]
        found = [f"contact[{i}]: {f}" for i, f in enumerate(faults) if f is not None]
        return found[0] if found else None

    def extrapolate(self, now: State, last: State, ratio: float) -> None:
        """Add a multiple of the change between two states to all unknowns."""
        ends = [one.u if one.unknowns is None else one.unknowns for one in (now, last)]
        self.unknowns.set_values(self.unknowns.values() + ratio * (ends[0] - ends[1]))
        changes: dict[Body, Array] = {}  # several contacts may meet a body
        for part, new, old in zip(self.parts, now.parts, last.parts):
            f = part.surfaces.multiplier
            if f is not None and new.multiplier is not None:
                assert old.multiplier is not None
                f.x.array[:] += ratio * (new.multiplier - old.multiplier)
            for body, end, begin in zip(part.layout.bodies, new.freedoms, old.freedoms):
                totals = body.freedom.totals_of
                changes[body] = ratio * (totals(end) - totals(begin))
        for body, moved in changes.items():
            body.freedom.values = body.freedom.values + moved

    def go_back(self, begin: State, share: float) -> None:
        """Take back all but a share of the change of all unknowns since a state."""
        arrays = [(self.u.x.array, begin.u)]
        known: dict[Body, Array] = {}  # several contacts may meet a body
        for part, old in zip(self.parts, begin.parts):
            f = part.surfaces.multiplier
            if f is not None and old.multiplier is not None:
                arrays.append((f.x.array, old.multiplier))
            known.update(zip(part.layout.bodies, old.freedoms))
        arrays += [
            (body.freedom.values, old[: len(body.freedom)])
            for body, old in known.items()
        ]
        for values, start in arrays:
            values[:] = start + share * (values - start)

    @property
    def results(self) -> PointResults:
        """Results at the integration points: its own methods."""
        return self

    @property
    def statistics(self) -> Statistics:
        """Counts and seconds over all zones and ranks: see `Statistics`. Collective."""
        counts = statistics(self.zones, self.layout)
        counts.preallocations = self.preallocations
        return counts
