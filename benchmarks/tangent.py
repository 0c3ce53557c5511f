#!/usr/bin/env python3
"""benchmarks/tangent.py [--repeat N] [--only NAME ...]

Both tangents, at fixed points and through moving segments, on the demos and on blocks:
load steps, steps that failed and were halved, Newton iterations (those of failed steps
too) and processor time. Writes `tangent.csv` beside this file and prints sums by group.
A path that would take too many iterations is given up, and its row says so.
"""

from __future__ import annotations

import argparse
import csv
import logging
import sys
import time
from collections import defaultdict
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from unittest import mock

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "demos"), str(HERE)]

import blocks_3d  # noqa: E402
import ironing_3d  # noqa: E402
import press_fit  # noqa: E402
from models import cattaneo_mindlin  # noqa: E402
from models import half_ring  # noqa: E402
from models import hertz_cylinder  # noqa: E402
from models import hertz_sphere  # noqa: E402
from models import shallow_ironing  # noqa: E402

import raymortar  # noqa: E402
from meshes.scenes import two_blocks  # noqa: E402
from raymortar.core import compat

COMM = MPI.COMM_SELF
E, NU = 10.0, 0.3
STEPS, HALVINGS = 4, 4
RTOL = 1e-9
FRICTION = raymortar.Coulomb(0.3)
TANGENTS = ("fixed", "full")
# Iterations after which a path is given up: twice what the longest needs that arrives.
# One that does not is tried in every way with every size of its steps, which takes
# minutes and shows nothing more
MOST = 1000
FAILS, GIVEN_UP = "fails", f"over {MOST} iterations"
COLUMNS = ("group", "scene", "tangent", "steps", "halved", "iterations", "seconds")


class TooLong(Exception):
    """A path has taken `MOST` iterations. No failure that load steps might cure."""


class Counted(raymortar.Contact):
    """Contact with a tangent that is chosen from outside, and its assemblies.

    Between two solves its state is kept or restored: there a path that has had too
    many of them ends.
    """

    choice = "fixed"
    assemblies = 0

    def __init__(self, *args, **options):
        super().__init__(*args, **options, tangent=Counted.choice)
        add = self.system.add_tangent

        def counted(*args):
            Counted.assemblies += 1
            add(*args)

        self.system.add_tangent = counted

    def state(self):
        self._end_long_path()
        return super().state()

    def restore(self, state):
        self._end_long_path()
        super().restore(state)

    def _end_long_path(self):
        if Counted.assemblies > MOST:
            raise TooLong


# Blocks


def neo_hookean(u):
    """Energy density."""
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    F = ufl.Identity(len(u)) + ufl.grad(u)
    J = ufl.det(F)
    return 0.5 * mu * (ufl.inner(F, F) - len(u) - 2.0 * ufl.ln(J)) + (
        0.5 * lmbda * ufl.ln(J) ** 2
    )


def held(V, scene, name):
    """Dirichlet condition of all components on a side, and its value."""
    facets = scene.facet_tags.find(scene.tags[name])
    dim = scene.mesh.topology.dim
    value = fem.Constant(scene.mesh, np.zeros(dim, dtype=PETSc.ScalarType))
    dofs = fem.locate_dofs_topological(V, dim - 1, facets)
    return fem.dirichletbc(value, dofs, V), value


def path(make, motion, degree, method, friction):
    """Move the top of the upper block; steps that were halved."""
    scene = make()
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = raymortar.Contact(u, scene.facet_tags, [pair], method(), friction)
    v = ufl.TestFunction(V)
    form = ufl.derivative(
        neo_hookean(u) * ufl.dx(metadata={"quadrature_degree": 2 * degree}), u, v
    )
    conditions, values = zip(*(held(V, scene, name) for name in ("bottom", "top")))
    problem = raymortar.NonlinearProblem(form, contact, bcs=list(conditions))
    solver = raymortar.SNESSolver(problem, {"snes_rtol": RTOL})

    def apply(factor):
        values[1].value[:] = motion(factor)

    steps = raymortar.LoadSteps(solver, apply, STEPS, HALVINGS).run()
    return len(steps), steps[-1].halvings


def down(dim, depth, slide=0.0):
    """Motion that presses by a depth, in the first half of a path that slides."""
    direction = np.eye(dim)

    def at(s):
        press = min(1.0, 2.0 * s) if slide else s
        drag = max(0.0, 2.0 * s - 1.0)
        return -press * depth * direction[-1] + drag * slide * direction[0]

    return at


def bowl(x):
    """Height of a curved interface."""
    return 1.0 + 0.2 * np.sum((x - 0.5) ** 2, axis=1)


def square(dim, width):
    """Size of a block of height 1."""
    return (width,) * (dim - 1) + (1.0,)


KINDS = (
    ("triangle", 2, 1),
    ("quadrilateral", 2, 1),
    ("tetrahedron", 3, 1),
    ("hexahedron", 3, 1),
    ("triangle", 2, 2),
    ("quadrilateral", 2, 2),
    ("tetrahedron", 3, 2),
    ("hexahedron", 3, 2),
)
METHODS = {"": raymortar.AugmentedLagrangian, ", penalty": raymortar.Penalty}


def blocks():
    """Group, name and run of blocks, by how the slave lies on the master."""
    for (cell, dim, degree), (method, make) in product(KINDS, METHODS.items()):
        wide, narrow = square(dim, 1.0), square(dim, 0.8)
        press = down(dim, 0.3 if dim == 2 else 0.2)
        drag = down(dim, 0.1, 0.3)
        for group, lower, upper, motion, friction in (
            ("slave inside", wide, narrow, press, None),
            ("slave inside, friction", square(dim, 2.0), narrow, drag, FRICTION),
            ("equal widths", wide, wide, press, None),
            ("slave overhangs", narrow, wide, press, None),
            ("over the edge, friction", wide, wide, drag, FRICTION),
            ("curved", square(dim, 1.3), wide, press, None),
        ):
            shape = {"lower_size": lower, "upper_size": upper}
            if group == "curved":
                if degree == 1:
                    continue
                shape |= {"geometry_degree": 2, "interface": bowl}
            scene = partial(two_blocks, COMM, dim, cell, **shape)
            run = partial(path, scene, motion, degree, make, friction)
            yield f"blocks: {group}", f"{cell} {degree}{method}", run


# Demos


def counts(result):
    """Accepted steps, and those that were halved if the demo says so."""
    return len(result.iterations), getattr(result, "halvings", 0)


def ironing(friction, until=1.4):
    """Shallow ironing, coarse, as far as t: 10 steps down, 20 along to t = 1.4."""
    model = shallow_ironing.Ironing(COMM, 60, friction=friction)
    rows = list(model.path(0.0, 10, 50, until))
    return len(rows), rows[-1].halvings


def press_fit_path():
    """The press fit's history, as it leaves it."""
    with TemporaryDirectory() as folder:
        press_fit.main(["--output", folder])
        file = Path(folder) / "press_fit.csv"
        rows = np.genfromtxt(file, delimiter=",", names=True)
    return SimpleNamespace(
        iterations=rows["iterations"], halvings=int(rows["halvings"][-1])
    )


def cylinder(degree, method):
    case = hertz_cylinder.SMALL
    return counts(hertz_cylinder.solve(COMM, case, 20, degree, method=method()))


def demos():
    """Group, name and run of demos."""
    for degree, (method, make) in product((1, 2), METHODS.items()):
        run = partial(cylinder, degree, make)
        yield "Hertz", f"cylinder, degree {degree}{method}", run
    for name, run in (
        ("two spheres", lambda: hertz_sphere.solve(COMM, 8)),
        ("Cattaneo and Mindlin", lambda: cattaneo_mindlin.solve(COMM, 20)),
    ):
        yield "Hertz", name, lambda run=run: counts(run())
    for name, run in (
        ("punch, hexahedra", lambda: blocks_3d.punch(COMM, 4, 1)),
        ("equal blocks, shaken tetrahedra", lambda: blocks_3d.patch(COMM, 4, 1)),
        ("half ring, friction 0.5", lambda: half_ring.solve(COMM, 32, 20)),
        ("half ring, frictionless", lambda: half_ring.solve(COMM, 32, 20, 0.0)),
        ("press fit", press_fit_path),
        ("ironing in 3D", lambda: ironing_3d.solve(COMM, 2, (5, 10))),
    ):
        yield "demos", name, lambda run=run: counts(run())
    yield "demos", "shallow ironing, friction 0.3", partial(ironing, 0.3)
    yield "demos", "shallow ironing, frictionless", partial(ironing, 0.0)


# Measurement


def measure(run, tangent):
    """Steps, or how the path ended instead, halvings, iterations, seconds of a run."""
    Counted.choice, Counted.assemblies = tangent, 0
    start = time.process_time()
    with mock.patch.object(raymortar, "Contact", Counted):
        try:
            steps, halved = run()
        except raymortar.ConvergenceError:
            steps, halved = FAILS, 0
        except TooLong:
            steps, halved = GIVEN_UP, 0
    return steps, halved, Counted.assemblies, time.process_time() - start


def rows(only, repeat):
    """Rows of the table. Seconds are the least of several runs: forms are compiled in
    the first, and other programs take their share of any."""
    for group, scene, run in (*blocks(), *demos()):
        if only and not any(name in f"{group}, {scene}" for name in only):
            continue
        seconds = defaultdict(list)
        found = {}
        for _, tangent in product(range(repeat), TANGENTS):
            if tangent in found and found[tangent][0] in (FAILS, GIVEN_UP):
                continue  # its seconds are in no sum
            *found[tangent], spent = measure(run, tangent)
            seconds[tangent].append(spent)
        for tangent, (steps, halved, iterations) in found.items():
            least = f"{min(seconds[tangent]):.3f}"
            yield (group, scene, tangent, steps, halved, iterations, least)


def summarise(table):
    """Sums by group, over the scenes that both tangents solve."""
    ends = (FAILS, GIVEN_UP)
    failed = {row[:2] for row in table if row[3] in ends}
    sums = defaultdict(lambda: np.zeros(4))
    for group, scene, tangent, steps, halved, iterations, seconds in table:
        sums[group, tangent][3] += steps in ends
        if (group, scene) not in failed:
            sums[group, tangent][:3] += halved, iterations, float(seconds)
    print(f"\n{'':32}tangent  scenes  fail  halved  iterations   seconds")
    for (group, tangent), (halved, iterations, seconds, fails) in sums.items():
        scenes = sum(row[0] == group and row[2] == tangent for row in table)
        print(
            f"{group:32}{tangent:7}{scenes:8}{fails:6.0f}{halved:8.0f}"
            f"{iterations:12.0f}{seconds:10.2f}"
        )


def main(arguments=None):
    """Run the benchmark."""
    logging.getLogger().setLevel(logging.WARNING)
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[1])
    parser.add_argument("--repeat", type=int, default=3, help="runs of each scene")
    parser.add_argument(
        "--only", nargs="+", help="scenes and groups whose names contain one of these"
    )
    parser.add_argument("--output", type=Path, default=HERE / "tangent.csv")
    options = parser.parse_args(arguments)
    table = []
    with options.output.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for row in rows(options.only, options.repeat):
            table.append(row)
            writer.writerow(row)
            file.flush()
            print(*row, sep=", ", flush=True)
    summarise(table)


if __name__ == "__main__":
    main()
