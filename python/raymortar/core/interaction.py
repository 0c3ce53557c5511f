"""The base of one contact, and of several in one problem."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

from petsc4py import PETSc

from dolfinx.fem import Function

from .compat import Array
from .discretization.layout import CoupledRows
from .errors import require_agreement
from .hooks import hooks
from .interface.pairs import Pair, PairTable
from .state import State
from .states import States
from .system.coupled import CoupledSystem


class Interaction:
    """One contact, or several in one problem: the base of `Contact`.

    Attributes
    ----------
    system
        The coupled system of all parts: matrices, vectors, iterates.
    states
        The accepted step and the present unknowns as named arrays.
    results
        Results at points and nodes, and their sums.
    parts, zones, pair_table, unknowns
        Of all contacts, one after the other.
    """

    def __init__(self, system: CoupledSystem, pairs: PairTable) -> None:
        self.system, self.states = system, States(system)
        self.unknowns = system.unknowns
        self.parts, self.zones = system.parts, system.zones
        self.pair_table = pairs
        self.results: Any = None if hooks.results is None else hooks.results(self)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            return hooks.moved(self, name)

    @property
    @abstractmethod
    def contacts(self) -> tuple[Any, ...]:
        """The contacts, in the order of their multipliers' rows."""

    @property
    def pairs(self) -> list[Pair]:
        """All pairs, each once, in the order in which they were given.

        Tags, names and the label of their columns in a `History`; ``points()["pair"]``
        and `results.resultants` count by them.
        """
        return self.pair_table.pairs

    @property
    def layout(self) -> CoupledRows:
        """Rows of the unknowns: [forms | multipliers of each contact], rank by rank."""
        return self.system.layout

    @property
    def u(self) -> Function:
        """Displacement on its own space: the user's Function, or a copy that follows a
        part of a mixed Function."""
        return self.unknowns.u

    # Steps

    def update(self, pair: bool = True) -> None:
        """Pair and integrate at the present displacement. Collective.

        Parameters
        ----------
        pair
            False: keep segments and integration points on the slave as the last update
            with True has left them, and cast the points' rays anew. The tangent is then
            that at fixed points, whatever `tangent` says.

        Raises
        ------
        ContactError
            If the displacement is not finite, if the mesh has been moved on the contact
            surfaces since `Contact` was made, if there are no points to keep, or if
            ranks differ in `pair`.
        """
        require_agreement(self.system.comm, pair=pair)
        self.system.update(pair)

    def advance(self) -> None:
        """Accept the step: the present state becomes the old one. Collective.

        The history is the old displacement and, with friction, the tractions of the
        friction springs on each slave facet (none with ``tangential="rate"``). Results
        are updated first if the state has changed since the last `update`. They then
        belong to the accepted step until the next `update`.
        """
        if self.system.updates and any(
            part.present.has_friction for part in self.parts
        ):
            self.unknowns.pull()
            if self.system.cpp.has_moved():
                self.update()
        for part in self.parts:
            part.present.accept()

    def state(self) -> State:
        """Copy of all unknowns, multipliers and histories, for `restore`: arrays by
        name, such as ``"unknown 0"`` and ``"accepted 0"``, the accepted displacement.
        """
        return self.states.state()

    def restore(self, state: State) -> None:
        """Go back to a state of this object, or of one made alike. Collective.

        If there were results before, they are updated to this state.

        Raises
        ------
        ContactError
            If it is of other contacts, or of another mesh, partition or method; nothing
            is then changed.
        """
        self.states.restore(state)

    # Results

    def points(
        self, zone: int | str = 0, master: int | str | Any | None = None
    ) -> dict[str, Array]:
        """Arrays over this rank's integration points of a slave, at the last `update`.

        Parameters
        ----------
        zone, master
            As for `resultant`: number of the slave surface, from 0 on in the order of
            pairs, or its name. With a master: the points of this pair, whose rays hit
            this master.

        Returns
        -------
        Arrays by name, n rows each:

        - ``x`` (n, d): deformed position; ``normal`` (n, d): the slave's, outward
        - ``gap``: of the law, with the offset; negative in penetration. Length
        - ``distance``: slave to master along the normal, without the offset. Length
        - ``pressure``: pressure of the law, positive in compression, 0 where it is
          open; with a multiplier not the normal part of ``traction``. Traction
        - ``traction`` (n, d): what acts on the slave, in global coordinates. With
          ``multiplier="dual"`` both are interpolated from the nodes' values
          [theory (4.35)], and not zero at open points beside closed ones
        - ``slip`` (n, d), with friction only: T_n w since the accepted step, in the
          slave's tangent plane; ``closing``: how much of an open gap has closed since
          then; ``accumulated_slip``: length of the slip of all accepted steps. Length
        - ``gamma``: coefficient of the law. Traction per length
        - ``status``: a `Status`; ``status >= Status.STICK`` are closed points
        - ``weight``: area for which a point stands, by `measure`, of a full turn if the
          contact is axisymmetric: sums over points are integrals. **Negative** at points
          without hit that take from a whole facet what its segments cover. ``area``:
          the same in the undeformed configuration
        - ``pair``: number of the pair in `pairs`, -1 where no master is hit
        - ``X`` (n, d): undeformed position; ``facet``, ``cell``: local index of the
          slave's facet and of its cell in DOLFINx's mesh; ``reference`` (n, d): where
          the point is on the reference cell, in DOLFINx's order. A Function ``f`` on
          the slave's mesh has the values ``f.eval(X, cell)``, X with 3 columns
        - ``slave``, ``master``: indices into this rank's facets with the tags, -1 for
          no master; ``xi``, ``eta`` (n, d - 1): reference coordinates on these, in
          raymortar's own order, see ``reference``
        - ``seed``: master facet of the segment, on which the ray starts its search; -1
          on uncovered parts. ``ray``: how the search ended, 0 for a hit
        """
        found: dict[str, Array] = self.results.points(zone, master)
        return found

    def resultant(
        self, slave: int | str = 0, master: int | str | Any | None = None
    ) -> Any:
        """Contact force on a slave surface, or of a pair, its moment and its parts.

        The force acts on the slave; the master feels the opposite. With
        ``axisymmetric=True`` it is the sum over a full turn, along the axis, and
        ``radial`` has the radial part, which cancels: see `results.Resultant`.
        Collective.

        Parameters
        ----------
        slave
            With a master the slave of the pair, its name or tag. Without one its name,
            or the number of the slave surface, from 0 on in the order of pairs. With
            ``pairs="all"`` any tag, or a body as `meetings` names it.
        master
            Name or tag, or a `rigid.Body`. None: all that the slave meets.

        Raises
        ------
        ContactError
            If there is no such surface or pair.

        Examples
        --------
        >>> contact.resultant("ring", "plate").force
        >>> contact.resultant("ring").force  # of all its pairs
        """
        return self.results.resultant(slave, master)

    @property
    def statistics(self) -> Any:
        """Counts and seconds over all zones and ranks: see `Statistics`. Collective."""
        return self.results.statistics

    # Your own assembly

    @property
    def _own_assembly(self) -> Any:
        """Does what the methods below say; see `own_assembly`."""
        assert hooks.own_assembly is not None, "the core alone has no own assembly"
        return hooks.own_assembly(self)

    def create_matrix(self, a: Any) -> PETSc.Mat:
        """Matrix over [u, multiplier] with room for volume and contact. Collective.

        Parameters
        ----------
        a
            Compiled bilinear form of everything but contact.
        """
        return self._own_assembly.create_matrix(a)

    def create_vector(self, L: Any = None) -> PETSc.Vec:
        """Zero vector over [u, multiplier]; the compiled form L is not needed. Collective.

        Without a multiplier it has DOLFINx's layout and ghosts, as
        ``dolfinx.fem.petsc.create_vector(L)``; with one see `form_block`.
        """
        return self._own_assembly.create_vector(L)

    def form_block(self, b: PETSc.Vec) -> AbstractContextManager[PETSc.Vec]:
        """Rows of the form of a vector over [u, multiplier], with DOLFINx's layout and
        ghosts, for DOLFINx's functions of vectors. Collective.

        Ghosts are zero at the begin. At the end the owned rows are copied back; without a
        multiplier it is b itself.

        Examples
        --------
        >>> with contact.form_block(b) as b_u:
        ...     fem.petsc.assemble_vector(b_u, L)
        ...     b_u.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        """
        found: AbstractContextManager[PETSc.Vec] = self._own_assembly.form_block(b)
        return found

    def make_room(self, A: PETSc.Mat) -> bool:
        """Preallocate A anew if pairs have appeared that it cannot hold, or if it is an
        AIJ matrix that is not from `create_matrix`. Collective.

        If so, A loses its values, and everything attached to it except null spaces and
        the prefix. A KSP that has factorised A must be ``reset()``: PETSc does not notice
        the new pattern, and would write the new values into memory of the old one.

        Returns
        -------
        Whether A was preallocated anew.
        """
        return bool(self._own_assembly.make_room(A))

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any] = ()) -> None:
        """Add the tangent at the last `update`. Collective.

        Values may have been added to A or inserted, as DOLFINx does with constrained
        diagonals. Constrained rows and columns are left out. The caller assembles A
        afterwards.

        Raises
        ------
        ContactError
            If pairs have appeared that A cannot hold: `make_room` comes before the forms
            are assembled.
        """
        self._own_assembly.assemble_matrix(A, bcs)

    def assemble_vector(self, b: PETSc.Vec, bcs: Sequence[Any] = ()) -> None:
        """Add the residual at the last `update`. Collective.

        Constrained rows are left out, and ghosts of b are left alone: call it before or
        after ``b.ghostUpdate``.
        """
        self._own_assembly.assemble_vector(b, bcs)

    def apply_lifting(
        self, b: PETSc.Vec, bcs: Sequence[Any], x0: Array, alpha: float
    ) -> None:
        """b <- b - alpha A_c (g - x0) over constrained columns. Collective.

        Parameters
        ----------
        b
            Vector over [u, multiplier].
        bcs
            Dirichlet conditions.
        x0
            Ghosted array of `u` of this contact, ``contact.u.x.array``: also of a part
            of a mixed Function, and of bodies on meshes of their own.
        alpha
            Factor, -1 for the residual of Newton's method.
        """
        self._own_assembly.apply_lifting(b, bcs, x0, alpha)

    def from_vector(self, x: PETSc.Vec) -> None:
        """Copy the solver's unknowns to the functions and their ghosts, and to those of
        x, if it has any. Collective."""
        self._own_assembly.from_vector(x)

    def to_vector(self, x: PETSc.Vec) -> None:
        """Copy functions to the solver's unknowns; divide multipliers by gamma. Rotations
        of free rigid bodies count from the accepted step: call it after `advance` where x
        is kept. Collective."""
        self._own_assembly.to_vector(x)
