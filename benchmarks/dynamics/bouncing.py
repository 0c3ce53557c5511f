"""A bar that bounces on a plane under its weight for 100 000 steps: energy and memory.

Writes bouncing.csv beside it, a row for every thousandth step. The bar has a length of 1
and 4 cells of a wave speed of 20, falls from 1/2 at a weight of 1, and is free to rotate.
Steps take 0.1 of a cell's time, an eighth of that where it touches or parts.
"""

import argparse
import csv
import sys
import time
from pathlib import Path

import ufl
from dolfinx import fem

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "helpers"), str(ROOT / "tests")]

import moving  # noqa: E402

import raymortar  # noqa: E402
from raymortar import dynamics
from raymortar.core import compat

DT, WEIGHT, HEIGHT, WIDTH = 5e-3, 1.0, 0.5, 0.5
NAMES = "step time energy bounces halvings kilobytes seconds".split()


def kilobytes():
    """Memory of this process in use."""
    return 4 * int(Path("/proc/self/statm").read_text().split()[1])


def rows(count, touch):
    """Yield a row for each hundredth of the steps; energy over that of the fall."""
    scene = moving.bars(n=4, lower=False, gap=HEIGHT, heads=1, width=WIDTH)
    energy, residual = moving.elastic(scene, 400.0)
    weight = fem.Constant(scene.mesh, WEIGHT)
    residual += weight * scene.v[1] * ufl.dx
    potential = compat.form(energy + weight * scene.u[1] * ufl.dx)
    floor = raymortar.rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(scene.u, scene.facets, [(moving.SLAVE, floor)])
    problem = raymortar.NonlinearProblem(residual, contact)
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    steps = dynamics.TimeSteps(
        problem.snes_solver, inertia, end=count * DT, dt=DT, touch=touch,
        scheme=dynamics.Newmark(),
    )  # fmt: skip
    done, bounces, last, touched, begin = 0, 0, 0.0, False, time.process_time()
    for step in steps:
        done += 1
        touches = contact.statistics.active_points > 0
        if touched and not touches and step.time - last > 0.5:
            bounces, last = bounces + 1, step.time
        touched = touches
        if done % max(count // 100, 1) == 0 or done == 1:
            v = steps.velocity.x.array
            total = 0.5 * v @ inertia.times(v) + fem.assemble_scalar(potential)
            yield [
                done, f"{step.time:.6g}", f"{total / (WEIGHT * WIDTH * HEIGHT):.4e}",
                bounces, steps.halvings, kilobytes(),
                f"{time.process_time() - begin:.1f}",
            ]  # fmt: skip
        if done >= count:
            return


def main():
    """Run, and write the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--touch", type=int, default=3)
    options = parser.parse_args()
    with (Path(__file__).parent / "bouncing.csv").open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(NAMES)
        for row in rows(options.steps, options.touch):
            out.writerow(row)
            file.flush()


if __name__ == "__main__":
    main()
