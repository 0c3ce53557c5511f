"""Linear bodies beside others: integrals that are linear are kept, the others are
assembled, and the sum is the form."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from hosts import LOWER, UPPER, meshes
from materials import MATERIALS
from problems import CELLS, COMM, SOLVERS, cellwise, fix, quadrature_degree, stack
from volumes import assert_as_assembled, counted, disturb, without_what_is_kept

import raymortar
from raymortar import SNESSolver, compat, solvers

LINEAR, CURVED = 1, 2  # tags of the lower block's cells and of the upper's
SMALL = 3e-3  # disturbance that leaves no cell inside out


def stress(name, u, mu=800.0, lmbda=1200.0):
    return MATERIALS[name][0](ufl.grad(u), mu, lmbda)


class Pair:
    """A linear block, on it one of neo-Hookean material that is pressed down.

    Parameters
    ----------
    integrals
        Takes this pair, and gives what the form has besides.
    """

    def __init__(self, cell="triangle", degree=1, integrals=None, **options):
        self.scene = scene = stack(cell, (3, 2))
        self.mesh, dim = scene.mesh, scene.mesh.geometry.dim
        V = compat.vector_space(self.mesh, degree)
        self.u, self.v = fem.Function(V), ufl.TestFunction(V)
        self.dx = ufl.Measure(
            "dx",
            domain=self.mesh,
            subdomain_data=scene.cell_tags,
            metadata={"quadrature_degree": quadrature_degree(self.mesh, degree)},
        )
        self.ds = ufl.Measure("ds", domain=self.mesh, subdomain_data=scene.facet_tags)
        self.moduli = cellwise(scene, 900.0), cellwise(scene, 800.0)
        self.load = fem.Constant(self.mesh, np.array([0.5, *[0.0] * (dim - 2), -1.0]))
        self.down = fem.Constant(self.mesh, np.array([0.003] * (dim - 1) + [-0.02]))
        F = self.part("linear", LINEAR) + self.part("neo-hookean", CURVED, 1)
        if integrals is not None:
            F += integrals(self)
        pair = [(scene.tags["slave"], scene.tags["master"])]
        contact = raymortar.Contact(self.u, scene.facet_tags, pair, **options)
        bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", value=self.down)]
        self.problem = raymortar.NonlinearProblem(F, contact, bcs)

    def part(self, material, tag, modulus=0):
        """Stresses of a body with that tag, or of all (None)."""
        P = stress(material, self.u, mu=self.moduli[modulus])
        dx = self.dx if tag is None else self.dx(tag)
        return ufl.inner(P, ufl.grad(self.v)) * dx

    def loads(self):
        """Loads on both bodies, on cells and on facets."""
        work = ufl.inner(self.load, self.v)
        sides = [self.scene.tags[name] for name in ("left_0", "right_1")]
        return -work * self.dx - sum(work * self.ds(side) for side in sides)


def assert_kept_in_part(problem):
    """Some is kept, and not all."""
    assert problem.volume.kept is not None
    assert not problem.volume.is_linear
    disturb(problem, SMALL)
    assert_as_assembled(problem)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, degree", [*((cell, 1) for cell in CELLS), ("triangle", 2)]
)
def test_residual_and_tangent_are_those_of_the_form(cell, degree):
    assert_kept_in_part(Pair(cell, degree, Pair.loads).problem)


MORE = {
    # An integral over everything beside those over bodies is theirs too
    "everywhere linear": lambda pair: pair.part("linear", None),
    "everywhere curved": lambda pair: pair.part("neo-hookean", None),
    "everywhere load": lambda pair: -pair.load[0] * pair.v[0] * pair.dx,
    "springs of both": lambda pair: sum(
        10.0 * ufl.inner(pair.u, pair.v) * pair.dx(tag) for tag in (LINEAR, CURVED)
    ),
    "springs of a side": lambda pair: 10.0
    * ufl.inner(pair.u, pair.v)
    * pair.ds(pair.scene.tags["right_1"]),
    "pressure of a side": lambda pair: 10.0
    * ufl.inner(pair.u, pair.u)
    * pair.v[0]
    * pair.ds(pair.scene.tags["left_0"]),
    # Its derivative is zero wherever there is one
    "jump": lambda pair: ufl.sign(pair.u[0]) * pair.v[0] * pair.dx(CURVED),
    "jump of a side": lambda pair: ufl.sign(pair.u[0])
    * pair.v[0]
    * pair.ds(pair.scene.tags["left_0"]),
    "u by another name": lambda pair: ufl.inner(
        fem.Function(pair.u.function_space, pair.u.x), pair.v
    )
    * pair.ds(pair.scene.tags["left_0"]),
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", MORE)
def test_each_integral_counts_once(name):
    assert_kept_in_part(Pair("triangle", integrals=MORE[name]).problem)


@pytest.mark.mpi
def test_what_is_not_linear_may_have_no_tangent():
    """A jump on a side of linear bodies."""
    scene = stack("triangle", (3, 2))
    V = compat.vector_space(scene.mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    dx = ufl.Measure("dx", domain=scene.mesh, subdomain_data=scene.cell_tags)
    ds = ufl.Measure("ds", domain=scene.mesh, subdomain_data=scene.facet_tags)
    F = sum(ufl.inner(stress("linear", u), ufl.grad(v)) * dx(tag) for tag in (1, 2))
    F += ufl.sign(u[0]) * v[0] * ds(scene.tags["left_0"])
    pair = [(scene.tags["slave"], scene.tags["master"])]
    contact = raymortar.Contact(u, scene.facet_tags, pair)
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", value=-0.02)]
    assert_kept_in_part(raymortar.NonlinearProblem(F, contact, bcs))


@pytest.mark.mpi
@pytest.mark.parametrize("linear", [0, 1])
def test_bodies_on_meshes_of_their_own(linear):
    """Each has a form of its own, over all its cells."""
    scenes = meshes()
    functions, forms, bcs = [], [], []
    for k, scene in enumerate(scenes):
        V = compat.vector_space(scene.mesh, 1)
        u, v = fem.Function(V), ufl.TestFunction(V)
        name = "linear" if k == linear else "neo-hookean"
        dx = ufl.dx(scene.mesh, metadata={"quadrature_degree": 2})
        forms.append(ufl.inner(stress(name, u), ufl.grad(v)) * dx)
        functions.append(u)
        bcs.append(fix(V, scene, ("bottom", "top")[k], value=-0.02 * k))
    tags = [scene.facet_tags for scene in scenes]
    contact = raymortar.Contact(functions, tags, [(UPPER + 1, LOWER + 2)])
    problem = raymortar.NonlinearProblem(forms, contact, bcs, u=functions)
    assert_kept_in_part(problem)


@pytest.mark.mpi
@pytest.mark.parametrize("way", ["mixed", "blocked"])
def test_of_several_unknowns(way):
    """A pressure beside the displacement: in each row what is linear is kept."""
    scene = stack("triangle", (3, 2))
    mesh = scene.mesh
    parts = ("Lagrange", 2, (2,)), ("Lagrange", 1, ())
    if way == "mixed":
        w = fem.Function(compat.mixed_space(mesh, *parts))
        (u, p), (v, q) = ufl.split(w), ufl.split(ufl.TestFunction(w.function_space))
        V, given, functions = w.function_space.sub(0), w.sub(0), w
    else:
        functions = [fem.Function(compat.space(mesh, *part)) for part in parts]
        u, p = functions
        v, q = (ufl.TestFunction(f.function_space) for f in functions)
        V, given = u.function_space, u
    dx = ufl.Measure("dx", domain=mesh, subdomain_data=scene.cell_tags)
    forms = []
    for name, tag in (("linear", LINEAR), ("neo-hookean", CURVED)):
        P = stress(name, u) + p * ufl.Identity(2)
        volume = ufl.div(u) if tag == LINEAR else ufl.det(ufl.Identity(2) + ufl.grad(u))
        forms.append((ufl.inner(P, ufl.grad(v)) * dx(tag), q * (volume - p) * dx(tag)))
    F = [sum(row[1:], row[0]) for row in zip(*forms)]
    pair = [(scene.tags["slave"], scene.tags["master"])]
    contact = raymortar.Contact(given, scene.facet_tags, pair)
    names = [(name, i) for name in ("bottom", "top") for i in range(2)]
    bcs = [fix(V, scene, name, i, -0.02 * (name == "top")) for name, i in names]
    problem = raymortar.NonlinearProblem(
        F[0] + F[1] if way == "mixed" else F, contact, bcs, u=functions
    )
    assert_kept_in_part(problem)


@pytest.mark.mpi
def test_what_changes_is_made_anew():
    pair = Pair(integrals=Pair.loads)
    problem = pair.problem
    assert_kept_in_part(problem)
    revision = problem.volume.kept.revision
    # What the others depend on is no reason
    pair.moduli[1].x.array[:] *= 2.0
    assert_kept_in_part(problem)
    # Loads are not in the tangent
    pair.load.value[0] = 3.0
    pair.down.value[:] = 0.01, -0.03
    assert_kept_in_part(problem)
    assert problem.volume.kept.revision == revision
    pair.moduli[0].x.array[:] *= 3.0
    assert_kept_in_part(problem)
    problem.bcs.append(fix(pair.u.function_space, pair.scene, "left_1", 0))
    assert_kept_in_part(problem)
    x = pair.mesh.geometry.x
    x[np.abs(x[:, 1] - 1.0) > 0.1, 0] *= 1.1  # all but the surfaces of contact
    assert_kept_in_part(problem)
    assert problem.volume.kept.revision == revision + 3


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_paths_and_reactions_are_those_without(solver):
    found = []
    for keeps in (True, False):
        pair = Pair("quadrilateral", integrals=Pair.loads)
        problem, whole = pair.problem, pair.down.value.copy()
        if not keeps:
            problem.volume = without_what_is_kept(problem)

        def apply(factor):
            pair.down.value[:] = factor * whole

        steps = raymortar.LoadSteps(solver(problem), apply, 3).run()
        forces = problem.reactions({"top": problem.bcs[1], "bottom": problem.bcs[0]})
        iterations = [step.iterations for step in steps]
        found.append((iterations, problem.u.x.array.copy(), forces))
    (iterations, u, forces), (wanted_iterations, wanted, wanted_forces) = found
    assert iterations == wanted_iterations
    assert u == pytest.approx(wanted, abs=1e-13)
    for name, force in wanted_forces.items():
        assert forces[name] == pytest.approx(force, rel=1e-10)


def test_the_linear_tangent_is_assembled_once(monkeypatch):
    problem = Pair().problem
    calls = counted(monkeypatch)
    iterations, _ = SNESSolver(problem).solve()
    assert len(calls) == iterations + 1


@pytest.mark.mpi
def test_the_matrix_has_the_entries_of_linear_bodies():
    problem = Pair("quadrilateral").problem
    A = problem.create_matrix()
    problem.volume.add_tangent(A, problem.bcs)
    K, V = problem.volume.kept.tangent, problem.u.function_space
    n, bs = V.dofmap.index_map.size_local, V.dofmap.index_map_bs
    counts = np.diff(K.getValuesCSR()[0])[: n * bs]
    upper = np.repeat(V.tabulate_dof_coordinates()[:n, 1], bs) > 1.0 + 1e-9
    prescribed = problem.prescribed
    assert (counts[upper] == prescribed[upper]).all()
    lower = ~prescribed & ~upper
    assert COMM.allreduce(counts[lower].sum()) > COMM.allreduce(2 * lower.sum())


def one_form(material, more):
    """A problem of one body's law on both, and more."""
    scene = stack("triangle", (3, 2))
    V = compat.vector_space(scene.mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    F = ufl.inner(stress(material, u), ufl.grad(v)) * ufl.dx
    F += more(u, v, ufl.Measure("ds", subdomain_data=scene.facet_tags)(11))
    pair = [(scene.tags["slave"], scene.tags["master"])]
    contact = raymortar.Contact(u, scene.facet_tags, pair)
    return F, contact, [fix(V, scene, "bottom"), fix(V, scene, "top", value=-0.02)]


@pytest.mark.parametrize(
    "more",
    [
        lambda u, v, ds: -v[0] * ufl.dx,
        lambda u, v, ds: ufl.inner(u, v) * ufl.dx,  # in the kernel of the others
        lambda u, v, ds: ufl.inner(u, v) * ds,
        lambda u, v, ds: -v[0] * ds,
    ],
    ids=["load", "springs", "springs of a side", "load of a side"],
)
def test_what_does_not_pay_is_not_kept(more):
    problem = raymortar.NonlinearProblem(*one_form("neo-hookean", more))
    assert problem.volume.kept is None


def test_a_given_tangent_is_assembled_each_time():
    """It may be another's."""
    pair = Pair()
    F, J = pair.problem.forms
    given = raymortar.NonlinearProblem(F, pair.problem.contact, pair.problem.bcs, J)
    assert given.volume.kept is None


@pytest.mark.mpi
def test_kept_factors_need_all_bodies_linear():
    solver = SNESSolver(Pair().problem, solvers.kept_factors())
    iterations, _ = solver.solve()
    context = solver.krylov_solver.getPythonContext()
    assert (context.systems, context.exceptions) == (0, iterations)
