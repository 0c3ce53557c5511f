"""Elastic bodies that are pressed together, in GetFEM: the same meshes and steps.

GetFEM's large sliding contact by ray tracing, with the fourth degree rule of its demos
on whole slave facets. Supports of one component are penalties of a million moduli.
"""

from __future__ import annotations

import time

import numpy as np
from dolfinx import mesh as dolfinx_mesh
from edge_scenes import NU, Pressed
from getfem_peer import MAX_ITERATIONS, gf

from raymortar.core import compat

SLAVE, MASTER, ALL, OTHERS = 1, 2, 3, 10
# GetFEM's maps by dimension and degree of the geometry, and its order of nodes
_MAPS = {
    (2, 1): ("GT_QK(2,1)", [0, 1, 2, 3]),
    (2, 2): ("GT_QK(2,2)", [0, 4, 1, 5, 8, 6, 2, 7, 3]),
    (3, 1): ("GT_QK(3,1)", list(range(8))),
}


class Peer:
    """GetFEM's model of a case."""

    def __init__(self, case: Pressed, degree, quadrature=4):
        self.case, self.dim = case, case.dim
        self.model, self._kept = gf.Model("real"), []
        self.model.add_initialized_data("push", [0.0])
        self.spaces = {body: self._body(body, degree) for body in case.moduli}
        self._support()
        self._contact(degree, quadrature)

    def _body(self, body, degree):
        """Mesh, space, elasticity and facets by name of a body."""
        scene, d = self.case.scene, self.dim
        cells = scene.cell_tags.find(scene.bodies[body])
        kind, order = _MAPS[d, compat.geometry_degree(scene.mesh)]
        nodes = scene.mesh.geometry.x[compat.geometry_dofmap(scene.mesh)[cells]]
        mesh = gf.Mesh("empty", d)
        points = nodes[:, order, :d].transpose(2, 1, 0)
        mesh.add_convex(gf.GeoTrans(kind), np.ascontiguousarray(points))
        self._mark(mesh)
        space, volume = gf.MeshFem(mesh, d), gf.MeshIm(mesh, 2 * degree)
        space.set_classical_fem(degree)
        E, u = self.case.moduli[body], f"u_{body}"
        self.model.add_fem_variable(u, space)
        mu, la = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
        stress = f"({la}*Trace(Grad_{u})*Id({d})+{2.0 * mu}*Sym(Grad_{u}))"
        self.model.add_linear_term(volume, f"{stress}:Grad_Test_{u}")
        self._kept += [space, volume]
        return mesh

    def _mark(self, mesh):
        """Regions of the tags on this body, by the middles of facets."""
        scene, d = self.case.scene, self.dim
        facets = scene.facet_tags
        middles = dolfinx_mesh.compute_midpoints(scene.mesh, d - 1, facets.indices)
        tags = dict(zip(map(tuple, np.round(middles[:, :d], 7)), facets.values))
        corners = 2 ** (d - 1)
        found = {}
        for face in mesh.outer_faces().T:
            x = mesh.pts(mesh.pid_in_faces(face[:, None])).T
            # Corners of a face are the two ends of a quadratic line
            if len(x) > corners:
                far = np.linalg.norm(x[:, None] - x[None], axis=2)
                x = x[list(np.unravel_index(far.argmax(), far.shape))]
            middle = tuple(np.round(x.mean(axis=0), 7))
            if middle in tags:
                found.setdefault(tags[middle], []).append(face)
        for tag, faces in found.items():
            mesh.set_region(OTHERS + int(tag), np.array(faces).T)

    def _support(self):
        """Components that are held or led, and a body that is led as a whole."""
        case = self.case
        held = [(*one, "0") for one in case.held]
        if isinstance(case.led, tuple):
            held.append((*case.led, "-push"))
        for body, mesh in self.spaces.items():
            u = f"u_{body}"
            if body == case.led:
                cells, space = mesh.cvid(), self.model.mesh_fem_of_variable(u)
                mesh.set_region(ALL, np.vstack([cells, np.full(len(cells), -1)]))
                self.model.add_fem_data("led", space)
                self.model.add_Dirichlet_condition_with_simplification(u, ALL, "led")
                continue
            sides = gf.MeshIm(mesh, 4)
            self._kept.append(sides)
            for name, i, value in held:
                tag = OTHERS + case.scene.tags[name]
                if tag in mesh.regions():
                    penalty = 1e6 * case.moduli[body]
                    self.model.add_nonlinear_term(
                        sides,
                        f"{penalty}*({u}({i + 1})-({value}))*Test_{u}({i + 1})",
                        tag,
                    )

    def _contact(self, degree, quadrature):
        case, model = self.case, self.model
        regions = {}
        for name, number in ((case.slave, SLAVE), (case.master, MASTER)):
            tag = OTHERS + case.scene.tags[name]
            (body,) = (b for b, m in self.spaces.items() if tag in m.regions())
            self.spaces[body].set_region(number, self.spaces[body].region(tag))
            regions[number] = body
        slave, master = regions[SLAVE], regions[MASTER]
        multipliers = gf.MeshFem(self.spaces[slave], self.dim)
        multipliers.set_classical_fem(degree if self.dim == 2 else 1)
        model.add_filtered_fem_variable("lam", multipliers, SLAVE)
        model.add_initialized_data("r", [case.gamma])
        brick = model.add_integral_large_sliding_contact_brick_raytracing(
            "r", case.release
        )
        rules = [gf.MeshIm(self.spaces[body], quadrature) for body in (slave, master)]
        model.add_slave_contact_boundary_to_large_sliding_contact_brick(
            brick, rules[0], SLAVE, f"u_{slave}", "lam"
        )
        model.add_master_contact_boundary_to_large_sliding_contact_brick(
            brick, rules[1], MASTER, f"u_{master}"
        )
        self._fine = gf.MeshIm(self.spaces[slave], 12)
        self._kept += [multipliers, *rules, self._fine]

    def _integral(self, expression):
        return gf.asm_generic(self._fine, 0, expression, SLAVE, self.model)

    def solve(self):
        """Newton's method with full steps in all load steps; iterations, None if it
        fails, CPU and wall seconds."""
        case, model, iterations = self.case, self.model, 0
        start = time.process_time(), time.perf_counter()
        for step in range(1, case.steps + 1):
            push = case.push * (step / case.steps) ** 2
            model.set_variable("push", [push])
            if isinstance(case.led, str):
                led = np.zeros((model.variable("led").size // self.dim, self.dim))
                led[:, -1] = -push
                model.set_variable("led", led.ravel())
            for _ in range(MAX_ITERATIONS + 1):
                model.assembly("build_all")
                if np.linalg.norm(model.rhs()) <= case.tolerance:
                    break
                update = gf.linsolve_mumps(model.tangent_matrix(), model.rhs())
                model.to_variables(model.from_variables() + np.ravel(update))
                iterations += 1
            else:
                return None
        return (
            iterations,
            time.process_time() - start[0],
            time.perf_counter() - start[1],
        )

    def force(self):
        """Vertical force on the slave."""
        return self._integral(f"lam({self.dim})")

    def error(self):
        """Of the pressure in L2, as `edge_scenes.pressure_error`."""
        case, d = self.case, self.dim
        total = self.force()
        a, p0 = case.exact(case.symmetric * abs(total))
        r = "sqrt(" + "+".join(f"sqr(X({i}))" for i in range(1, d)) + ")"
        exact = f"({p0}*{case.formula.format(s=f'({r}/{a})')})"
        counts = f"Heaviside({case.within}-{r}/{a})"
        off = self._integral(f"{counts}*sqr({np.sign(total)}*lam({d})-{exact})")
        return np.sqrt(off / self._integral(f"{counts}*sqr({exact})"))
