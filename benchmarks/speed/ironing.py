"""Shallow ironing from end to end, in raymortar and in GetFEM: run time, contact's share.

The demo's mesh, law, friction and steps on both sides; each step starts from the last
one, with full Newton steps to the same force. As users run it, raymortar extrapolates.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

from mpi4py import MPI

import numpy as np
import peer
from peer import MASTER, SLAVE, gf

ROOT = Path(__file__).parents[2]
# Behind this folder's modules, which have names of theirs
sys.path += [str(ROOT / "benchmarks"), str(ROOT / "benchmarks" / "accuracy")]

import clock  # noqa: E402
from models import shallow_ironing as demo  # noqa: E402

BOTTOM, TOP = 3, 4
MAX_ITERATIONS = 40
FORCE = 1e-10 * demo.E_FOUNDATION


def times(press, slide, until):
    """Ends of the steps: down until t = 1, then along."""
    along = math.ceil((until - 1.0) * slide - 1e-6)
    down = np.linspace(0.0, 1.0, press + 1)[1:]
    return [*down, *np.linspace(1.0, until, along + 1)[1:]]


def ours(size, press, slide, until, extrapolate=False):
    """Row of raymortar; `extrapolate`: steps start from where the last two point to."""
    model = demo.Ironing(MPI.COMM_SELF, size, "neo-hookean", extrapolate=extrapolate)
    with clock.Clock() as watch:
        rows = list(model.path(0.0, press, slide, until))
    part = watch.seconds
    contact = sum(part[name] for name in ("pairing", "integration", "assembly"))
    return {
        "program": "raymortar, extrapolated" if extrapolate else "raymortar",
        "steps": len(rows),
        "halvings": rows[-1].halvings,
        "iterations": sum(row.iterations for row in rows),
        "seconds": part["seconds"],
        "contact_share": contact / part["seconds"],
        "V": rows[-1].V,
        "H": rows[-1].H,
    }


class Peer:
    """The same problem in GetFEM."""

    def __init__(self, size):
        scene = demo.ironing_scene(MPI.COMM_SELF, size)
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

    def step(self, t):
        """Newton's method at time t; its iterations, None if it fails."""
        model = self.model
        motion = (demo.SLID * max(t - 1.0, 0.0), -demo.PRESSED * min(t, 1.0))
        held = np.tile(motion, model.variable("u_s").size // 2)
        model.set_variable("u_s_held", held)
        for name in ("u_s", "u_m"):
            model.set_variable(f"{name}_old", model.variable(name))
        for iteration in range(MAX_ITERATIONS + 1):
            model.assembly("build_all")
            if not np.linalg.norm(model.rhs()) > FORCE:
                return iteration
            step = gf.linsolve_mumps(model.tangent_matrix(), model.rhs())
            model.to_variables(model.from_variables() + np.ravel(step))
        return None

    def force(self):
        """(H, V): integral of the multiplier over the slave, per direction."""
        return [
            abs(gf.asm_generic(self._rule, 0, f"lam({i})", SLAVE, self.model))
            for i in (1, 2)
        ]


def theirs(size, press, slide, until):
    """Row of GetFEM, as far as it gets."""
    model, done, iterations = Peer(size), 0, 0
    start = time.process_time()
    for t in times(press, slide, until):
        count = model.step(t)
        if count is None:
            break
        done, iterations = done + 1, iterations + count
    seconds = time.process_time() - start
    H, V = model.force()
    row = {"program": "GetFEM", "steps": done, "iterations": iterations}
    return row | {"seconds": seconds, "V": V, "H": H}


def rows(quick):
    """Both programs on the same path."""
    path = (24, 4, 20, 1.1) if quick else (60, 10, 100, 2.0)
    found = [ours(*path), ours(*path, extrapolate=True)]
    return [*found, theirs(*path)] if gf else found
