"""Blocks of the guides run as they are printed, after what their pages assume, and no
contact in them warns.

`BEFORE` has, for each Python block of a page, the statements that a program has before it;
None where another test runs the block.
"""

from __future__ import annotations

import inspect
import warnings

import dolfinx.fem.petsc
import pytest
from dolfinx import fem
from programs import ROOT, blocks_of

from raymortar import ContactWarning
from raymortar.core.compat.generation import HAS_UFL_ELEMENTS

START = (
    blocks_of("docs/recipes.md", "python")[0]
    + """
tag = {name: group[1] for name, group in names.items()}
pairs = [(tag["upper_bottom"], tag["lower_top"])]
facet_tags = tags = facets
down = fem.Constant(mesh, np.zeros(2))
bcs = [tools.prescribe(V, bottom), tools.prescribe(V, top, down)]

def press(t):
    down.value[1] = -0.1 * t

apply = slide = load = press
"""
)
PROBLEM = """
contact = raymortar.Contact(u, facets, pairs)
problem = raymortar.NonlinearProblem(residual, contact, bcs=bcs)
solver = problem.snes_solver
history = raymortar.History(problem)
"""
HEAT = """
S = tools.scalar_space(mesh, 1)
T, s = fem.Function(S, name="T"), ufl.TestFunction(S)
F_u, F_T = residual, ufl.inner(ufl.grad(T), ufl.grad(s)) * ufl.dx
bcs += [tools.prescribe(S, top, 1.0), tools.prescribe(S, bottom, 0.0)]

def conductance(T_s, T_m, p, g, v):
    return 2.0 * (T_s - T_m)
"""
SPACE = """
bodies = io.read_gmsh("meshes/two_blocks.msh", comm)
mesh, facets, names = bodies.mesh, bodies.facet_tags, bodies.names
tag = {"top": names["lower_top"][1]}
V = tools.vector_space(mesh, 1)
u, v, du = fem.Function(V), ufl.TestFunction(V), ufl.TrialFunction(V)
residual = ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))) * ufl.dx
bcs = [tools.prescribe(V, bodies.find(name)) for name in ("bottom", "top")]
contact = raymortar.Contact(u, facets, [(6, 5)])
"""
BALL = """
from dolfinx import mesh as dmesh
from raymortar import compat

corners = [[-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]]
mesh = dmesh.create_box(comm, corners, [12, 12, 6], dmesh.CellType.hexahedron)
found = [
    dmesh.locate_entities_boundary(mesh, 2, lambda p, z=z: np.isclose(p[2], z))
    for z in (0.0, 1.0)
]
places = np.concatenate(found)
values = np.repeat(np.array([1, 2], dtype=np.int32), [len(one) for one in found])
order = np.argsort(places)
facets = compat.meshtags(mesh, 2, places[order], values[order])
tag = {"top": 2}
V = tools.vector_space(mesh, 1)
u, v = fem.Function(V), ufl.TestFunction(V)
residual = ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))) * ufl.dx
bcs = [tools.prescribe(V, found[0])]
"""
MESHES = """
from dolfinx import mesh as dmesh
from raymortar import compat

def body(x, y, of_sides):
    mesh = dmesh.create_rectangle(comm, [[x, y], [x + 1.0, y + 1.0]], [2, 2])
    V = tools.vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    sides = [(0, x), (0, x + 1.0), (1, y), (1, y + 1.0)]
    found = [
        dmesh.locate_entities_boundary(mesh, 1, lambda p, i=i, at=at: np.isclose(p[i], at))
        for i, at in sides
    ]
    tags = np.repeat(np.array(of_sides, dtype=np.int32), [len(one) for one in found])
    places = np.concatenate(found)
    order = np.argsort(places)
    tagged = compat.meshtags(mesh, 1, places[order], tags[order])
    F = ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx
    return u, tagged, F, tools.prescribe(V, found[0])
"""
OWN = """
pair, size = True, 1.0
contact = raymortar.Contact(
    u, facets, pairs, raymortar.Penalty(), friction=raymortar.Coulomb(0.3)
)
contact.update()
du = ufl.TrialFunction(V)
L, a = fem.form(residual), fem.form(ufl.derivative(residual, u, du))
A, b = contact.create_matrix(a), contact.create_vector(L)
x = b.duplicate()
down.value[:] = 0.02, -0.05
"""
LOOP = OWN + blocks_of("docs/your_own_assembly.md", "python")[1]
README_OWN = (
    OWN
    + "import dolfinx.fem.petsc\nfrom petsc4py import PETSc\n"
    + ("ADD, REVERSE = PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE")
)
BEFORE: dict[str, list[str | None]] = {
    "README.md": [None, None, README_OWN],
    "docs/axisymmetry.md": ["", None],
    "docs/condensed.md": [
        "F, times, size = residual, (0.5, 1.0), 1.0\n"
        "names = {'slave': tag['upper_bottom'], 'master': tag['lower_top']}",
        "import dolfinx\nfrom petsc4py import PETSc\nF, options = residual, {}\n"
        "dual = raymortar.AugmentedLagrangian(condition='nodes', multiplier='dual')\n"
        "contact = raymortar.Contact(u, facets, pairs, dual)\n"
        "problem = raymortar.CondensedProblem(F, u, contact, bcs=bcs)",
        "from types import SimpleNamespace\nfrom petsc4py import PETSc\n"
        "solver = SimpleNamespace(krylov_solver=PETSc.KSP().create(mesh.comm))",
    ],
    "docs/dynamics.md": [
        "rho, v0, history, energy = 1.0, fem.Function(V), None, energy * ufl.dx\n"
        "stresses_and_loads = residual",
        PROBLEM + "rho, alpha, beta = 1.0, 0.1, 0.2\n"
        "def eps(w):\n    return ufl.sym(ufl.grad(w))\n"
        "def sigma(w):\n    return 2.0 * eps(w)\n",
        PROBLEM + "from raymortar.dynamics import Inertia, TimeSteps\n"
        "a = ufl.TrialFunction(V)\n"
        "inertia = Inertia(ufl.inner(a, v) * ufl.dx, contact)",
        "shape = rigid.Sphere((0.0, 0.0, 0.0), 1.0)",
    ],
    "docs/first_contact.md": [None, PROBLEM],
    "docs/fluxes.md": [
        HEAT,
        HEAT + "bcs = bcs[2:]",
        HEAT + "bcs, names = bcs[2:], {'upper': 6, 'lower': 5}\n"
        "contact = raymortar.Contact(u, facets, pairs)",
        HEAT + "ball = rigid.Body(rigid.Circle((0.5, 1.3), 0.3))\n"
        "contact = raymortar.Contact(u, facets, [(tag['lower_top'], ball)])",
        "F = residual",
    ],
    "docs/from_dolfinx.md": [None],
    "docs/load_steps.md": [
        PROBLEM,
        PROBLEM + "from types import SimpleNamespace\n"
        "material = SimpleNamespace(accept=lambda: None, go_back=lambda: None)",
        "fdim, loading = 1, fem.Constant(mesh, 0.0)\n"
        "ds = ufl.Measure('ds', mesh, subdomain_data=facets)\n"
        "residual += loading * v[1] * ds(tag['top'])\n"
        "bcs = [bcs[0], tools.prescribe(V, top, component=0)]\n"
        + PROBLEM
        + "from raymortar.core import compat\n"
        "values = np.choose(facets.values - 3, [4, 3, 5, 6]).astype(np.int32)\n"
        "facets = compat.meshtags(mesh, 1, facets.indices, values)\n"
        "def apply(t):\n    loading.value = t\n",
    ],
    "docs/output.md": [
        PROBLEM + "import h5py, meshio\n"
        "history = raymortar.History(problem, 'history.csv')\n"
        "for ending in ('pvd', 'xdmf'):\n"
        "    steps = raymortar.LoadSteps(\n"
        "        solver, press, 2, history=history, output=f'run.{ending}'\n"
        "    )\n"
        "    steps.run()",
        PROBLEM + "import pickle\n"
        "steps = raymortar.LoadSteps(solver, press, 2)\nstep = next(iter(steps))",
        PROBLEM + "plastic_strain = fem.Function(V)",
        PROBLEM,
    ],
    "docs/parallel.md": [
        "from shutil import copy\ncopy('meshes/two_blocks.msh', 'press.msh')",
        "from shutil import copy\ncopy('meshes/two_blocks.msh', 'hip.msh')\n"
        "from raymortar import partitions\ncentre = np.zeros(3)",
        "LENGTH = 1.0",
        PROBLEM,
    ],
    "docs/parameters.md": [
        "from raymortar.core import compat\n"
        "values = np.choose(facets.values - 3, [8, 9, 7, 3]).astype(np.int32)\n"
        "facets = compat.meshtags(mesh, 1, facets.indices, values)",
        "bodies = io.read_gmsh('meshes/press_fit.msh', comm, gdim=2)\n"
        "mesh, facets, names = bodies.mesh, bodies.facet_tags, bodies.names\n"
        "pairs = [(names['shaft_outside'][1], names['hub_inside'][1])]\n"
        "u = fem.Function(tools.vector_space(mesh, 1))",
        PROBLEM,
    ],
    "docs/adjoint.md": [
        "from petsc4py import PETSc\nfrom raymortar import NonlinearProblem\n"
        "E = fem.Constant(mesh, PETSc.ScalarType(1.0))\n"
        "load = fem.Constant(mesh, PETSc.ScalarType((0.0, 0.0)))\n"
        "residual = E * residual - ufl.inner(load, v) * ufl.dx\npress(1.0)" + PROBLEM,
        "from raymortar import NonlinearProblem, adjoint\n"
        "E = fem.Constant(mesh, 1.0)\nmeasured = np.zeros(10)\n"
        "nodes = raymortar.AugmentedLagrangian(condition='nodes')\n"
        "law = raymortar.Coulomb(0.3)\n"
        "contact = raymortar.Contact(u, facets, pairs, nodes, law)\n"
        "problem = NonlinearProblem(E * residual, contact, bcs)\n"
        "solver = problem.snes_solver",
    ],
    "docs/friction.md": ["", "", PROBLEM + "step = 0.0"],
    "docs/recipes.md": [None] * 5,
    "docs/recipes_joints.md": [None] * 3,
    "docs/recipes_solving.md": [None] * 5,
    "docs/rigid.md": [
        BALL,
        "",
        "import meshio\npoints = np.vstack([np.zeros(3), np.eye(3)])\n"
        "faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])\n"
        "meshio.write('punch.stl', meshio.Mesh(points, [('triangle', faces)]))",
        "",
    ],
    "docs/solving.md": [
        SPACE + "def strain_of(w):\n"
        "    e = ufl.sym(ufl.grad(w))\n"
        "    pairs = (0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)\n"
        "    return ufl.as_vector([e[pair] * (1 + (pair[0] != pair[1])) for pair in pairs])\n"
        "def law(strain):\n"
        "    return strain, np.broadcast_to(np.eye(6), (*strain.shape, 6))",
        PROBLEM,
    ],
    "docs/surfaces.md": ["names = {'skin': tag['lower_top']}", "", None],
    "docs/tie.md": [
        "tag = {'core': 6, 'shell': 5}",
        "glue = raymortar.Tie(u, facets, pairs)\n"
        "contact = raymortar.Contact(u, facets, pairs, raymortar.Penalty())",
        None,  # test_rigid_tie
        None,  # test_pretension
        "names = {'tape': names['upper_bottom'], 'plate': names['lower_top']}",
        "from dolfinx import mesh as dmesh\nfrom raymortar.core import compat\n"
        "right = dmesh.locate_entities_boundary(mesh, 1, lambda x: x[0] > 0.45)\n"
        "half = np.intersect1d(right, facets.find(tag['lower_top']))\n"
        "values = np.where(np.isin(facets.indices, half), 9, facets.values)\n"
        "facet_tags = compat.meshtags(mesh, 1, facets.indices, values.astype(np.int32))\n"
        "F, SEAL, GROOVE, STOP = residual, tag['upper_bottom'], tag['lower_top'], 9",
    ],
    "docs/unknowns.md": [
        "import basix.ufl\nmu, kappa = 1.0, 1e3",
        "S = tools.scalar_space(mesh, 1)\np, q = fem.Function(S), ufl.TestFunction(S)\n"
        "F_u, F_p = residual, p * q * ufl.dx",
        MESHES + "RING, PLATE = 3, 8\n"
        "(u_1, facet_tags_1, F_1, one), (u_2, facet_tags_2, F_2, other) = (\n"
        "    body(0.0, 1.0, (1, 2, 3, 4)), body(0.0, 0.0, (5, 6, 7, 8))\n"
        ")\nbcs = [one, other]",
        MESHES + "parts = [\n"
        "    body(0.0, 0.0, (1, 1, 2, 2)), body(-1.0, 0.0, (3, 4, 5, 5)),\n"
        "    body(1.0, 0.0, (6, 7, 8, 8)),\n"
        "]\n"
        "u, facet_tags, F, bcs = map(list, zip(*parts))\n"
        "SLAB, LEFT, RIGHT = 1, 4, 6",
        None,
    ],
    "docs/your_own_assembly.md": [
        OWN,
        OWN,
        LOOP,
        LOOP,
        LOOP.replace(
            "contact.update()\n    with", "contact.update(pair=pair)\n    with"
        )
        + "def solve(x):\n"
        "    for _ in range(20):\n"
        "        residual_at(x, b)\n"
        "        tangent_at(x, A)\n"
        "        ksp.solve(b, dx)\n"
        "        x.axpy(-1.0, dx)\n"
        "        if dx.norm() < 1e-14:\n"
        "            return\n",
    ],
}

# Fewer steps than the pages have, and forces after a solve
SHORTER = {
    ("docs/dynamics.md", 0): ("end=1.0", "end=2e-3"),
    ("docs/dynamics.md", 2): ("end=1.0", "end=2e-3"),
    ("docs/fluxes.md", 3): ("steps=50", "steps=2"),
    ("docs/tie.md", 5): ("steps=10", "steps=2"),
    ("docs/load_steps.md", 2): ("steps=40", "steps=4"),
    ("docs/output.md", 2): ("40 * (", "2 * ("),
    ("docs/output.md", 3): ("steps=20", "steps=2"),
    ("docs/parameters.md", 0): (
        'contact.resultant("ring", "plate").force',
        "raymortar.NonlinearProblem(residual, contact, bcs=bcs).solve()\n"
        'contact.resultant("ring", "plate").force',
    ),
    ("docs/fluxes.md", 4): ("steps=100", "steps=2"),
}
NEEDS = {
    ("docs/condensed.md", 0): "dolfinx.nls.petsc",
    ("docs/your_own_assembly.md", 2): "dolfinx.nls.petsc",
    ("docs/output.md", 0): "meshio",
    ("docs/output.md", 3): "matplotlib",
    ("docs/tie.md", 5): "matplotlib",
    ("docs/rigid.md", 2): "meshio",
}
BLOCKS = [
    (page, k)
    for page, before in BEFORE.items()
    for k, start in enumerate(before)
    if start is not None
]


def test_every_block_of_a_guide_is_run():
    """By this file, or by the tests that `BEFORE` leaves them to."""
    pages = [
        "README.md",
        *(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")),
    ]
    found = {page: len(blocks_of(page, "python")) for page in pages}
    listed = {page: len(before) for page, before in BEFORE.items()}
    assert {page: count for page, count in found.items() if count} == listed


@pytest.mark.parametrize("page, k", BLOCKS)
def test_a_block_runs_as_printed(page, k, tmp_path, monkeypatch):
    pytest.importorskip(NEEDS.get((page, k), "numpy"))
    block, start = blocks_of(page, "python")[k], BEFORE[page][k]
    if HAS_UFL_ELEMENTS and (page, k) == ("docs/unknowns.md", 0):
        pytest.skip("the page says that it is for later versions")
    host = inspect.signature(fem.petsc.NonlinearProblem).parameters
    if page == "docs/condensed.md" and "petsc_options_prefix" not in host and k == 1:
        block = block[: block.index("# The SNES of DOLFINx 0.10")]
    old, new = SHORTER.get((page, k), ("", ""))
    assert old in block
    (tmp_path / "meshes").symlink_to(ROOT / "meshes")
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", ContactWarning)
        exec(compile(START + start, "start", "exec"), names := {"__name__": "__main__"})
        exec(compile(block.replace(old, new) if old else block, page, "exec"), names)
