"""Shallow ironing from end to end, in raymortar and in GetFEM: run time, shares of ours.

The demo's mesh, law, friction and steps, and the force to converge to, on both sides.
Alike: MUMPS factorises each tangent, three points on a facet (ours: on a segment), full
Newton steps, from the last state or, in both, from where the last two point to. As used:
each with what its users get, which with ours is an automatic solver and predictor, and
with GetFEM `Model.solve` with its line search.
"""

from __future__ import annotations

import cProfile
import math
import pstats
import statistics
import sys
import time
from functools import partial
from pathlib import Path

from mpi4py import MPI

import numpy as np
import peer
from peer import MASTER, SLAVE, gf

import raymortar

ROOT = Path(__file__).parents[2]
# Behind this folder's modules, which have names of theirs
sys.path.append(str(ROOT / "benchmarks"))

from models import shallow_ironing as demo  # noqa: E402

from meshes.ironing import scene_of  # noqa: E402

BOTTOM, TOP = 3, 4
MAX_ITERATIONS = 40
FORCE = 1e-10 * demo.E_FOUNDATION
# Degree of the rule with three points, as GetFEM's has
THREE_POINTS = 4
# Of ours by file and name of what runs: PETSc's solvers, DOLFINx's forms, contact in C++,
# which a profile sees as the Python that calls it where it is a method
SHARES = {
    "solver_share": ("petsc4py.PETSc.KSP", "petsc4py.PETSc.SNES"),
    "forms_share": ("dolfinx.cpp.fem",),
    "contact_share": ("raymortar._cpp", "iterates.py assemble_residual"),
}
SMALL = (24, 4, 20, 1.1)


def times(press, slide, until):
    """Ends of the steps: down until t = 1, then along."""
    along = math.ceil((until - 1.0) * slide - 1e-6)
    down = np.linspace(0.0, 1.0, press + 1)[1:]
    return [*down, *np.linspace(1.0, until, along + 1)[1:]]


def ours(size, press, slide, until, profile=None, **options):
    """Row of raymortar; `options` are those of the demo's model."""
    model = demo.Ironing(MPI.COMM_SELF, size, "neo-hookean", **options)
    start = time.process_time(), time.perf_counter()
    with profile or _nothing():
        rows = list(model.path(0.0, press, slide, until))
    return {
        "steps": len(rows),
        "halvings": rows[-1].halvings,
        "iterations": sum(row.iterations for row in rows),
        "seconds": time.process_time() - start[0],
        "wall": time.perf_counter() - start[1],
        "V": rows[-1].V,
        "H": rows[-1].H,
    }


class _nothing:
    """A profile that is none."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None


def shares(run):
    """Shares of a path's CPU seconds, of a run that is profiled beside one that is not.

    Profiling slows down Python alone, which has what the others leave of the seconds
    without it.
    """
    seconds = run()["seconds"]
    profile = cProfile.Profile(time.process_time)
    run(profile=profile)
    own = {}
    for (file, _, name), (_, _, tottime, *_) in pstats.Stats(profile).stats.items():
        for share, parts in SHARES.items():
            if any(part in f"{Path(file).name} {name}" for part in parts):
                own[share] = own.get(share, 0.0) + tottime / seconds
    return own | {"python_share": 1.0 - sum(own.values())}


class Peer:
    """The same problem in GetFEM."""

    def __init__(self, size, across=None):
        scene = scene_of(MPI.COMM_SELF, size, across)
        self.model = gf.Model("real")
        # GetFEM's model does not keep alive what it is made of
        self._kept = []
        foundation = self._body(scene, 1, "u_m", demo.E_FOUNDATION)
        indenter = self._body(scene, 2, "u_s", demo.E_INDENTER)
        x, y = foundation.pts()
        self._region(foundation, BOTTOM, np.abs(y + 4.0) < 1e-9)
        self._region(foundation, MASTER, np.abs(y) < 1e-9)
        x, y = indenter.pts()
        self._region(indenter, TOP, np.abs(y - 1.4) < 1e-9)
        self._region(indenter, SLAVE, np.abs(np.hypot(x - 0.8, y - 0.95) - 0.75) < 1e-9)
        self._hold("u_m", BOTTOM)
        self._hold("u_s", TOP)
        self._contact(foundation, indenter)
        self._before = None

    def _body(self, scene, tag, name, E):
        mesh = peer.mesh_of(scene.mesh, scene.cell_tags.find(tag), "quadrilateral")
        space = gf.MeshFem(mesh, 2)
        space.set_classical_fem(1)
        mu = E / (2 * (1 + demo.NU))
        la = E * demo.NU / ((1 + demo.NU) * (1 - 2 * demo.NU))
        self.model.add_fem_variable(name, space)
        self.model.add_fem_data(f"{name}_old", space)
        self.model.add_fem_data(f"{name}_held", space)
        F = f"(Id(2)+Grad_{name})"
        stress = f"({mu}*({F}-Inv({F})')+{la}*log(Det({F}))*Inv({F})')"
        volume = gf.MeshIm(mesh, 2)
        self.model.add_nonlinear_term(volume, f"{stress}:Grad_Test_{name}")
        self._kept += [mesh, space, volume]
        return mesh

    @staticmethod
    def _region(mesh, number, on_it):
        faces = mesh.faces_from_pid(mesh.pid()[on_it])
        outer = set(map(tuple, mesh.outer_faces().T))
        mesh.set_region(number, np.array(sorted(outer & set(map(tuple, faces.T)))).T)

    def _hold(self, name, region):
        self.model.add_Dirichlet_condition_with_simplification(
            name, region, f"{name}_held"
        )

    def _contact(self, foundation, indenter):
        model = self.model
        multipliers = gf.MeshFem(indenter, 2)
        multipliers.set_classical_fem(1)
        model.add_filtered_fem_variable("lam", multipliers, SLAVE)
        for name, value in (("r", demo.GAMMA), ("mu_f", demo.FRICTION), ("alpha", 1.0)):
            model.add_initialized_data(name, [value])
        brick = model.add_integral_large_sliding_contact_brick_raytracing(
            "r", 1.0, "mu_f", "alpha"
        )
        method, _ = peer.RULES["quadrilateral", 1]
        rules = [gf.MeshIm(mesh, gf.Integ(method)) for mesh in (indenter, foundation)]
        model.add_slave_contact_boundary_to_large_sliding_contact_brick(
            brick, rules[0], SLAVE, "u_s", "lam", "u_s_old"
        )
        model.add_master_contact_boundary_to_large_sliding_contact_brick(
            brick, rules[1], MASTER, "u_m", "u_m_old"
        )
        self._kept += [multipliers, *rules]
        self._rule = rules[0]

    def step(self, t, extrapolate=False, as_used=False):
        """Newton's method at time t; its iterations, None if it fails."""
        model = self.model
        motion = (demo.SLID * max(t - 1.0, 0.0), -demo.PRESSED * min(t, 1.0))
        held = np.tile(motion, model.variable("u_s").size // 2)
        model.set_variable("u_s_held", held)
        for name in ("u_s", "u_m"):
            model.set_variable(f"{name}_old", model.variable(name))
        last = model.from_variables()
        if extrapolate and self._before is not None:
            model.to_variables(2.0 * last - self._before)
        # The first step along goes another way
        self._before = None if t == 1.0 else last
        return self._solve_as_used() if as_used else self._solve()

    def _solve(self):
        model = self.model
        for iteration in range(MAX_ITERATIONS + 1):
            model.assembly("build_all")
            if not np.linalg.norm(model.rhs()) > FORCE:
                return iteration
            step = gf.linsolve_mumps(model.tangent_matrix(), model.rhs())
            model.to_variables(model.from_variables() + np.ravel(step))
        return None

    def _solve_as_used(self):
        """With the line search and the tolerance of GetFEM's demos of this contact."""
        options = ("max_iter", MAX_ITERATIONS, "max_res", 1e-8, "lsearch", "simplest")
        iterations, converged = self.model.solve(*options, "alpha min", 0.8)
        return iterations if converged else None

    def force(self):
        """(H, V): integral of the multiplier over the slave, per direction."""
        return [
            abs(gf.asm_generic(self._rule, 0, f"lam({i})", SLAVE, self.model))
            for i in (1, 2)
        ]


def theirs(size, press, slide, until, across=None, **options):
    """Row of GetFEM, as far as it gets; `options` are those of `Peer.step`."""
    model, done, iterations = Peer(size, across), 0, 0
    start = time.process_time(), time.perf_counter()
    for t in times(press, slide, until):
        count = model.step(t, **options)
        if count is None:
            break
        done, iterations = done + 1, iterations + count
    row = {"steps": done, "iterations": iterations}
    row["seconds"] = time.process_time() - start[0]
    row["wall"] = time.perf_counter() - start[1]
    H, V = model.force()
    return row | {"V": V, "H": H}


def programs(path):
    """Runs by (setting, program)."""
    alike = {"options": raymortar.solvers.direct(), "quadrature_degree": THREE_POINTS}
    found = {
        ("alike", "raymortar"): partial(ours, *path, extrapolate=False, **alike),
        ("alike", "GetFEM"): partial(theirs, *path),
        ("alike, both extrapolated", "raymortar"): partial(
            ours, *path, extrapolate=True, **alike
        ),
        ("alike, both extrapolated", "GetFEM"): partial(
            theirs, *path, extrapolate=True
        ),
        ("as used", "raymortar"): partial(ours, *path, extrapolate=None),
        ("as used", "GetFEM"): partial(theirs, *path, as_used=True),
    }
    return {key: run for key, run in found.items() if gf or key[1] == "raymortar"}


def rows(quick):
    """All programs on the same path, in turn; the medians of their seconds."""
    runs, found = programs(SMALL if quick else (60, 10, 100, 2.0)), {}
    for run in programs(SMALL).values():
        run()  # compiles forms
    for _ in range(1 if quick else 3):
        for key, run in runs.items():
            found.setdefault(key, []).append(run())
    result = []
    for (setting, program), repeated in found.items():
        row = {"setting": setting, "program": program} | repeated[0]
        for name in ("seconds", "wall"):
            row[name] = statistics.median(one[name] for one in repeated)
        if program == "raymortar":
            row |= shares(runs[setting, program])
        result.append(row)
    return result
