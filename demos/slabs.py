"""Two slabs whose contact conducts the better the harder they are pressed (2D).

A hot slab on a cold one, with unrelated meshes. Displacement and temperature are solved
for together, over a path of loads. Then the slabs are tied: no resistance is left.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, tools

# mm, N, s, K
HEIGHT, E, HOT, HARDNESS, LOAD = 10.0, 7e4, 100.0, 800.0, 40.0
CONDUCTIVITY = {"lower": 15.0, "upper": 150.0}
TAGS = {"held": 1, "master": 2, "slave": 3, "pushed": 4, "left": 5, "right": 6}
BODIES = {"lower": 1, "upper": 2}


def conductance(p):
    """Of rough surfaces, which touch the more the harder they are pressed."""
    return 600.0 * (p / HARDNESS) ** 0.95


def law(T_s, T_m, p, g, v):
    """Heat from the upper slab to the lower one, per area and time."""
    return conductance(p + 1e-9) * (T_s - T_m)


def exact(p):
    """Heat through slabs and contact in series; tied ones have no contact."""
    slabs = sum(HEIGHT / k for k in CONDUCTIVITY.values())
    return HOT / (slabs + 1.0 / conductance(p))


def scene_of(comm, size):
    """Slabs with `size` and `size + 1` cells across."""
    sides = {"left": TAGS["left"], "right": TAGS["right"]}
    low = sides | {"bottom": TAGS["held"], "top": TAGS["master"]}
    high = sides | {"bottom": TAGS["slave"], "top": TAGS["pushed"]}
    blocks = [
        Block((size + k, size // 2), (0.0, y), (2.0 * HEIGHT, y + HEIGHT), tags=tags)
        for k, y, tags in ((0, -HEIGHT, low), (1, 0.0, high))
    ]
    return Scene(*assemble_blocks(comm, blocks, "triangle"), TAGS, BODIES)


def solve(comm, size, steps, report):
    """Press the slabs, then tie them; heat by pressure, and the fields."""
    scene = scene_of(comm, size)
    mesh = scene.mesh
    V, W = tools.vector_space(mesh, 1), tools.scalar_space(mesh, 1)
    u, T = fem.Function(V, name="displacement"), fem.Function(W, name="temperature")
    v, s = ufl.TestFunction(V), ufl.TestFunction(W)
    k = tools.by_body(mesh, scene.cell_tags, CONDUCTIVITY, BODIES)
    push = fem.Constant(mesh, 0.0)
    ds = ufl.ds(domain=mesh, subdomain_data=scene.facet_tags)(TAGS["pushed"])
    F_u = E * ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx + push * v[1] * ds
    F_T = ufl.inner(k * ufl.grad(T), ufl.grad(s)) * ufl.dx
    ends = [tools.prescribe(W, scene.find("held"))]
    ends.append(tools.prescribe(W, scene.find("pushed"), HOT))
    sides = [tools.prescribe(V, scene.find(n), component=0) for n in ("left", "right")]
    bcs = [*ends, *sides, tools.prescribe(V, scene.find("held"), component=1)]
    pair = TAGS["slave"], TAGS["master"]
    contact = raymortar.Contact(u, scene.facet_tags, [pair])
    flux = raymortar.fluxes.Flux(contact, T, law, friction_heat=None)
    problem = raymortar.NonlinearProblem([F_u, F_T], [contact, flux], bcs, u=[u, T])
    rows = []

    def press(t):
        push.value = LOAD * t**3  # more small loads than large ones

    for step in raymortar.LoadSteps(problem.snes_solver, press, steps):
        rows.append((push.value.item(), flux.rates().through / (2.0 * HEIGHT)))
        report.say(f"{rows[-1][0]:6.2f} MPa: {step.iterations} iterations")
    glued = fem.Function(W, name="tied")
    F_T = ufl.inner(k * ufl.grad(glued), ufl.grad(s)) * ufl.dx
    tie = raymortar.fluxes.FieldTie(glued, scene.facet_tags, [pair])
    raymortar.fluxes.FieldProblem(F_T, glued, tie, ends).solve()
    return u, [T, glued], np.array(rows), tie.rate() / (2.0 * HEIGHT)


def main(arguments=None):
    """Run the demo; 0 if heat is that of the closed form."""
    parser = common.options("slabs", __doc__)
    parser.add_argument("--size", type=int, default=12, help="cells across")
    parser.add_argument("--steps", type=int, default=12)
    args = parser.parse_args(arguments)
    report = common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    size = args.size * (2 if args.fine else 1)
    u, fields, rows, tied = solve(MPI.COMM_WORLD, size, args.steps, report)
    for p, q in rows[[0, len(rows) // 2, -1]]:
        report.add(f"heat at {p:.3g} MPa", q, exact(p), 1e-6, "N/mm/s")
    report.add("heat of tied slabs", tied, exact(np.inf), 1e-10, "N/mm/s")
    io.write_xdmf(args.output / "slabs.xdmf", u.function_space.mesh, [u, *fields])
    p = np.geomspace(*rows[[0, -1], 0], 100)
    curve, computed = (p, exact(p), "slabs in series"), (*rows.T, "computed")
    axes = {"xlabel": "pressure (MPa)", "ylabel": "heat flux (mW/mm²)", "xscale": "log"}
    path, label = args.output / "slabs.png", "temperature (K)"
    drawing.field_and_curve(path, u, fields[0], label, curve, computed, axes)
    return report.finish("slabs")


if __name__ == "__main__":
    sys.exit(main())
