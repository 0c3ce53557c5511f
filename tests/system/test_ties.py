"""Ties with several masters and meshes, and beside contact; what is refused."""

from __future__ import annotations

import hosts
import numpy as np
import pytest
from dolfinx import fem
from interacting import LOWER, UPPER, table, three
from problems import COMM, fix, tolerate, worst
from tying import E, build, with_gap

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Cohesive,
    ContactError,
    Coulomb,
    Penalty,
    Search,
    SNESSolver,
    Tie,
    rigid,
    solvers,
)
from raymortar.core import compat

# Several masters, tags and meshes


@pytest.mark.mpi
def test_several_masters_have_resultants_of_their_own():
    """A slab on two blocks, tied to both: forces by pair, and their balance."""
    slab = table(gap=0.0)
    scene = slab.scene
    problem = build(
        scene,
        pairs=[("bottom_2", "top_0"), ("bottom_2", "top_1")],
        bcs=lambda V, scene: [
            fix(V, scene, ["bottom_0", "bottom_1"]),
            fix(V, scene, "top_2", 1, 0.01),
            fix(V, scene, "top_2", 0, 0.02),
        ],
    )
    problem.solve(rtol=1e-12)
    contact = problem.contact
    parts = [
        contact.resultant(scene.tags["bottom_2"], scene.tags[m]).force
        for m in ("top_0", "top_1")
    ]
    whole = contact.resultant().force
    assert sum(parts) == pytest.approx(whole, rel=1e-12)
    for part in parts:
        assert part[0] < -0.01 * E * 0.1 and part[1] < 0.0


@pytest.mark.mpi
@pytest.mark.parametrize(
    "method", [None, Penalty(500.0)], ids=["multiplier", "penalty"]
)
def test_bodies_on_meshes_of_their_own(method):
    options = {"kind": Tie, "method": method}
    found = hosts.apart(hosts.meshes(), **options)
    one = hosts.together(**options)
    for case in (found, one):
        case.push(0.1, 0.2)
        SNESSolver(case.problem).solve()
    forces = [case.contact.resultant(0).force for case in (found, one)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)
    assert forces[0][1] < 0.0 and forces[0][0] < 0.0
    u = hosts.by_place(*(d.given for d in found.contact.unknowns.displacements))
    assert worst(u - hosts.by_place(*one.functions)) <= 1e-10


@pytest.mark.mpi
@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("cells", [("triangle", "quadrilateral")])
def test_facets_of_other_kinds(cells, mixed):
    """Blocks on rollers stretch without any stress across: u is linear."""
    degree = 2 if mixed else (1, 2)
    found = hosts.apart(
        hosts.meshes(cells, widths=(1.0, 1.0)),
        mixed=mixed,
        degree=degree,
        rollers=True,
        kind=Tie,
    )
    found.push(0.0, 0.2)
    solver = SNESSolver(found.problem)
    solver.solve()
    tie = found.contact
    points = tie.points()
    assert worst(points["traction"][:, 0]) <= 1e-8
    uniform = points["traction"][:, 1]
    force = tie.resultant().force[1]
    assert force < 0.0 and worst(uniform - force) <= 1e-8 * abs(force)


@pytest.mark.mpi
def test_a_tie_and_contact_in_one_problem():
    """Three blocks: the upper ones are tied, and slide as one on the lowest."""
    tied = three()
    slave, master = (tied.scene.tags[name] for name in UPPER)
    glue = Tie(tied.u, tied.scene.facet_tags, [(slave, master)], partial=True)
    contact = tied.contact(LOWER, friction=Coulomb(0.2))
    path = tied.path([contact, glue], 4)
    path.run()
    assert path.halvings == 0
    # Both interfaces carry the same force, by the columns of the history
    below, above = (path.history.vectors(f"force_{k}")[-1] for k in (0, 1))
    assert above == pytest.approx(below, rel=1e-8)
    held = path.history.vectors("reaction_held")[-1]
    assert held == pytest.approx(below, rel=1e-8)
    assert below[1] > 0.0
    # A tie has no history: it comes back
    problem = path.solver.problem
    state = problem.contact.state()
    force = glue.resultant().force
    tied.u.x.array[:] = 0.0
    problem.contact.update()
    problem.contact.restore(state)
    assert glue.resultant().force == pytest.approx(force, rel=1e-12)
    names = [f.name for f in glue.fields()]
    assert {"gap", "normal_traction", "multiplier"} <= set(names)


@pytest.mark.mpi
@pytest.mark.parametrize("method", [None, Penalty(2e3)], ids=["multiplier", "penalty"])
def test_iterative_solvers_give_the_direct_ones_answer(method):
    scene = two_blocks(COMM, 3, "hexahedron", 4, 3)
    problem = build(
        scene,
        method=method,
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(
                V, scene, "top", value=lambda x: np.tile((0.01, 0.0, 0.02), (len(x), 1))
            ),
        ],
    )
    found = []
    for options in (None, solvers.iterative()):
        problem.u.x.array[:] = 0.0
        solver = SNESSolver(problem.problem, options)
        tolerate(solver, rtol=1e-12)
        solver.solve()
        found.append(problem.u.x.array.copy())
    assert worst(found[1] - found[0]) <= 1e-8 * worst(found[0])


@pytest.mark.mpi
def test_nothing_is_done_twice():
    """One pairing, one halo, no lookups but the first, whatever the iterations."""
    problem = with_gap(
        "quadrilateral",
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", value=lambda x: np.tile((1.0, 0.5), (len(x), 1))),
        ],
    )
    assert problem.solve(rtol=1e-10) > 2
    statistics = problem.contact.statistics
    ranks = sum(COMM.allgather(bool(len(problem.contact.zones[0].multiplier_table))))
    assert ranks <= statistics.pairings <= COMM.size
    assert statistics.halo_builds == COMM.size
    assert statistics.preallocations == 1
    assert statistics.lookups == statistics.pairs


# Bad input


def made(scene=None, degree=1, **options):
    """A tie of two blocks."""
    scene = two_blocks(COMM, 2, "triangle") if scene is None else scene
    u = fem.Function(compat.vector_space(scene.mesh, degree))
    pairs = options.pop("pairs", [(scene.tags["slave"], scene.tags["master"])])
    return Tie(u, scene.facet_tags, pairs, **options)


BAD = {
    "a Tie takes no friction": {"friction": Coulomb(0.3)},
    "a Tie takes no offset": {"offset": 0.1},
    "a Tie takes no measure": {"measure": "current"},
    "a Tie takes no tangent": {"tangent": "fixed"},
    "a Tie takes no smooth": {"smooth": True},
    "a Tie takes no frame": {"frame": "master"},
    "a Tie takes no adhesion: it never opens": {"adhesion": Cohesive(1.0, 1.0)},
    "adjust must be 'keep' or 'close', not 'open'": {"adjust": "open"},
    "partial = 1 must be True or False": {"partial": 1},
    "a Tie holds at points": {"method": AugmentedLagrangian(condition="nodes")},
    "the multiplier of a Tie is a vector": {
        "method": AugmentedLagrangian(multiplier="normal")
    },
    "method must be AugmentedLagrangian or Penalty": {"method": "glue"},
    "no facets|tag 99": {"pairs": [(99, 4)]},
    "is slave and master of the same pair": {"pairs": [(3, 3)]},
    "a surface follows one body": {
        "pairs": [(3, rigid.Line((0.0, y), (0.0, 1.0))) for y in (0.8, 0.9)]
    },
}


@pytest.mark.mpi
@pytest.mark.parametrize("message", BAD)
def test_bad_options_are_told(message):
    with pytest.raises(ContactError, match=message):
        made(**BAD[message])


def test_an_unknown_argument_is_told():
    with pytest.raises(TypeError, match="no argument 'glue'"):
        made(glue=1)


@pytest.mark.mpi
def test_nodes_without_a_master_are_listed():
    """The slave is 2 wide on a master of 1: of 9 nodes 4 have none, at the rim half of
    what two stand for is covered."""
    scene = two_blocks(COMM, 2, "triangle", 3, (8, 3), upper_size=(2.0, 1.0))
    with pytest.raises(ContactError) as caught:
        made(scene)
    text = str(caught.value)
    assert "4 of 9 slave nodes of tag 3 have no master" in text
    assert "(-0.5, 1): 0, (-0.25, 1): 0, (1.25, 1): 0, (1.5, 1): 0. Move" in text
    made(scene, partial=True)


@pytest.mark.mpi
def test_surfaces_out_of_reach_are_told():
    scene = two_blocks(COMM, 2, "triangle", gap=0.3)
    search = Search(reach=0.2)
    for partial in (False, True):
        with pytest.raises(ContactError, match="6 of 6 slave nodes .* larger Search"):
            made(scene, search=search, partial=partial)
    tie = made(scene, search=Search(reach=0.4))
    for call in (lambda: tie.set_offset(0.1), lambda: tie.adjust(0.1)):
        with pytest.raises(ContactError, match="a Tie"):
            call()
