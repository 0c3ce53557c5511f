"""Impacts of bars in each scheme, with each mass, in several steps, and what a step costs.

Writes impacts.csv beside it, a row for each run, all of one process. Of two bars that
meet and of a bar that drops on a plane, everything is over its closed form; `alone` are
the same bars without contact in a plain loop of DOLFINx, `apart` with contact that finds
nothing. CPU seconds a step, set-up and the first step left out.
"""

import argparse
import csv
import sys
import time
from pathlib import Path

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "helpers"), str(ROOT / "tests")]

import moving  # noqa: E402

import raymortar  # noqa: E402
from raymortar import dynamics
from raymortar.core import compat

SCHEMES = {
    "trapezoidal": dynamics.Newmark(),
    "midpoint": dynamics.Midpoint(),
    "alpha 0.8": dynamics.GeneralizedAlpha(0.8),
    "alpha 0": dynamics.GeneralizedAlpha(0.0),
}
MASSES = "nearest", "affine", "consistent"
NAMES = (
    "case cell unknowns scheme mass cfl steps iterations energy most stress ripple "
    "impulse momentum seconds"
).split()
SPEED = 0.01


def timed(scene, problem, inertia, **options):
    """Run time steps; what `moving.run` gives, with CPU seconds a step."""
    history = raymortar.History(problem)
    steps = dynamics.TimeSteps(problem.snes_solver, inertia, history=history, **options)
    iterations, count, begin = 0, 0, None
    for step in steps:
        begin = time.process_time() if begin is None else begin
        iterations, count = iterations + step.iterations, count + 1
    seconds = (time.process_time() - begin) / (count - 1)
    row = {"steps": count, "iterations": iterations / count, "seconds": seconds}
    axis = "xyz"[scene.d - 1]
    return row, {
        "time": history["time"], "force": history[f"force_0_{axis}"],
        "energy": history["kinetic"] + history["elastic"],
        "impulse": history[f"impulse_0_{axis}"],
        "momentum": history[f"momentum_{axis}"],
    }  # fmt: skip


def judged(row, found, scale, window):
    """Energy, stress, ripple and impulse over their closed forms."""
    energy, force = found["energy"] / scale["energy"], found["force"] / scale["force"]
    inside = (found["time"] >= window[0]) & (found["time"] <= window[1])
    row |= {
        "energy": energy[-1], "most": energy.max(), "stress": force[inside].mean(),
        "ripple": force[inside].std(),
        "impulse": found["impulse"][-1] / scale["impulse"],
        "momentum": np.abs(found["momentum"] / scale["impulse"]).max(),
    }  # fmt: skip
    return row


def bars(cell, n, heads, scheme, mass, cfl, apart=False):
    """Two bars of E = rho = L = 1 that meet at v and -v, or fly apart."""
    scene = moving.bars(cell, n=n, heads=heads)
    energy, residual = moving.elastic(scene)
    pairs = [(moving.SLAVE, moving.MASTER)]
    contact = raymortar.Contact(scene.u, scene.facets, pairs)
    problem = raymortar.NonlinearProblem(residual, contact)
    form = ufl.inner(scene.a, scene.v) * ufl.dx
    inertia = dynamics.Inertia(form, contact, mass)
    velocity = moving.by_bar(scene, -SPEED if apart else SPEED)
    row, found = timed(
        scene, problem, inertia, scheme=SCHEMES[scheme], energy=energy,
        end=20.0 * cfl / n if apart else 2.5, dt=cfl / n, velocity=velocity,
    )  # fmt: skip
    row["unknowns"] = scene.V.dofmap.index_map.size_global * scene.d
    if apart:
        return row
    scale = {
        "energy": SPEED**2 * scene.area, "force": SPEED * scene.area,
        "impulse": 2.0 * SPEED * scene.area,
    }  # fmt: skip
    return judged(row, found, scale, (0.5, 1.5))


def drop(scheme, mass, cfl):
    """A bar that drops on a plane: pressure 300, impulse 200, energy 500."""
    n, length, E = 40, 10.0, 900.0
    scene = moving.bars(n=n, length=length, lower=False, gap=5.0)
    energy, residual = moving.elastic(scene, E)
    floor = raymortar.rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(scene.u, scene.facets, [(moving.SLAVE, floor)])
    problem = raymortar.NonlinearProblem(residual, contact)
    form = ufl.inner(scene.a, scene.v) * ufl.dx
    inertia = dynamics.Inertia(form, contact, mass)
    velocity = moving.moving(scene, lambda z: -10.0 + 0.0 * z)
    row, found = timed(
        scene, problem, inertia, scheme=SCHEMES[scheme], energy=energy, end=1.5,
        dt=cfl * length / n / np.sqrt(E), velocity=velocity,
    )  # fmt: skip
    row["unknowns"] = scene.V.dofmap.index_map.size_global * scene.d
    area = scene.area
    scale = {"energy": 500.0 * area, "force": 300.0 * area, "impulse": 200.0 * area}
    row = judged(row, found, scale, (0.65, 1.0))
    # It falls with a momentum of -100 and rebounds with 100
    row["momentum"] = abs(found["momentum"][-1] / (100.0 * area) - 1.0)
    return row


def alone(cell, n, heads, cfl, count=40):
    """Steps of the trapezoidal rule in a plain loop, with factors that are kept."""
    scene = moving.bars(cell, n=n, heads=heads)
    energy, residual = moving.elastic(scene)
    dt, (u, v, a) = cfl / n, (fem.Function(scene.V) for _ in range(3))
    residual = ufl.replace(residual, {scene.u: u})
    inertia = ufl.inner(a, scene.v) * ufl.dx
    factor = 4.0 / dt**2
    tangent = ufl.derivative(residual, u, scene.a)
    tangent += factor * ufl.inner(scene.a, scene.v) * ufl.dx
    A = fem.petsc.assemble_matrix(compat.form(tangent))
    A.assemble()
    ksp = PETSc.KSP().create(scene.mesh.comm)
    ksp.setOperators(A)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    form, x = compat.form(residual + inertia), A.createVecRight()
    v.x.array[:] = moving.by_bar(scene, SPEED).x.array
    begin = None
    for _ in range(count):
        last_v, last_a = v.x.array.copy(), a.x.array.copy()
        change = np.zeros_like(last_v)
        for _ in range(2):  # the second one shows that it has converged
            a.x.array[:] = factor * (change - dt * last_v) - last_a
            b = fem.petsc.assemble_vector(form)
            b.ghostUpdate(PETSc.InsertMode.ADD_VALUES, PETSc.ScatterMode.REVERSE)
            if b.norm() > 1e-12:
                ksp.solve(-b, x)
                n_own = len(x.array_r)
                change[:n_own] += x.array_r
                u.x.array[:n_own] += x.array_r
            b.destroy()
        a.x.array[:] = factor * (change - dt * last_v) - last_a
        v.x.array[:] = last_v + 0.5 * dt * (last_a + a.x.array)
        begin = time.process_time() if begin is None else begin
    return {
        "unknowns": scene.V.dofmap.index_map.size_global * scene.d, "steps": count,
        "iterations": 1.0, "seconds": (time.process_time() - begin) / (count - 1),
    }  # fmt: skip


def runs(quick):
    """Yield what names a run, and the run."""
    sizes = [("quadrilateral", 50, 2), ("hexahedron", 20, 6)]
    for cell, n, heads in sizes[: 1 if quick else 2]:
        at = {"cell": cell, "scheme": "trapezoidal", "mass": "consistent", "cfl": 1.0}
        yield {"case": "alone"} | at, lambda c=(cell, n, heads): alone(*c, 1.0)
        at = at | {"mass": "nearest"}
        for case in ("apart", "bars"):
            if case == "apart" or cell != "quadrilateral":
                yield {"case": case} | at, lambda c=(cell, n, heads), case=case: bars(
                    *c, "trapezoidal", "nearest", 1.0, case == "apart"
                )
    for scheme in SCHEMES:
        for mass in MASSES:
            for cfl in (1.0,) if quick else (1.0, 0.25):
                at = {"cell": "quadrilateral", "scheme": scheme, "mass": mass}
                at["cfl"] = cfl
                yield {"case": "bars"} | at, lambda at=(scheme, mass, cfl): bars(
                    *sizes[0], *at
                )
                if mass != "consistent" and scheme != "alpha 0":
                    yield {"case": "drop"} | at, lambda at=(scheme, mass, cfl): drop(
                        *at
                    )


def main():
    """Run all cases, and write their rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few cases")
    quick = parser.parse_args().quick
    with (Path(__file__).parent / "impacts.csv").open("w", newline="") as file:
        rows = csv.DictWriter(file, NAMES, lineterminator="\n")
        rows.writeheader()
        for names, run in runs(quick):
            row = names | run()
            shown = {
                k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()
            }
            rows.writerow(shown)
            file.flush()
            print(*shown.values())


if __name__ == "__main__":
    main()
