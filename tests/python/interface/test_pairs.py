"""Results by pair and by name: one slave on four masters, balances of each."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from dolfinx import fem
from interacting import LOWER, UPPER, three
from problems import COMM, DIMENSION, fix, residual, worst

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import (
    Contact,
    ContactError,
    Coulomb,
    History,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
)
from raymortar.core import compat

pytestmark = pytest.mark.mpi
LEGS, WIDTH, PITCH = 4, 0.3, 0.4
# Sideways and down, of the slab's top
MOTION = {2: (0.02, -0.03), 3: (0.02, 0.01, -0.03)}
CASES = {
    "frictionless": {},
    "friction": {"friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(500.0), "friction": Coulomb(0.3)},
}


def slab_on_legs(cell):
    """A slab that sticks out beyond four legs of unequal heights, below it."""
    dim = DIMENSION[cell]
    blocks, names = [], {}
    deep = (0.0,) * (dim - 2), (0.5,) * (dim - 2)
    for i in range(LEGS):
        names |= {f"foot {i}": 10 * i + 1, f"leg {i}": 10 * i + 2}
        left = 0.1 + PITCH * i
        sides = {"bottom": 10 * i + 1, "top": 10 * i + 2}
        lower = (left, *deep[0], 0.2 * i)
        upper = (left + WIDTH, *deep[1], 1.0)
        blocks.append(Block((2,) * dim, lower, upper, tags=sides))
    names |= {"slab": 91, "load": 92}
    lower, upper = (0.0, *deep[0], 1.0), (PITCH * LEGS + 0.1, *deep[1], 1.3)
    divisions = (9, *(2,) * (dim - 2), 2)
    blocks.append(Block(divisions, lower, upper, tags={"bottom": 91, "top": 92}))
    mesh, cell_tags, facet_tags = assemble_blocks(COMM, blocks, cell, 1)
    bodies = {str(i): i + 1 for i in range(LEGS + 1)}
    return Scene(mesh, cell_tags, facet_tags, names, bodies)


class Table:
    """The slab, pressed down on its legs and pushed along, solved."""

    def __init__(self, cell="quadrilateral", order=range(LEGS), split=False, **options):
        self.scene = scene = slab_on_legs(cell)
        dim, names = scene.mesh.geometry.dim, scene.tags
        V = compat.vector_space(scene.mesh, 1)
        self.u = fem.Function(V)
        F = residual(scene, self.u, "linear", 10.0)[0]
        self.feet = [fix(V, scene, f"foot {i}") for i in range(LEGS)]
        self.motion = [
            fem.Constant(scene.mesh, PETSc.ScalarType(0)) for _ in range(dim)
        ]
        top = [fix(V, scene, "load", k, value) for k, value in enumerate(self.motion)]
        pairs = [("slab", f"leg {i}") for i in order]
        parts = [[pair] for pair in pairs] if split else [pairs]
        self.contacts = [
            Contact(self.u, scene.facet_tags, part, names=names, **options)
            for part in parts
        ]
        bcs = [*self.feet, *top]
        self.problem = NonlinearProblem(F, self.contacts, bcs)
        self.contact = self.problem.contact
        self.end = MOTION[dim]

    def move(self, t):
        for value, end in zip(self.motion, self.end):
            value.value = t * end

    def solve(self):
        self.move(1.0)
        self.problem.solve()
        return self

    def supports(self):
        """Forces of the feet, in the order of the legs."""
        feet = {f"foot_{i}": bc for i, bc in enumerate(self.feet)}
        return np.array(list(self.problem.reactions(feet).values()))


def parts_of(resultants):
    """All numbers of some resultants, (n, numbers)."""
    return np.array(
        [np.hstack([r.force, r.normal, r.tangential, r.moment]) for r in resultants]
    )


@pytest.mark.quick
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_each_foot_takes_what_its_pair_gives(cell, case):
    """Action is reaction, leg by leg, and the legs share the load unequally."""
    table = Table(cell, **CASES[case]).solve()
    supports = table.supports()
    size = np.abs(supports).max()
    for i, support in enumerate(supports):
        force = table.contact.resultant("slab", f"leg {i}").force
        np.testing.assert_allclose(force, support, atol=1e-8 * size)
    vertical = supports[:, -1]
    assert np.all(vertical > 0.0) and vertical.max() > 1.2 * vertical.min()


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_pairs_add_up_to_the_surface(cell, case):
    contact = Table(cell, **CASES[case]).solve().contact
    whole, by_pair = contact.resultant(0), contact.results.resultants()
    assert len(by_pair) == len(contact.pairs) == LEGS
    sums = parts_of(by_pair).sum(axis=0)
    (total,) = parts_of([whole])
    np.testing.assert_allclose(sums, total, atol=1e-13 * np.abs(total).max())
    by_name = parts_of([contact.resultant("slab")])[0]
    np.testing.assert_array_equal(by_name, total)
    friction = worst(whole.tangential)
    assert (friction > 1e-9 * worst(total)) == (case != "frictionless")


@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_points_know_the_pair_of_what_they_hit(cell):
    """Legs are apart, so that the place of a point tells which it is above."""
    order = (2, 0, 3, 1)
    contact = Table(cell, order).solve().contact
    for rays_only in (False, True):
        contact.update(pair=not rays_only)
        points = contact.points()
        hit, pair = points["status"] >= 1, points["pair"]
        assert np.array_equal(pair >= 0, hit) and np.all(pair[~hit] == -1)
        leg = np.array([contact.pairs[k].master // 10 for k in pair[hit]], dtype=int)
        middle = 0.1 + PITCH * leg + WIDTH / 2
        assert np.all(np.abs(points["x"][hit, 0] - middle) < WIDTH / 2 + 0.05)
        free = COMM.allreduce(int(np.count_nonzero(pair == -1)))
        found = set().union(*COMM.allgather(set(pair.tolist())))
        assert free > 0 and found == {-1, *range(LEGS)}
        assert not np.any(points["traction"][pair == -1])


def test_table_has_tags_names_and_labels():
    scene = slab_on_legs("triangle")
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    names = scene.tags | {"other name": 2, "a volume": (2, 1), "group": (1, 12)}
    pairs = [("slab", "leg 1"), (32, 22), ("slab", 2), ("slab", "leg 1"), (32, 12)]
    contact = Contact(u, scene.facet_tags, pairs, names=names)
    shown = [(p.slave, p.master, p.surface) for p in contact.pairs]
    assert shown == [(91, 12, 0), (32, 22, 1), (91, 2, 0), (32, 12, 1)]
    assert [p.label for p in contact.pairs] == [
        "slab_leg_1",
        "leg_3_leg_2",
        "slab_leg_0",
        "leg_3_leg_1",
    ]
    assert (contact.pairs[2].slave_name, contact.pairs[2].master_name) == (
        "slab",
        "leg 0",
    )
    contact = Contact(u, scene.facet_tags, [(91, 2), (91, 12)])
    assert [p.label for p in contact.pairs] == ["91_2", "91_12"]
    assert str(contact.pairs[0]) == "(91, 2)" and contact.pairs[0].slave_name is None


def test_names_and_tags_ask_for_the_same():
    contact = Table().solve().contact
    by_name = contact.resultant("slab", "leg 2").force
    for slave, master in ((91, 22), ("slab", 22), (91, "leg 2")):
        assert np.array_equal(contact.resultant(slave, master).force, by_name)
    for asked in (("leg 2", "slab"), ("slab", "foot 2"), (91, 3)):
        with pytest.raises(ContactError, match="there is no contact of .*'leg 3'"):
            contact.resultant(*asked)
    for surface in (1, "nobody", "leg 2"):
        with pytest.raises(ContactError, match="no slave surface .*or named 'slab'"):
            contact.resultant(surface)


@pytest.mark.parametrize("split", [False, True])
def test_points_of_a_pair_are_those_that_hit_its_master(split):
    contact = Table(split=split).solve().contact
    for i in range(LEGS):
        number = i if split else 0
        points, all_points = contact.points("slab", f"leg {i}"), contact.points(number)
        chosen = all_points["pair"] == i
        for name, values in all_points.items():
            np.testing.assert_array_equal(points[name], values[chosen], err_msg=name)
        force = COMM.allreduce(points["weight"] @ points["traction"])
        pair = contact.resultant("slab", f"leg {i}").force
        np.testing.assert_allclose(force, pair, atol=1e-12 * worst(pair))
        by_tag = contact.points(91, 10 * i + 2)["x"]
        np.testing.assert_array_equal(by_tag, points["x"])
    if split:
        with pytest.raises(ContactError, match="'slab' is of several slave surfaces"):
            contact.points("slab")
    else:
        np.testing.assert_array_equal(contact.points("slab")["x"], all_points["x"])
    for asked in (("leg 2", "slab"), ("slab", "foot 2"), ("nobody",)):
        with pytest.raises(ContactError, match="there is no"):
            contact.points(*asked)


def test_nothing_is_asked_before_the_first_update():
    scene = slab_on_legs("triangle")
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    contact = Contact(u, scene.facet_tags, [(91, 2)])
    for ask in (contact.results.resultants, lambda: contact.resultant(91, 2)):
        with pytest.raises(ContactError, match="there are no results yet"):
            ask()


@pytest.mark.parametrize("case", ["frictionless", "friction"])
def test_history_has_a_column_for_each_pair(case):
    table = Table(**CASES[case])
    feet = {f"foot_{i}": bc for i, bc in enumerate(table.feet)}
    history = History(table.problem, reactions=feet)
    solver = SNESSolver(table.problem)
    LoadSteps(solver, table.move, steps=2, history=history).run()
    total = np.zeros((2, 2))
    for i in range(LEGS):
        force = history.vectors(f"force_slab_leg_{i}")
        support = history.vectors(f"reaction_foot_{i}")
        np.testing.assert_allclose(force, support, atol=1e-7 * np.abs(support).max())
        total += force
        if case == "friction":
            normal, along = (
                history.vectors(f"{part}_slab_leg_{i}")
                for part in ("normal", "tangential")
            )
            np.testing.assert_allclose(normal + along, force, atol=1e-12)
    whole = history.vectors("force_0")
    np.testing.assert_allclose(total, whole, atol=1e-12 * np.abs(whole).max())


def columns_of(pairs, names=None):
    """Columns of a slab on legs that a history has of its contact."""
    scene = slab_on_legs("triangle")
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    v = ufl.TestFunction(u.function_space)
    F = ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx
    contact = Contact(u, scene.facet_tags, pairs, names=names)
    contact.update()
    history = History(NonlinearProblem(F, contact), patches=True)
    history.record(0.0)
    return history, [name for name in history.columns if name.startswith("area_")]


def test_a_history_has_each_figure_once():
    """By the pair's name or else the number of its slave; sums by that number."""
    names = {"slab": 91, "leg": 2}
    history, columns = columns_of([(91, 2)], names)
    assert columns == ["area_slab_leg"]
    assert "force_slab_leg_x" in history.columns
    assert not [name for name in history.columns if "_0" in name]
    history, columns = columns_of([(91, 2)])
    assert columns == ["area_0"]
    assert not [name for name in history.columns if "91" in name]
    _, columns = columns_of([(91, 2), (91, 12)])
    assert columns == ["area_0", "area_91_2", "area_91_12"]


@pytest.mark.parametrize("names", [None, {"slab": 91, "leg": 2}])
def test_a_column_is_found_by_the_name_that_it_had_too(names):
    history, _ = columns_of([(91, 2)], names)
    now, before = ("0", "91_2") if names is None else ("slab_leg", "0")
    for column in ("force_{}_x", "centre_{}_y", "max_pressure_{}"):
        with pytest.warns(DeprecationWarning, match=f"now '{column.format(now)}'") as w:
            found = history[column.format(before)]
        assert w[0].filename == __file__
        np.testing.assert_array_equal(found, history[column.format(now)])
    with pytest.raises(ContactError, match="has no column 'force_1_x'"):
        history["force_1_x"]


def test_pairs_of_several_contacts_are_numbered_on():
    """A contact for each leg, of the same slave: the same forces."""
    one, split = Table().solve(), Table(split=True).solve()
    assert [p.surface for p in split.contact.pairs] == [0, 1, 2, 3]
    labels = [[p.label for p in table.contact.pairs] for table in (one, split)]
    assert labels[0] == labels[1]
    size = worst(one.contact.resultant().force)
    for i in range(LEGS):
        a, b = (t.contact.resultant("slab", f"leg {i}").force for t in (one, split))
        np.testing.assert_allclose(a, b, atol=0.02 * size)
        own = split.contacts[i].resultant().force
        np.testing.assert_array_equal(own, b)
        pairs = split.contact.points(i)["pair"]
        assert set(pairs.tolist()) <= {-1, i}
    total = np.sum([c.resultant().force for c in split.contacts], axis=0)
    np.testing.assert_allclose(split.contact.resultant("slab").force, total, atol=1e-13)


def test_pairs_that_are_called_the_same_have_their_numbers():
    blocks = three()
    twice = [blocks.contact(LOWER, method=Penalty(100.0)) for _ in range(2)]
    steps = blocks.path([*twice, blocks.contact(UPPER)], steps=2)
    contact = steps.solver.problem.contact
    a, b = (blocks.scene.tags[name] for name in LOWER)
    c, d = (blocks.scene.tags[name] for name in UPPER)
    labels = [pair.label for pair in contact.pairs]
    assert labels == [f"{a}_{b}_0", f"{a}_{b}_1", f"{c}_{d}"]
    steps.run()
    each = [one.resultant().force for one in twice]
    assert worst(each) > 0.0
    both = contact.resultant(a, b).force
    np.testing.assert_allclose(both, each[0] + each[1], rtol=1e-13)
    # One pair each, without a name: its force is that of the surface
    assert not [name for name in steps.history.columns if f"{a}_{b}" in name]
