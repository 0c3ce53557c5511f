"""Each pair of bodies has a coefficient of its own, however its facets are tagged."""

import gathered
import numpy as np
import pytest
import states
from partitions import scattered
from problems import COMM, DIMENSION, build, fix, worst

from meshes.blocks import Block, rotated
from meshes.meshing import Scene, assemble_blocks
from raymortar import AugmentedLagrangian, ContactError, Coulomb, Penalty
from raymortar.core import compat
from raymortar.core.interface.coefficients import PairCoefficients, single

SOFT, HARD = 10.0, 2e5
TAGS = {"master_0": 1, "master_1": 2, "slave_0": 3, "slave_1": 4, "bottom": 5, "top": 6}
BED = [((0.0, 1.0), "0", "master_0"), ((1.0, 2.0), "1", "master_1")]
ONE = [((0.2, 1.8), "2", "slave_0")]
TWO = [((0.1, 0.9), "2", "slave_0"), ((1.1, 1.9), "3", "slave_1")]
LOW = {"2": (3, 4), "3": (2, 5), "0": (4, 3), "1": (3, 3)}  # cells across and up


def beside(cell, above=TWO, gap=0.0, rotation=None, counts=LOW, **options):
    """Blocks side by side, and others on them; none is glued to another."""
    dim = DIMENSION[cell]
    blocks, middle = [], ((0.0, 1.0),) * (dim - 2)
    for row, z, end in ((BED, 0.0, "bottom"), (above, 1.0 + gap, "top")):
        for across, body, side in row:
            ranges = (across, *middle, (z, z + 1.0))
            nx, nz = counts[body]
            lower, upper = zip(*ranges)
            tags = {"bottom": TAGS["bottom"], "top": TAGS["top"]}
            tags["top" if end == "bottom" else "bottom"] = TAGS[side]
            blocks.append(
                Block((nx,) * (dim - 1) + (nz,), lower, upper, tags=tags, body=body)
            )
    order = list(dict.fromkeys(block.body for block in blocks))
    mesh, cells, facets = assemble_blocks(
        COMM, rotated(blocks, rotation), cell, **options
    )
    bodies = {body: i + 1 for i, body in enumerate(order)}
    return Scene(mesh, cells, facets, dict(TAGS), bodies)


def retagged(scene, new):
    """The scene with other facet tags: `new` takes (tags, midpoints) to tags."""
    tags, dim = scene.facet_tags, scene.mesh.geometry.dim
    facets, middles = states.facet_midpoints(scene.mesh)
    middle = np.zeros((facets.max(initial=-1) + 1, 3))
    middle[facets] = middles
    values = np.asarray(new(tags.values, middle[tags.indices]), dtype=np.int32)
    facets = compat.meshtags(scene.mesh, dim - 1, tags.indices, values)
    return Scene(scene.mesh, scene.cell_tags, facets, scene.tags, scene.bodies)


def split(scene, name, parts):
    """Tags of the facets with one tag, cut across x."""
    numbers = [100 + i for i in range(parts)]

    def new(values, x):
        mine = values == scene.tags[name]
        all_x = gathered.concatenated(x[mine, 0])
        share = (x[:, 0] - all_x.min()) / np.ptp(all_x)
        part = np.clip((parts * share).astype(int), 0, parts - 1)
        return np.where(mine, np.take(numbers, part), values)

    cut = retagged(scene, new)
    found = gathered.found(cut.facet_tags.values)
    names = {f"{name}/{n}": n for n in numbers if n in found}
    return Scene(
        cut.mesh, cut.cell_tags, cut.facet_tags, {**cut.tags, **names}, cut.bodies
    ), list(names)


def moduli(soft=("0", "2")):
    return {body: SOFT if body in soft else HARD for body in "0123"}


def of_two_pairs(cell, degree=1, **options):
    """Rubber on rubber beside steel on steel."""
    options = {"pairs": [("slave_0", "master_0"), ("slave_1", "master_1")], **options}
    scene = options.pop("scene", None) or beside(cell)
    E = options.pop("E", None) or moduli()
    return build(scene, degree, E={b: E[b] for b in scene.bodies}, **options)


def values_of(gamma):
    """Sorted values of pairs of bodies, whatever the tags."""
    values = [gamma] if np.isscalar(gamma) else sum(gamma.values(), ())
    return sorted(set(np.round(np.log(values), 9)))


def alone(cell, i, degree=1):
    """The coefficient of one of the pairs, in a contact by itself."""
    gamma = of_two_pairs(cell, degree, pairs=[(f"slave_{i}", f"master_{i}")])
    return gamma.contact.gamma


@pytest.mark.quick
@pytest.mark.mpi(where=lambda degree, **_: degree == 1)
@pytest.mark.parametrize("degree", [1, 2])
def test_each_pair_has_its_own(cell, degree):
    gamma = of_two_pairs(cell, degree).contact.gamma
    assert isinstance(gamma, PairCoefficients)
    for i in (0, 1):
        (value,) = gamma[TAGS[f"slave_{i}"], (TAGS[f"master_{i}"],)]
        assert value == pytest.approx(alone(cell, i, degree), rel=1e-12)
    assert f"{gamma:.3g}".count("on") == 2


def merged(scene, *names):
    first = scene.tags[names[0]]
    old = [scene.tags[name] for name in names]
    return retagged(scene, lambda v, x: np.where(np.isin(v, old), first, v))


@pytest.mark.mpi
@pytest.mark.parametrize("partition", [None, scattered])
def test_tags_roles_and_numbers_do_not_matter(cell, partition):
    scene = beside(cell, partition=partition)
    both = [("slave_0", "master_0"), ("slave_1", "master_1")]
    one = [("slave_0", "master_0")]
    parts, names = split(scene, "slave_0", 3)
    fine, tops = split(scene, "master_1", 2)
    cases = [
        (scene, both[::-1]),
        (parts, [(name, "master_0") for name in names] + both[1:]),
        (fine, both[:1] + [("slave_1", top) for top in tops]),
    ]
    wanted = values_of(of_two_pairs(cell, scene=scene).contact.gamma)
    for other, pairs in cases:
        found = values_of(of_two_pairs(cell, scene=other, pairs=pairs).contact.gamma)
        assert found == wanted
    swapped = of_two_pairs(cell, scene=scene, pairs=both, swap=True)
    assert values_of(swapped.contact.gamma) == wanted
    # One tag on two bodies: each slave could meet each master
    joined = merged(merged(scene, "slave_0", "slave_1"), "master_0", "master_1")
    gamma = of_two_pairs(cell, scene=joined, pairs=one).contact.gamma
    assert set(wanted) <= set(values_of(gamma))
    assert len(gamma) == 1


@pytest.mark.parametrize("seed", [1, 2])
def test_numbering_does_not_matter(cell, seed):
    scene = beside(cell)
    wanted = values_of(of_two_pairs(cell, scene=scene).contact.gamma)
    other = states.renumbered(scene, seed)
    assert values_of(of_two_pairs(cell, scene=other).contact.gamma) == wanted


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("method", [AugmentedLagrangian, Penalty])
def test_one_pair_cut_into_tags_has_one_coefficient(cell_2d, method):
    """And one force: it was divided by the number of tags before."""
    found = []
    for parts in (1, 2, 5, 20):
        scene = beside(cell_2d, ONE, counts={**LOW, "2": (20, 3)})
        scene, names = split(scene, "slave_0", parts)
        assert len(names) == parts
        problem = of_two_pairs(
            cell_2d,
            scene=scene,
            pairs=[(name, "master_0") for name in names],
            method=method(),
            bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=push)],
        )
        problem.solve()
        zones = range(len(problem.contact.zones))
        force = sum(problem.contact.resultant(i).force for i in zones)
        found.append((problem.contact.gamma, *force))
        print(f"{parts} tags: gamma {found[-1][0]:.6g}, force {force[-1]:.6g}")
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=1e-9, abs=1e-9)


def push(x):
    return np.column_stack([*(0.0 * x.T[:-1]), np.full(len(x), -0.02)])


@pytest.mark.mpi
def test_a_slave_that_faces_several_bodies_has_that_of_each(cell):
    scene = beside(cell, ONE, gap=-0.01)
    problem = of_two_pairs(
        cell,
        scene=scene,
        E=moduli(("0",)),
        pairs=[("slave_0", "master_0"), ("slave_0", "master_1")],
        method=Penalty(),
    )
    soft, hard = sorted(set(sum(problem.contact.gamma.values(), ())))
    assert soft < 1e-3 * hard
    problem.contact.update()
    points = gathered.points(problem.contact)
    hit = points["status"] > 0
    found = (-points["pressure"] / points["gap"])[hit]
    on_soft = points["x"][hit, 0] < 1.0  # the end of block 0
    assert worst(found / np.where(on_soft, soft, hard) - 1.0) < 1e-9
    assert on_soft.any() and not on_soft.all()


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("friction", [None, Coulomb(0.3)])
@pytest.mark.parametrize("method", [AugmentedLagrangian, Penalty])
def test_soft_and_hard_pairs_are_solved_together(cell_2d, friction, method):
    """Each to the force that it has alone."""

    def press(pairs):
        problem = of_two_pairs(
            cell_2d,
            pairs=pairs,
            method=method(),
            friction=friction,
            bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=push)],
        )
        iterations = problem.solve()
        zones = range(len(pairs))
        return iterations, [problem.contact.resultant(i).force[-1] for i in zones]

    pairs = [("slave_0", "master_0"), ("slave_1", "master_1")]
    iterations, together = press(pairs)
    singles = [press([pair]) for pair in pairs]
    assert together == pytest.approx([force[0] for _, force in singles], rel=1e-6)
    assert iterations <= max(n for n, _ in singles) + 2


@pytest.mark.mpi
def test_a_multiple_of_them_can_be_set(cell_2d):
    contact = of_two_pairs(cell_2d).contact
    first = contact.gamma
    contact.set_gamma(0.1 * first)
    for tags, values in contact.gamma.items():
        assert values == pytest.approx([0.1 * v for v in first[tags]], rel=1e-14)
    with pytest.raises(ContactError, match="another Contact"):
        of_two_pairs(cell_2d).contact.set_gamma(first)
    with pytest.raises(ContactError, match="must be positive"):
        contact.set_gamma(-1.0 * first)
    contact.set_gamma(3.0)
    assert contact.gamma == contact.assembly.gamma_scale == 3.0
    contact.update()


@pytest.mark.mpi
def test_a_rigid_body_counts_for_its_own_pairs_only(cell_2d):
    """Steel that is prescribed throughout takes the stiffness of what meets it."""

    def held(V, scene):
        cells = scene.cell_tags.find(scene.bodies["1"])
        from dolfinx import fem

        dofs = fem.locate_dofs_topological(V, scene.mesh.topology.dim, cells)
        return [fem.dirichletbc(fem.Function(V), dofs)]

    soft_on = {"0": HARD, "1": 1e-3, "2": SOFT, "3": 7.0}
    gamma = of_two_pairs(cell_2d, E=soft_on, bcs=held).contact.gamma
    rigid = of_two_pairs(cell_2d, E={**soft_on, "1": 1e9}).contact.gamma
    assert values_of(gamma) == values_of(rigid)


def test_values_that_differ_by_rounding_are_one():
    assert single([np.array([[2.0, 2.0 * (1 + 1e-12)]]), np.array([[2.0]])]) == 2.0
    assert single([np.array([[2.0]]), np.array([[2.1]])]) is None


def test_moduli_are_of_pairs(cell_2d):
    """(5.5): that of the softer body, times 1e4 beside each other."""
    problem = of_two_pairs(cell_2d, bcs=lambda V, s: [fix(V, s, ["slave_0", "bottom"])])
    soft, hard = problem.contact.assembly.moduli(problem.problem.bcs)
    ratio = hard / soft
    assert 0.2 * HARD / SOFT < ratio < 5.0 * HARD / SOFT


def test_no_cell_of_a_rank_is_needed(cell_2d):
    """All cells on rank 0 of however many."""
    scene = beside(cell_2d, partition=lambda x, ranks: np.zeros(len(x), dtype=np.int32))
    gamma = of_two_pairs(cell_2d, scene=scene).contact.gamma
    assert values_of(gamma) == values_of(of_two_pairs(cell_2d).contact.gamma)
