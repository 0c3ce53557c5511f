"""Two bars: bars of steel meet end to end, press for a while and fly apart (2D).

While the waves run to the far ends and back, the pressure is rho c v. The bars exchange
their velocities. With mass at the contact nodes the same scheme rings, and multiplies
the energy; without mass it does neither (dynamics.Inertia).
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import dynamics, io, tools

# SI units; Poisson's ratio is 0
E, DENSITY, SPEED, LENGTH = 2.1e11, 7850.0, 10.0, 1.0
WAVE = np.sqrt(E / DENSITY)
STRESS = DENSITY * WAVE * SPEED
SLAVE, MASTER = 1, 2
MASSES = {"nearest": "C0", "affine": "C1", "consistent": "0.6"}


def meet(comm, n, mass, cfl=1.0):
    """Let the bars meet at time 0; end after 2.5 times the way of a wave."""
    width = 2.0 * LENGTH / n
    left = Block((n, 2), (-LENGTH, 0.0), (0.0, width), tags={"right": MASTER})
    right = Block((n, 2), (0.0, 0.0), (LENGTH, width), tags={"left": SLAVE})
    mesh, _, facets = assemble_blocks(comm, [left, right], "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v, a = fem.Function(V, name="u"), ufl.TestFunction(V), ufl.TrialFunction(V)
    strain = ufl.sym(ufl.grad(u))
    energy = 0.5 * E * ufl.inner(strain, strain) * ufl.dx
    contact = raymortar.Contact(u, facets, [(SLAVE, MASTER)])
    problem = raymortar.NonlinearProblem(ufl.derivative(energy, u, v), contact)
    inertia = dynamics.Inertia(DENSITY * ufl.inner(a, v) * ufl.dx, contact, mass)
    history = raymortar.History(problem)
    end, dt = 2.5 * LENGTH / WAVE, cfl * LENGTH / n / WAVE
    steps = dynamics.TimeSteps(
        problem.snes_solver, inertia, end=end, dt=dt, scheme=dynamics.Newmark(),
        velocity=approach(V), energy=energy, history=history,
    )  # fmt: skip
    kept, _ = common.follow(steps, u, 30)
    whole = DENSITY * SPEED**2 * LENGTH * width
    return SimpleNamespace(
        mesh=mesh, u=u, kept=kept, time=history["time"] * WAVE / LENGTH,
        stress=history["force_0_x"] / width / STRESS, contact=contact,
        energy=(history["kinetic"] + history["elastic"]) / whole,
        impulse=history["impulse_0_x"] / (2.0 * DENSITY * SPEED * LENGTH * width),
    )  # fmt: skip


def approach(V):
    """Velocities towards the middle, of the nodes that both bars have there too."""
    found = fem.Function(V)
    dofs = raymortar.core.compat.dofmap_array(V)
    middle = V.tabulate_dof_coordinates()[dofs, 0].mean(axis=1)
    found.x.array.reshape(-1, 2)[dofs, 0] = -SPEED * np.sign(middle)[:, None]
    return found


def draw(results, path):
    """Pressure and energy over time, and an animation of the bars' stress."""
    last = results["nearest"]
    strain = E * abs(ufl.grad(last.u)[0, 0]) / STRESS

    def stress():
        return tools.nodal_field(strain, last.mesh, "stress", 1, 2)

    cells = drawing.gather_states(last.u, last.kept, stress)
    io.write_xdmf(path.with_suffix(".xdmf"), last.mesh, [last.u, stress()])
    if last.mesh.comm.rank > 0:
        return
    options = {"figsize": (10.0, 3.6), "layout": "constrained"}
    figure, (left, right) = drawing.pyplot().subplots(1, 2, **options)
    left.plot([0, 0, 2, 2, 2.5], [0, 1, 1, 0, 0], color=drawing.EXACT, label="exact")
    for mass, found in results.items():
        left.plot(found.time, found.stress, color=MASSES[mass], lw=1.0, label=mass)
        dashes = "--" if mass == "affine" else "-"  # upon that of "nearest"
        right.plot(found.time, found.energy, dashes, color=MASSES[mass])
    left.set(xlabel="time c / L", ylabel="pressure / (rho c v)", ylim=(-0.2, 2.5))
    right.set(xlabel="time c / L", ylabel="energy over the first one")
    left.legend(fontsize=8)
    figure.savefig(path)
    # Motions 150 times as large
    frames = [(1e3 * t, (x[..., :2] + 150.0 * u, field)) for t, (x, u, field) in cells]
    box, label = (-1.6, 1.6, -0.8, 1.0), "stress / (rho c v)"
    drawing.animate(path.with_suffix(".gif"), frames, box, 1.2, label, line=None)


def main(arguments=None):
    """Run the demo; 0 if pressure, impulse and energy agree with the closed form."""
    parser = common.options("two_bars", __doc__)
    parser.add_argument("--size", type=int, default=40, help="cells along a bar")
    args = parser.parse_args(arguments)
    report, n = common.Report(MPI.COMM_WORLD), args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    results = {mass: meet(MPI.COMM_WORLD, n, mass) for mass in MASSES}
    for mass, found in results.items():
        pressed = (found.time > 0.5) & (found.time < 1.5)
        tolerance = {"nearest": 0.01, "affine": 0.05}.get(mass)
        pressure = found.stress[pressed].mean()
        report.add(f"{mass}: pressure / (rho c v)", pressure, 1.0, tolerance)
        report.add(f"{mass}: 1 + ripple", 1.0 + found.stress[pressed].std(), 1.0)
        report.add(f"{mass}: energy", found.energy[-1], 1.0, tolerance)
        report.add(f"{mass}: impulse", found.impulse[-1], 1.0, tolerance and 0.06)
    draw(results, args.output / "two_bars.png")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
