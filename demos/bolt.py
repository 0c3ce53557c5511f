"""A bolted joint: tightened by a force, locked, then pulled apart (axisymmetric).

The shank is cut across, and its two faces are tied but for one opening that carries the
force. The bolt and the upper plate are held by contact alone. Pulled at its rim, the
plate unloads the joint; the bolt feels little of it until the joint opens.
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
from meshes.meshing import assemble_blocks
from raymortar import io, tools

# Lengths in mm, stresses in MPa, forces in N of a full turn
E, NU, FORCE, LOAD = 2.1e5, 0.3, 5000.0, 6000.0
SHANK, HEAD, HOLE, RIM = 2.5, 5.0, 3.0, 10.0
PLATE, THICK = 5.0, 3.0
CUT_A, CUT_B, FOOT, NUT, TOP, BOTTOM, UP, LOW, OUT_UP, OUT_LOW, AXIS = range(1, 12)


def parts(n):
    """Blocks of the bolt's halves and of two plates, n cells per 5 mm."""

    def block(x, y, body, **tags):
        size = [max(2, round(n * (b - a) / 5.0)) for a, b in (x, y)]
        return Block(tuple(size), (x[0], y[0]), (x[1], y[1]), tags=tags, body=body)

    end = PLATE + THICK
    inner, outer, plate = (0.0, SHANK), (SHANK, HEAD), (HOLE, RIM)
    return [
        block(inner, (0.0, PLATE), "a", bottom=CUT_A, left=AXIS),
        block(inner, (PLATE, end), "a", left=AXIS),
        block(outer, (PLATE, end), "a", bottom=FOOT),
        block(inner, (-PLATE, 0.0), "b", top=CUT_B, left=AXIS),
        block(inner, (-end, -PLATE), "b", left=AXIS),
        block(outer, (-end, -PLATE), "b", top=NUT),
        block(plate, (0.0, PLATE), "c", top=TOP, bottom=UP, right=OUT_UP),
        block(plate, (-PLATE, 0.0), "d", top=LOW, bottom=BOTTOM, right=OUT_LOW),
    ]


def main(arguments=None):
    """Run the demo; 0 if all forces are in balance."""
    args = common.options("bolt", __doc__).parse_args(arguments)
    comm = MPI.COMM_WORLD
    blocks = parts(12 if args.fine else 5)
    mesh, _, tags = assemble_blocks(comm, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    r = ufl.SpatialCoordinate(mesh)[0]
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))

    def strain(w):
        (a, b), (c, d) = ((w[k].dx(0), w[k].dx(1)) for k in (0, 1))
        return ufl.sym(ufl.as_matrix([[a, b, 0], [c, d, 0], [0, 0, w[0] / r]]))

    e = strain(u)
    stress = 2.0 * mu * e + lmbda * ufl.tr(e) * ufl.Identity(3)
    load = fem.Constant(mesh, 0.0)  # traction along z
    ds = ufl.Measure("ds", mesh, subdomain_data=tags)
    turn = 2.0 * np.pi * r
    residual = ufl.inner(stress, strain(v)) * turn * ufl.dx(degree=4)
    residual -= load * v[1] * turn * ds(OUT_UP)
    bcs = [
        tools.prescribe(V, tags.find(AXIS), component=0),
        tools.prescribe(V, tags.find(OUT_LOW), component=1),
    ]

    full = dict(axisymmetric=True)
    bolt = raymortar.Pretension(u, tags, (CUT_A, CUT_B), (0.0, 1.0), **full)
    head, nut, joint = (
        raymortar.Contact(u, tags, [pair], friction=raymortar.Coulomb(0.15), **full)
        for pair in ((FOOT, TOP), (NUT, BOTTOM), (UP, LOW))
    )
    problem = raymortar.NonlinearProblem(residual, [bolt, head, nut, joint], bcs)
    history = raymortar.History(problem, more={"bolt": bolt.tension})
    solver = problem.snes_solver

    def tighten(t):
        bolt.force = FORCE * t

    tightened = raymortar.LoadSteps(solver, tighten, 1, history=history).run()
    bolt.lock()

    def pull(t):
        load.value = LOAD * t / (2.0 * np.pi * RIM * PLATE)

    steps = raymortar.LoadSteps(solver, pull, 6, history=history)
    iterations = [step.iterations for step in [*tightened, *steps]]

    # The head carries the bolt's force at all times, and the joint what is left
    report = common.Report(comm)
    report.effort(problem.contact, iterations)
    carried, left, tension = (history[k] for k in ("force_1_y", "force_3_y", "bolt"))
    pulled = np.append(0.0, LOAD * np.arange(1, 7) / 6.0)
    for name, force in ("bolt", tension), ("head", carried), ("joint", left):
        report.add(f"force of the {name}, tightened", force[0], FORCE, 1e-9, "N")
    report.add("head less bolt, pulled", carried[-1], tension[-1], 1e-9, "N")
    report.add("joint, half pulled", left[3], tension[3] - pulled[3], 1e-9, "N")
    mises = tools.nodal_field(tools.von_mises(stress), mesh, "von Mises stress")
    args.output.mkdir(parents=True, exist_ok=True)
    axes = dict(xlabel="load (N)", ylabel="bolt (N)", ylim=(0.9 * FORCE, 1.05 * LOAD))
    exact = pulled, np.maximum(pulled, FORCE), "load or pretension, if larger"
    shown = "von Mises stress (MPa)", exact, (pulled, tension, "bolt"), axes
    drawing.field_and_curve(args.output / "bolt.png", u, mises, *shown, sides=(-1, 1))
    io.write_xdmf(args.output / "bolt.xdmf", mesh, [u, mises])
    return report.finish("balance")


if __name__ == "__main__":
    sys.exit(main())
