"""Bodies on meshes of their own, against the same bodies on one mesh."""

from __future__ import annotations

from functools import lru_cache, partial

from mpi4py import MPI

import gathered
import host_solutions
import hosts
import interacting
import numpy as np
import problems
import pytest
from dolfinx import fem
from host_solutions import PUSHES
from hosts import LOWER, UPPER
from problems import SOLVERS, worst

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import ContactError, Coulomb, LoadSteps, Penalty
from raymortar.core import compat

CASES = {
    "degree 1": {"degree": 1, "friction": Coulomb(0.3)},
    "degree 2": {"degree": 2},
    "penalty": {"method": Penalty()},
    "Taylor-Hood": {"mixed": True, "friction": Coulomb(0.3)},
}


solve = partial(host_solutions.solve, solver=SOLVERS[-1])


def displacements(found):
    """Of both bodies, by place."""
    given = [d.given for d in found.contact.unknowns.displacements]
    of_parts = [compat.element_info(f.function_space).is_sub_space for f in given]
    own = [f.collapse() if part else f for f, part in zip(given, of_parts)]
    return hosts.by_place(*own)


@lru_cache(maxsize=None)
def apart(case):
    found = hosts.apart(hosts.meshes(), **CASES[case])
    return found, solve(found)


@pytest.mark.mpi
@pytest.mark.parametrize("case", CASES)
def test_the_answer_is_that_of_one_mesh(case):
    (found, iterations), one = apart(case), hosts.together(**CASES[case])
    assert found.contact.gamma == pytest.approx(one.contact.gamma, rel=1e-12)
    assert solve(one) == iterations
    u = displacements(one)
    assert worst(displacements(found) - u) < 1e-9 * worst(u)
    force = one.contact.resultant(0).force
    assert found.contact.resultant(0).force == pytest.approx(force, rel=1e-9)
    assert found.contact.system.bodies.count == 2


@pytest.mark.mpi
def test_fields_are_functions_on_the_mesh_of_the_slave():
    def function(scene, slope):
        f = fem.Function(compat.scalar_space(scene.mesh, 1))
        f.interpolate(lambda x: slope * (1.0 + x[0]))
        return f

    def fields(scene):
        return {
            "offset": function(scene, -0.01),
            "friction": Coulomb(function(scene, 0.3)),
        }

    scenes = hosts.meshes()
    found = hosts.apart(scenes, **fields(scenes[1]))
    one = hosts.together(
        offset=lambda x: -0.01 * (1.0 + x[0]),
        friction=Coulomb(lambda x: 0.3 * (1.0 + x[0])),
    )
    assert solve(found) == solve(one)
    u = displacements(one)
    assert worst(displacements(found) - u) < 1e-9 * worst(u)
    with pytest.raises(ContactError, match="offset is a Function on another mesh"):
        found.contact.set_offset(function(scenes[0], 0.1))
    with pytest.raises(ContactError, match="mu is a Function on another mesh"):
        hosts.apart(scenes, friction=fields(scenes[0])["friction"])


@pytest.mark.mpi
def test_the_answer_in_3d_is_that_of_one_mesh():
    divisions, push = (2, 1), [(0.02, 0.0, -0.05)]
    scenes = hosts.meshes(("hexahedron",) * 2, divisions)
    found = hosts.apart(scenes, friction=Coulomb(0.3))
    one = hosts.together(cell="hexahedron", divisions=divisions, friction=Coulomb(0.3))
    assert solve(found, pushes=push) == solve(one, pushes=push)
    u = displacements(one)
    assert worst(displacements(found) - u) < 1e-9 * worst(u)


@pytest.mark.mpi
def test_ranks_give_the_answer_of_one(monkeypatch):
    found, iterations = apart("degree 1")
    u = displacements(found)
    with monkeypatch.context() as patch:
        patch.setattr(problems, "COMM", MPI.COMM_SELF)
        patch.setattr(hosts, "COMM", MPI.COMM_SELF)
        alone = hosts.apart(hosts.meshes(), **CASES["degree 1"])
        assert solve(alone) == iterations
        assert worst(displacements(alone) - u) < 1e-12


@pytest.mark.mpi
def test_cells_of_two_kinds_meet():
    """Triangles on quadrilaterals: a uniform squeeze is exact on both."""
    found = hosts.apart(hosts.meshes(("quadrilateral", "triangle")))
    first = hosts.apart(hosts.meshes())
    for one in (found, first):
        assert max(solve(one, pushes=[(0.0, -0.05)])) <= 6
    forces = [one.contact.resultant(0).force[1] for one in (found, first)]
    assert forces[0] == pytest.approx(forces[1], rel=0.05)


@pytest.mark.mpi
def test_the_tangent_is_the_derivative():
    found = hosts.apart(hosts.meshes(), **CASES["degree 1"])
    found.push(*PUSHES[0])
    SOLVERS[-1](found.problem).solve()
    assert hosts.tangent_error(found, 0.01) < 1e-5


@pytest.mark.mpi
def test_paths_states_and_reactions():
    found = hosts.apart(hosts.meshes(), **CASES["degree 1"])
    history = raymortar.History(found.problem)
    LoadSteps(
        SOLVERS[0](found.problem),
        lambda t: found.push(0.0, -0.06 * t),
        steps=2,
        history=history,
        progress=False,
    ).run()
    assert (np.diff(history.vectors("force_0")[:, 1]) > 0.0).all()
    state, u = found.contact.state(), displacements(found)
    force = found.contact.resultant(0).force
    above = [bc for i, bc in enumerate(found.problem.bcs) if i % 2]
    reaction = found.problem.reactions({"above": above})["above"]
    assert reaction == pytest.approx(-force, rel=1e-8)
    solve(found, pushes=PUSHES[1:])
    found.contact.restore(state)
    assert worst(displacements(found) - u) == 0.0


def three_meshes():
    """The bodies of `interacting.table`, each a scene of its own."""
    boxes = [((3, 3), (-0.1, 0.0), (0.4, 0.5)), ((3, 3), (0.8, 0.0), (1.3, 0.5))]
    boxes.append(((6, 2), (0.0, 0.5), (1.2, 1.0)))
    scenes = []
    for i, box in enumerate(boxes):
        tags = {"bottom": 10 * (i + 1) + 1, "top": 10 * (i + 1) + 2}
        mesh, cell_tags, facet_tags = assemble_blocks(
            problems.COMM, [Block(*box, tags=tags)], "quadrilateral", 1
        )
        scenes.append(Scene(mesh, cell_tags, facet_tags, tags, {"body": 1}))
    return scenes


def test_a_slave_meets_masters_on_several_meshes_in_a_list_of_contacts():
    """The way out that the error names; the answer is that of one mesh."""
    scenes, one = three_meshes(), interacting.table()
    u = [fem.Function(compat.vector_space(scene.mesh, 1)) for scene in scenes]
    tags = [scene.facet_tags for scene in scenes]
    with refused("make a Contact for each of these, and give NonlinearProblem"):
        raymortar.Contact(u, tags, [(31, 12), (31, 22)])
    contacts = [raymortar.Contact(u, tags, [(31, master)]) for master in (12, 22)]
    F = [problems.residual(s, f, E=interacting.E)[0] for s, f in zip(scenes, u)]
    bcs = [
        problems.fix(f.function_space, scene, "bottom", value=0.0)
        for scene, f in zip(scenes[:2], u)
    ]
    motion = interacting.MOTION[2]
    top = lambda x: np.tile(motion, (len(x), 1))  # noqa: E731
    bcs.append(problems.fix(u[2].function_space, scenes[2], "top", value=top))
    problem = raymortar.NonlinearProblem(F, contacts, bcs, u=u)
    SOLVERS[-1](problem).solve()
    same = [one.contact(pair) for pair in (interacting.ON_FIRST, interacting.ON_SECOND)]
    one.move(1.0)
    SOLVERS[-1](one.problem(same)).solve()
    for a, b in zip(contacts, same):
        force = b.resultant().force
        assert worst(a.resultant().force - force) <= 1e-9 * worst(force)
    v = hosts.by_place(one.u)
    assert worst(hosts.by_place(*u) - v) <= 1e-9 * worst(v)


@pytest.mark.mpi
def test_bodies_that_nothing_holds_are_named():
    scenes = hosts.meshes(gap=0.1)
    found = hosts.apart(scenes)
    found.problem.bcs[:] = found.problem.bcs[::2]  # of the lower one
    found.functions[1].x.array[1::2] = -0.05
    found.contact.update()
    sentences = raymortar.diagnose.lost_contact.unheld(found.problem)
    assert gathered.everywhere(len(sentences) == 1)
    assert "is held by nothing along x, y" in sentences[0]


# What cannot work


@pytest.fixture(scope="module")
def scenes():
    return hosts.meshes(divisions=(2, 2))


def refused(pattern):
    return pytest.raises(ContactError, match=pattern)


def contact_of(scenes, degrees=(1, 1), pairs=((UPPER + 1, LOWER + 2),), tags=None):
    u = [
        fem.Function(compat.vector_space(scene.mesh, degree))
        for scene, degree in zip(scenes, degrees)
    ]
    tags = [scene.facet_tags for scene in scenes] if tags is None else tags
    return raymortar.Contact(u, tags, list(pairs))


def test_tags_are_a_list(scenes):
    with refused("facet_tags must be a list of 2, one for each mesh"):
        contact_of(scenes, tags=scenes[0].facet_tags)


def test_a_tag_is_on_one_mesh(scenes):
    twice = [scenes[0], hosts.meshes(divisions=(2, 2))[0]]
    with refused(
        r"tag \d+ are on several meshes: use each tag number on one mesh only"
    ):
        contact_of(twice)
    with refused("same pair: use each tag number on one mesh only"):
        contact_of(twice, pairs=[(LOWER + 2, LOWER + 2)])


def test_slaves_are_on_one_mesh(scenes):
    pairs = [(UPPER + 1, LOWER + 2), (LOWER + 1, UPPER + 2)]
    with refused(r"the slave tags \[21, 11\] are on different meshes"):
        contact_of(scenes, pairs=pairs)


def test_one_mesh_has_one_displacement(scenes):
    with refused("are on one mesh: one Function serves all of its bodies"):
        contact_of([scenes[0], scenes[0]])


def test_one_residual_is_refused(scenes):
    contact = contact_of(scenes)
    with refused("are on meshes of their own: F must be a list of residuals"):
        raymortar.NonlinearProblem(0, contact)


def test_viscous_forces_are_for_one_mesh():
    found = hosts.apart(hosts.meshes())
    solver = SOLVERS[0](found.problem)
    with refused("are on meshes of their own: this is for bodies on one mesh"):
        LoadSteps(solver, lambda t: None, stabilize=True)


def test_pictures_are_of_one_mesh(scenes, tmp_path):
    with refused("are on meshes of their own: this is for bodies on one mesh"):
        raymortar.plot(contact_of(scenes), tmp_path / "contact.png")
