"""A case in GetFEM: large sliding contact by ray tracing (python3-getfem).

The fourth degree rule of its demos on whole slave facets, a vector multiplier, MUMPS.
Alike: full Newton steps to the case's force. As its users run it: `Model.solve` with the
line search of its demos. Supports of single components are penalties of a million moduli,
whose forces `Model.solve` would take for the load that its tolerance is relative to.
"""

from __future__ import annotations

import numpy as np
import ufl  # noqa: F401  (before getfem, which brings a PETSc of its own on some systems)
from peer_case import FACES, Case, Effort, Failed, Found

from raymortar.core import compat

try:
    import getfem as gf
except ImportError:
    gf = None
else:
    gf.util_trace_level(0)

SLAVE, MASTER, LED, HELD = 1, 2, 3, 10
RULE, MAX_ITERATIONS = 4, 40
# Its maps by cell and degree of the geometry, and DOLFINx's nodes in its order
_MAPS = {
    ("quadrilateral", 1): ("GT_QK(2,1)", [0, 1, 2, 3]),
    ("quadrilateral", 2): ("GT_QK(2,2)", [0, 4, 1, 5, 8, 6, 2, 7, 3]),
    ("hexahedron", 1): ("GT_QK(3,1)", list(range(8))),
    ("tetrahedron", 1): ("GT_PK(3,1)", [0, 1, 2, 3]),
}


class GetFEM:
    """GetFEM's model of a case."""

    FORMS = ("rays",)

    def __init__(self, case: Case, form: str, alike: bool):
        self.case, self.alike, self.dim = case, alike, case.dim
        # GetFEM's model does not keep alive what it is made of
        self.model, self._kept = gf.Model("real"), []
        self.meshes = {body: self._body(body) for body in case.moduli}
        self.led = [i for i, v in enumerate(case.way(0.0)) if v is not None]
        for i in self.led:
            self.model.add_initialized_data(f"way_{i}", [0.0])
        self._support()
        self._contact()

    @property
    def unknowns(self) -> int:
        """Displacements and multipliers."""
        return int(self.model.nbdof())

    def _body(self, body):
        """Mesh, displacement and stress of a body."""
        scene, d, case = self.case.scene, self.dim, self.case
        cells = scene.cell_tags.find(scene.bodies[body])
        kind, order = _MAPS[case.cell, compat.geometry_degree(scene.mesh)]
        nodes = scene.mesh.geometry.x[compat.geometry_dofmap(scene.mesh)[cells]]
        mesh = gf.Mesh("empty", d)
        points = nodes[:, order, :d].transpose(2, 1, 0)
        mesh.add_convex(gf.GeoTrans(kind), np.ascontiguousarray(points))
        space, u = gf.MeshFem(mesh, d), f"u_{body}"
        space.set_classical_fem(case.degree)
        volume = gf.MeshIm(mesh, 2 * case.degree)
        self.model.add_fem_variable(u, space)
        self.model.add_fem_data(f"{u}_old", space)
        self._kept += [space, volume]
        self._law(body, u, volume)
        return mesh

    def _law(self, body, u, volume):
        """As `raymortar_cases.stress`."""
        E, nu, d = self.case.moduli[body], self.case.nu, self.dim
        mu, la = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        if self.case.law == "linear":
            stress = f"({la}*Trace(Grad_{u})*Id({d})+{2.0 * mu}*Sym(Grad_{u}))"
            self.model.add_linear_term(volume, f"{stress}:Grad_Test_{u}")
            return
        F, K = f"(Id({d})+Grad_{u})", la + 2.0 / 3.0 * mu
        J, inverse = f"Det{F}", f"Inv({F})'"
        trace = f"(Norm_sqr{F}+{3 - d})"
        isochoric = f"{mu}*pow({J},-2/3)*({F}-{trace}/3*{inverse})"
        stress = f"({isochoric}+{K}*({J}-1)*{J}*{inverse})"
        self.model.add_nonlinear_term(volume, f"{stress}:Grad_Test_{u}")

    def _region(self, name, number):
        """Mark the facets with a name; the bodies that have them."""
        case, d = self.case, self.dim
        middles = case.places[case.corners(name)].mean(axis=1)
        wanted = set(map(tuple, np.round(middles, 7) + 0.0))
        corners, bodies = len(FACES[case.cell][0]), []
        for body, mesh in self.meshes.items():
            found = []
            for face in mesh.outer_faces().T:
                x = mesh.pts(mesh.pid_in_faces(face[:, None])).T
                # Corners of a face are the two ends of a quadratic line
                if len(x) > corners and d == 2:
                    far = np.linalg.norm(x[:, None] - x[None], axis=2)
                    x = x[list(np.unravel_index(far.argmax(), far.shape))]
                if tuple(np.round(x.mean(axis=0), 7) + 0.0) in wanted:
                    found.append(face)
            if found:
                mesh.set_region(number, np.array(found).T)
                bodies.append(body)
        if not bodies:
            raise ValueError(f"no facets of GetFEM are those of {name}")
        return bodies

    def _support(self):
        """Facets that are held or led: all components at once, or by penalties."""
        held = [(name, i, None) for name, i in self.case.held]
        held += [(self.case.led, i, f"way_{i}") for i in self.led]
        self._placed = None
        for k, name in enumerate(dict.fromkeys(name for name, *_ in held)):
            own = [(i, value) for other, i, value in held if other == name]
            for body in self._region(name, HELD + k):
                if len(own) == self.dim:
                    self._place(body, HELD + k, name == self.case.led)
                    continue
                for i, value in own:
                    self._penalise(body, HELD + k, i, value)

    def _place(self, body, region, led):
        data = f"held_{region}"
        self.model.add_fem_data(data, self.model.mesh_fem_of_variable(f"u_{body}"))
        self.model.add_Dirichlet_condition_with_simplification(
            f"u_{body}", region, data
        )
        if led:
            self._placed = data

    def _penalise(self, body, region, i, value):
        sides, u = gf.MeshIm(self.meshes[body], RULE), f"u_{body}({i + 1})"
        self._kept.append(sides)
        test = f"{1e6 * self.case.moduli[body]}*Test_{u}"
        self.model.add_linear_term(sides, f"{u}*{test}", region)
        if value:
            self.model.add_source_term(sides, f"{value}*{test}", region)

    def _contact(self):
        case, model, d = self.case, self.model, self.dim
        (slave,), (master,) = (
            self._region(name, number)
            for name, number in ((case.slave, SLAVE), (case.master, MASTER))
        )
        meshes = [self.meshes[body] for body in (slave, master)]
        multipliers = gf.MeshFem(meshes[0], d)
        multipliers.set_classical_fem(case.degree if d == 2 else 1)
        model.add_filtered_fem_variable("lam", multipliers, SLAVE)
        model.add_initialized_data("r", [case.gamma])
        law = []
        if case.friction:
            model.add_initialized_data("mu_f", [case.friction])
            model.add_initialized_data("alpha", [1.0])
            law = ["mu_f", "alpha"]
        brick = model.add_integral_large_sliding_contact_brick_raytracing(
            "r", case.release, *law
        )
        rules = [gf.MeshIm(mesh, RULE) for mesh in meshes]
        for body, rule, region in (
            (slave, rules[0], SLAVE),
            (master, rules[1], MASTER),
        ):
            u = [f"u_{body}"] + (["lam"] if region == SLAVE else [])
            u += [f"u_{body}_old"] if case.friction else []
            side = "slave" if region == SLAVE else "master"
            add = getattr(
                model, f"add_{side}_contact_boundary_to_large_sliding_contact_brick"
            )
            add(brick, rule, region, *u)
        self._kept += [multipliers, *rules]
        self._rule = rules[0]

    def solve(self) -> Effort:
        """Follow the path; GetFEM has no cutbacks of its own."""
        model, iterations, self._rows = self.model, 0, []
        for t in self.case.times():
            way = self.case.way(t)
            for i in self.led:
                model.set_variable(f"way_{i}", [way[i]])
            if self._placed:
                nodes = model.variable(self._placed).size // self.dim
                model.set_variable(self._placed, np.tile(way, nodes))
            for body in self.meshes:
                model.set_variable(f"u_{body}_old", model.variable(f"u_{body}"))
            count = self._alike() if self.alike else self._as_used()
            if count is None:
                raise Failed(
                    f"no convergence in {MAX_ITERATIONS} iterations at time {t:g}, "
                    f"{iterations} before"
                )
            iterations += count
            force = [abs(self._integral(f"lam({i + 1})")) for i in range(self.dim)]
            self._rows.append((t, *force))
        return Effort(iterations, len(self._rows), 0)

    def _alike(self):
        """Full Newton steps; iterations, None if they fail."""
        model = self.model
        for iteration in range(MAX_ITERATIONS + 1):
            model.assembly("build_all")
            norm = np.linalg.norm(model.rhs())
            if norm <= self.case.force:
                return iteration
            if not np.isfinite(norm):
                return None
            step = gf.linsolve_mumps(model.tangent_matrix(), model.rhs())
            model.to_variables(model.from_variables() + np.ravel(step))
        return None

    def _as_used(self):
        """With the line search of GetFEM's demos of this contact."""
        options = ("max_iter", MAX_ITERATIONS, "max_res", self.case.force)
        iterations, converged = self.model.solve(
            *options, "lsearch", "simplest", "alpha min", 0.8
        )
        return iterations if converged else None

    def _integral(self, expression):
        return gf.asm_generic(self._rule, 0, expression, SLAVE, self.model)

    def found(self) -> Found:
        """Integrals of the multiplier, and its vertical part at its nodes."""
        rows, d = np.array(self._rows), self.dim
        space = self.model.mesh_fem_of_variable("lam")
        kept = np.unique(space.basic_dof_on_region(SLAVE) // d)
        x = space.basic_dof_nodes()[:, ::d].T[kept]
        lam = np.reshape(self.model.variable("lam"), (-1, d))[:, -1]
        p = np.sign(self._integral(f"lam({d})")) * lam
        return Found(rows[:, 0], rows[:, 1:], *self.case.pressures(x, p))
