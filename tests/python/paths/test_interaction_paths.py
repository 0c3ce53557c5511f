"""Load steps, histories and states of several contacts in one problem."""

from __future__ import annotations

import numpy as np
import pytest
from interacting import LAWS, LOWER, UPPER, difference, three
from problems import fix

from raymortar import ConvergenceError, Coulomb, History, Penalty, SNESSolver, Stick
from raymortar.paths import ArcLength
from raymortar.paths.soft_start import solve_by_small_gamma, with_line_search
from raymortar.viscous.stabilization import Stabilization

pytestmark = pytest.mark.mpi


class FailsOnce:
    """A solver whose second solve is spoilt after it has changed everything."""

    def __init__(self, solver):
        self.problem, self._solver, self.calls = solver.problem, solver, 0

    def solve(self):
        self.calls += 1
        found = self._solver.solve()
        if self.calls == 2:
            raise ConvergenceError("spoilt")
        return found


def test_a_failed_step_restores_all_contacts():
    """The path is that of the halved steps, springs and multipliers included."""
    ends, states = [], []
    for spoilt in (True, False):
        blocks = three()
        contacts = [blocks.contact(p, **law) for p, law in zip((LOWER, UPPER), LAWS)]
        path = blocks.path(contacts, steps=2, strategy=None, extrapolate=False)
        joint = path.solver.problem.contact
        if spoilt:
            path.solver = FailsOnce(path.solver)
            path._path = path._new_path()
            path.run()
            assert path.halvings == 1
            ends = [row[0] for row in path.history.rows]
            assert len(ends) == 3
        else:
            for t in ends:
                blocks.move(t)
                path.solver.solve()
                path.history.record(t)
                joint.advance()
        forces = [path.history.vectors(f"force_{i}") for i in (0, 1)]
        states.append((joint.state(), forces, path.history["friction_work"]))
    (one, forces, work), (other, forces_too, work_too) = states
    assert difference(one["unknown 0"], other["unknown 0"]) <= 1e-10
    assert work == pytest.approx(work_too, rel=1e-8)
    assert np.allclose(forces, forces_too, rtol=1e-9, atol=1e-11)
    tolerances = {"accepted": 1e-10, "springs": 1e-7, "multiplier": 1e-8}
    assert one.keys() == other.keys()
    for kind, tolerance in tolerances.items():
        names = [name for name in one if name.startswith(kind)]
        assert names
        for name in names:
            assert difference(one[name], other[name]) <= tolerance


def solved(blocks, contacts, solve):
    """Forces after one step of a way to solve."""
    problem = blocks.problem(contacts)
    blocks.move(1.0)
    solve(SNESSolver(problem, {"snes_linesearch_type": "basic"}))
    return np.array([problem.contact.resultant(i).force for i in (0, 1)])


WAYS = {
    "small gamma": solve_by_small_gamma,
    "line search": lambda solver: with_line_search(solver).solve(),
    "viscous forces": lambda solver: Stabilization(solver, 1.0).solve(
        lambda: solver.solve()[0]
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_solve_a_step_takes_several_contacts(way):
    laws = {"friction": Coulomb(0.3)}, {"method": Penalty(400.0), "friction": Stick()}
    found = []
    for solve in (WAYS[way], lambda solver: solver.solve()):
        blocks = three()
        contacts = [blocks.contact(p, **law) for p, law in zip((LOWER, UPPER), laws)]
        found.append(solved(blocks, contacts, solve))
        found[-1] = np.append(
            found[-1].ravel(), [c.assembly.gamma_scale for c in contacts]
        )
    assert np.allclose(*found, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("way", ["prescribed", "displacement", "arc", "extrapolated"])
def test_every_path_takes_several_contacts(way):
    """Without friction the end does not depend on what leads the path."""
    blocks = three()
    blocks.bcs.append(fix(blocks.V, blocks.scene, "left_1", 0))
    contacts = [blocks.contact(LOWER), blocks.contact(UPPER, method=Penalty(400.0))]
    options = {
        "arc": {"control": ArcLength()},
        "displacement": {"control": blocks.top_control()},
        "extrapolated": {"extrapolate": True},
    }.get(way, {})
    path = blocks.path(contacts, steps=2, **options)
    ends = path.run()
    assert ends[-1].factor == pytest.approx(1.0, rel=1e-8)
    found = [path.history.vectors(f"force_{i}")[-1] for i in (0, 1)]
    lone = three()
    lone.bcs.append(fix(lone.V, lone.scene, "left_1", 0))
    contacts = [lone.contact(LOWER), lone.contact(UPPER, method=Penalty(400.0))]
    wanted = solved(lone, contacts, lambda solver: solver.solve())
    assert np.allclose(found, wanted, rtol=1e-7, atol=1e-9)


def test_history_has_columns_of_all_contacts(folder):
    """Slave surfaces are numbered on; frictionless ones have no parts."""
    blocks = three()
    contacts = [blocks.contact(LOWER), blocks.contact(UPPER, friction=Coulomb(0.2))]
    path = blocks.path(contacts, steps=1, file=folder / "h.csv")
    path.run()
    names = ["force_0", "force_1", "normal_1", "tangential_1", "reaction_held"]
    wanted = [f"{name}_{x}" for name in names for x in "xy"]
    assert list(path.history.columns[6:]) == [*wanted, "friction_work"]
    (row,) = path.history.rows
    assert [row.force_1_x, row.force_1_y] == list(contacts[1].resultant().force)
    work = contacts[1].friction_work()
    assert path.solver.problem.contact.friction_work() == work
    held = {"held": blocks.bcs[0]}
    other = History(path.solver.problem, folder / "h.csv", held)
    other.resume()
    assert other.rows == path.history.rows


def test_a_checkpoint_has_all_contacts():
    """A state is taken over by contacts made alike."""
    found = []
    blocks = three()
    contacts = [blocks.contact(p, **law) for p, law in zip((LOWER, UPPER), LAWS)]
    path = blocks.path(contacts, steps=2)
    for step, _ in enumerate(path):
        if step == 0:
            kept = path.solver.problem.contact.state()
    again = three()
    copies = [again.contact(p, **law) for p, law in zip((LOWER, UPPER), LAWS)]
    problem = again.problem(copies)
    problem.contact.restore(kept)
    again.move(1.0)
    SNESSolver(problem).solve()
    found = [contact.resultant().force for contact in copies]
    wanted = [contact.resultant().force for contact in contacts]
    assert np.allclose(found, wanted, rtol=1e-9, atol=1e-12)
