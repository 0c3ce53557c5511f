"""Small contact scenes under stress, each with what its answer must be.

Lengths are in `unit`s, stresses in the lower block's modulus.
"""

from __future__ import annotations

import dataclasses
import functools
import sys
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "helpers"))

from materials import neo_hookean_energy  # noqa: E402
from problems import build, fix, lame  # noqa: E402

import raymortar  # noqa: E402
from meshes.scenes import two_blocks  # noqa: E402
from raymortar.core import compat

LINE_SEARCH = {"snes_linesearch_type": "bt", "snes_max_it": 50}
# Of the lower block; contact has no stress of its own
MODULUS = 2000.0
# Integrates the neo-Hookean energy well
RULE = {"quadrature_degree": 4}
# Load factor at which a sliding block comes to the edge
AT_THE_EDGE = 0.37


@dataclasses.dataclass(frozen=True)
class Setting:
    """What is asked of a scene; the defaults are harmless."""

    scene: str = "column"
    cell: str = "triangle"
    degree: int = 1
    ratio: float = 1.0  # modulus of the upper block (slave) over the lower's
    gamma: float = 1.0  # times the automatic one
    friction: float = 0.0
    unit: float = 1.0  # length
    push: float = 0.05  # shortening, in heights of a block
    divisions: tuple[int, int] = (7, 5)  # cells along the interface: master, slave
    aspect: float = 1.0  # width of a cell over its height
    gap: float = 0.0  # at the start, in heights; negative: penetration
    nu: float = 0.3
    perpendicular: bool = False  # the slave's flanks are slave surfaces as well
    tangent: str = "full"


@dataclasses.dataclass
class Case:
    """A problem with its load and its judge."""

    problem: object
    apply: object  # sets the load of a factor from 0 to 1
    errors: object  # () -> relative errors by name, NaN where no reference is found
    facet: float  # length of a slave facet
    steps: int = 10  # for a path in steps
    history: object = None  # of the path, where an error is one of the whole path

    def defects(self):
        """What no answer may have, by name, whether or not its error is known.

        Forces of the two bodies that do not balance, relative; penetration in slave
        facets; the smallest volume ratio.
        """
        forces = [reaction(self.problem, name) for name in ("top", "bottom")]
        scale = max(*map(abs, forces), np.finfo(float).tiny)
        gap = [np.empty(0)]
        for i in range(len(self.problem.contact.zones)):
            points = self.problem.contact.points(i)
            gap.append(points["gap"][points["status"] > 0])
        gap = np.concatenate(gap)
        volume = np.linalg.det(np.eye(self.problem.dim) + self.problem.gradient())
        return {
            "imbalance": float(abs(sum(forces)) / scale),
            "penetration": float(-gap.min(initial=0.0) / self.facet),
            "volume": float(volume.min()),
        }


def _dimension(setting):
    return 3 if setting.cell in ("tetrahedron", "hexahedron") else 2


def _blocks(setting, upper_width):
    """Blocks of height 1; the slave is `upper_width` wide, the master 1."""
    dim, unit = _dimension(setting), setting.unit
    wide = setting.aspect * unit
    below, above = setting.divisions
    # Rows of cells, whatever their length along the interface
    rows = 5 if dim == 2 else 2
    return two_blocks(
        MPI.COMM_WORLD,
        dim,
        setting.cell,
        (below,) * (dim - 1) + (rows,),
        (above,) * (dim - 1) + (rows,),
        lower_size=(wide,) * (dim - 1) + (unit,),
        upper_size=(upper_width * wide,) * (dim - 1) + (unit,),
        gap=setting.gap * unit,
    )


def _contact_options(setting):
    """Options of `build`: law, and a search that sees the initial gap."""
    options = {"tangent": setting.tangent}
    if setting.friction > 0.0:
        options["friction"] = raymortar.Coulomb(setting.friction)
    if abs(setting.gap) > 0.0:
        distance = 2.0 * (abs(setting.gap) + setting.push) * setting.unit
        options["search"] = raymortar.Search(reach=distance, depth=distance)
    return options


def _build(setting, scene, bcs, **options):
    moduli = {"lower": MODULUS, "upper": setting.ratio * MODULUS}
    problem = build(
        scene,
        setting.degree,
        "neo-hookean",
        E=moduli,
        nu=setting.nu,
        bcs=bcs,
        **_contact_options(setting),
        **options,
    )
    if setting.gamma != 1.0:
        problem.contact.set_gamma(setting.gamma * problem.contact.gamma)
    return problem


def _top(scene):
    """Displacement of the top, to be set."""
    dim = scene.mesh.geometry.dim
    return fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))


# Column: uniaxial strain, known in closed form


def column(setting):
    """Two blocks between smooth walls: uniaxial strain in each, one pressure."""
    scene = _blocks(setting, 1.0)
    dim = scene.mesh.geometry.dim
    top = _top(scene)

    def bcs(V, scene):
        sides = [("left", 0), ("right", 0), ("front", 1), ("back", 1)][: 2 * dim - 2]
        return [fix(V, scene, ["bottom"]), fix(V, scene, "top", None, top)] + [
            fix(V, scene, [f"lower_{side}", f"upper_{side}"], k) for side, k in sides
        ]

    problem = _build(setting, scene, bcs)
    total = (setting.push + setting.gap) * setting.unit

    def apply(factor):
        top.value[-1] = -factor * total

    pressure = _column_pressure(setting)

    def errors():
        multiplier = problem.slave_multiplier()
        # The traction on the slave, whose normal points down
        normal = multiplier[:, 0] if multiplier.shape[1] == 1 else -multiplier[:, -1]
        return {"exact": float(np.abs(normal - pressure).max() / abs(pressure))}

    facet = setting.aspect * setting.unit / setting.divisions[1]
    return Case(problem, apply, errors, facet)


def _uniaxial(stretch, E, nu):
    """Nominal stress of the neo-Hookean material in uniaxial strain."""
    mu, lmbda = lame(E, nu)
    return mu * (stretch - 1.0 / stretch) + lmbda * np.log(stretch) / stretch


def _column_pressure(setting):
    """Stress of two layers in series whose heights shrink by `push` in all.

    By bisection on the logarithm of the share of the stiffer one, so that a share
    of 1e-6 keeps its digits.
    """
    stiff, soft = max(1.0, setting.ratio), min(1.0, setting.ratio)

    def excess(log_share):
        share = np.exp(log_share) * setting.push
        return _uniaxial(1.0 - share, stiff * MODULUS, setting.nu) - _uniaxial(
            1.0 - setting.push + share, soft * MODULUS, setting.nu
        )

    low, high = np.log(1e-12), 0.0
    while low < (low + high) / 2 < high:
        middle = (low + high) / 2
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    share = np.exp(low) * setting.push
    return _uniaxial(1.0 - share, stiff * MODULUS, setting.nu)


# Punch and slide: sharp corners, against small steps, other roles, and balances


def punch(setting, swap=False):
    """A block 0.6 wide pressed into one 1.0 wide, its corners sharp."""
    scene = _blocks(setting, 0.6)
    top = _top(scene)

    def bcs(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]

    pairs = [("slave", "master")]
    if setting.perpendicular:
        pairs += [("upper_left", "master"), ("upper_right", "master")]
    problem = _build(setting, scene, bcs, pairs=pairs, swap=swap)
    total = (setting.push + setting.gap) * setting.unit

    def apply(factor):
        top.value[-1] = -factor * total

    def errors():
        found, other = reaction(problem), dataclasses.replace(setting, tangent="full")
        return {
            "steps": _apart(found, _in_small_steps(setting)),
            "swapped": _apart(found, _in_small_steps(_natural(other), swap=True)),
        }

    facet = 0.6 * setting.aspect * setting.unit / setting.divisions[1]
    return Case(problem, apply, errors, facet)


def _natural(setting):
    """With the automatic coefficient: others can make a reference fail."""
    return dataclasses.replace(setting, gamma=1.0)


def slide(setting):
    """A block pressed into another and pushed over its edge, until it hangs free."""
    scene = _blocks(setting, 0.4)
    top = _top(scene)
    held = []

    def bcs(V, scene):
        held.append(fix(V, scene, "top", None, top))
        return [fix(V, scene, "bottom"), *held]

    problem = _build(setting, scene, bcs)
    dim, unit = problem.dim, setting.unit

    def moved(factor):
        x = np.zeros(dim)
        x[-1] = -min(10.0 * factor, 1.0) * setting.push * unit
        x[0] = max(factor - 0.1, 0.0) / 0.9 * setting.aspect * unit
        return x

    def apply(factor):
        top.value[:] = moved(factor)

    energy = _stored(problem)
    history = raymortar.History(problem.problem, None, {"top": held}, energy)

    def errors():
        force = np.linalg.norm(problem.contact.resultant(0).force)
        scale = MODULUS * setting.push * unit ** (dim - 1)
        return {"free": float(force / scale), "work": _unbalanced(history, moved)}

    facet = 0.4 * setting.aspect * unit / setting.divisions[1]
    return Case(problem, apply, errors, facet, steps=60, history=history)


def _stored(problem):
    """Energy of the neo-Hookean bodies, a UFL functional."""
    F = ufl.Identity(problem.dim) + ufl.grad(problem.u)
    return neo_hookean_energy(F, *problem.moduli) * ufl.dx(metadata=RULE)


def _unbalanced(history, moved):
    """Work of the support less that of friction and what is stored, of the former.

    By the trapezoidal rule, up to where the block comes to the edge: as it leaves that,
    it snaps free, and what was stored is lost.
    """
    force = np.vstack([0.0 * moved(0.0), history.vectors("reaction_top")])
    place = np.array([moved(factor) for factor in (0.0, *history["time"])])
    done = np.einsum("ki,ki->k", force[1:] + force[:-1], np.diff(place, axis=0)) / 2
    done, found = np.cumsum(done), history["energy"]
    if "friction_work" in history.columns:
        found = found + history["friction_work"]
    last = np.searchsorted(history["time"], AT_THE_EDGE) - 1
    return float(abs(found[last] / done[last] - 1.0))


def reaction(problem, name="top"):
    """Vertical force on a support: from the form alone, without contact."""
    form = problem.problem
    V = problem.u.function_space
    dim = problem.dim
    forces = compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
    compat.assemble_residual(forces.array, form.L)
    facets = problem.scene.facet_tags.find(problem.scene.tags[name])
    dofs = fem.locate_dofs_topological(V.sub(dim - 1), dim - 1, facets)
    return float(np.sum(forces.array[dofs]))


@functools.cache
def _in_small_steps(setting, swap=False):
    """Reaction of a punch in 20 small steps (3D: 10), smaller ones where they fail.

    With a line search, as full steps cycle at the onset of friction; NaN where it fails.
    Nothing else is tried: other ways may end in another equilibrium, and viscous forces
    in one far away.
    """
    case = punch(setting, swap)
    solver = raymortar.SNESSolver(case.problem.problem, LINE_SEARCH)
    steps = 20 if case.problem.dim == 2 else 10
    try:
        raymortar.LoadSteps(solver, case.apply, steps, strategy="halve").run()
    except (raymortar.ConvergenceError, raymortar.ContactError, PETSc.Error):
        return float("nan")
    return reaction(case.problem)


def _apart(value, reference):
    """Relative difference."""
    return abs(value - reference) / abs(reference)


SCENES = {"column": column, "punch": punch, "slide": slide}
