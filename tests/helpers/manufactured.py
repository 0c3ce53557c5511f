"""Contact problems with a manufactured solution, and the errors of what is found.

Errors are integrated with NumPy: no form is compiled but residual and Jacobian.
"""

from __future__ import annotations

import gathered
import numpy as np
import ufl
from conditions import dirichlet_dofs
from dolfinx import fem
from manufactured_fields import Fields, Motion
from manufactured_scenes import TAGS, on_elastic, on_rigid
from materials import MATERIALS
from mesh_measures import cell_nodes, jacobians, lagrange
from problems import COMM, DIMENSION, SOLVERS, cellwise, fix, gradient

import raymortar
from raymortar import NonlinearProblem
from raymortar.core import compat
from raymortar.core.discretization.facets import shape_functions

# Pressure that iterations start from; about that of all the fields. Without any,
# friction has no cone at first
GUESS = 0.015
REST = Motion()


class Manufactured:
    """A manufactured problem on one mesh. Collective.

    Parameters
    ----------
    fields
        Exact fields.
    cell, n
        Cells, and how many along an edge of the upper body.
    degree
        Of the displacement.
    motion
        The step.
    held
        The sides of the upper body have the exact displacements, too.
    swap
        The lower body is the slave.
    shake, seed, curved, bend
        See `manufactured_scenes`.
    method, options
        Of `raymortar.Contact`.
    """

    def __init__(
        self,
        fields: Fields,
        cell,
        n,
        degree=1,
        motion=REST,
        method=None,
        *,
        held=False,
        swap=False,
        shake=0.0,
        seed=0,
        curved=True,
        bend=0.0,
        **options,
    ):
        self.fields, self.motion, self.swap = fields, motion, swap
        mesh_options = {"shake": shake, "seed": seed}
        if fields.lower is None:
            # Straight cells of degree 1 will do where the master is bent by values
            mesh_options |= {"geometry_degree": 2 if curved else 1, "curved": curved}
            mesh_options["bend"] = bend
            self.scene = on_rigid(cell, n, **mesh_options)
        else:
            mesh_options |= {"geometry_degree": 2, "bend": bend} if bend else {}
            self.scene = on_elastic(cell, n, **mesh_options)
        self.dim, self._flat = DIMENSION[cell], not curved
        V = compat.vector_space(self.scene.mesh, degree)
        self.u = fem.Function(V, name="displacement")
        self.load, self.bcs = self._load(V), self._bcs(V, held)
        pairs = [(TAGS["slave"], TAGS["master"])]
        if swap:
            pairs = [pairs[0][::-1]]
        elif fields.lower is not None:
            # An edge of the slave may be a little beside its exact place
            pairs.append((TAGS["slave"], TAGS["free"]))
        self.contact = raymortar.Contact(
            self.u,
            self.scene.facet_tags,
            pairs,
            method,
            **options,
        )
        residual = self.stiffness(V) - self.load
        self.problem = NonlinearProblem(residual, self.contact, self.bcs)
        self.start()

    # The problem

    def _measures(self):
        """dx and ds, of degrees beyond the error of the discretisation."""
        p = compat.element_info(self.u.function_space).degree
        mesh = self.scene.mesh
        return (
            ufl.Measure(
                "dx",
                mesh,
                subdomain_data=self.scene.cell_tags,
                metadata={"quadrature_degree": 2 * p + 2},
            ),
            ufl.Measure(
                "ds",
                mesh,
                subdomain_data=self.scene.facet_tags,
                metadata={"quadrature_degree": 2 * p + 4},
            ),
        )

    def stiffness(self, V):
        """Internal forces, UFL. A rigid body has the upper one's material."""
        dx, _ = self._measures()
        upper = self.fields.upper
        bodies = {"upper": upper, "lower": self.fields.lower or upper}
        moduli = [
            cellwise(self.scene, {name: b.moduli[k] for name, b in bodies.items()})
            for k in (0, 1)
        ]
        P = MATERIALS["svk"][0](ufl.grad(self.u), *moduli)
        return ufl.inner(P, ufl.grad(ufl.TestFunction(V))) * dx

    def _load(self, V):
        """Dead loads, UFL: all that the exact stress asks for but the contact.

        Volume forces b = -div P and surface forces P N make the work of P on the
        gradient of the test function; the contact traction is taken off.
        """
        dx, ds = self._measures()
        v, X = ufl.TestFunction(V), ufl.SpatialCoordinate(self.scene.mesh)
        fields, motion = self.fields, self.motion
        bodies = self.scene.bodies
        _, P, _ = fields.upper.exact(X, motion.s1, motion.c)
        _, traction, _ = fields.contact(X, motion)
        L = ufl.inner(P, ufl.grad(v)) * dx(bodies["upper"])
        L -= ufl.inner(traction, v) * ds(TAGS["slave"])
        if fields.lower is not None:
            _, P, _ = fields.lower.exact(X, motion.s1)
            _, traction, _ = fields.contact(fields.above(X, motion), motion)
            L += ufl.inner(P, ufl.grad(v)) * dx(bodies["lower"])
            L += ufl.inner(traction, v) * ds(TAGS["master"])
        return L

    def _rigid(self, x):
        """Displacement (n, d) of a rigid lower body."""
        u = np.zeros_like(x)
        if self._flat:
            u[:, -1] = -0.2 * (x[:, :2] ** 2).sum(axis=1) - 0.5
            if self.dim == 2:
                u[:, -1] = -0.05 * (x[:, 0] - 0.5) ** 2
        return u

    def _bcs(self, V, held):
        """Exact displacements on the top (and the sides), and at the bottom or all over
        the rigid."""

        def exact(x):
            return self.fields.upper.values(x, self.motion.s1, self.motion.c)

        names = ["top", "side"] if held else ["top"]
        bcs = [fix(V, self.scene, names, value=exact)]
        if self.fields.lower is not None:
            lower = self.fields.lower
            value = lambda x: lower.values(x, self.motion.s1)  # noqa: E731
            return [*bcs, fix(V, self.scene, "bottom", value=value)]
        self._rest = fem.Function(V)
        self._rest.interpolate(lambda x: self._rigid(x[: self.dim].T).T)
        cells = self.scene.cell_tags.find(self.scene.bodies["lower"])
        dofs = fem.locate_dofs_topological(V, self.dim, cells)
        return [*bcs, fem.dirichletbc(self._rest, dofs)]

    def interpolate(self, s, c):
        """Set u to the interpolant of an exact state."""
        V = self.u.function_space
        X = V.tabulate_dof_coordinates()[:, : self.dim]
        table = compat.dofmap_array(V)
        values = self.u.x.array.reshape(-1, self.dim)
        lower = self.fields.lower
        for name, exact in (
            ("upper", lambda x: self.fields.upper.values(x, s, c)),
            ("lower", self._rigid if lower is None else lambda x: lower.values(x, s)),
        ):
            tags = self.scene.cell_tags
            cells = tags.indices[tags.values == self.scene.bodies[name]]
            dofs = np.unique(table[cells])
            values[dofs] = exact(X[dofs])

    def start(self):
        """Accept the exact state at s0; start from that at s1 and a uniform pressure.

        What is found is the subject here, not how.
        """
        self.interpolate(self.motion.s0, 1.0)
        self.contact.advance()
        self.interpolate(self.motion.s1, self.motion.c)
        lam = self.contact.multiplier
        if lam is not None:
            components = self.contact.layout.components
            values = lam.x.array.reshape(-1, components)
            upward = 1.0 if components > 1 and not self.swap else -1.0
            values[self.contact.zones[0].multiplier_nodes, -1] = upward * GUESS

    def solve(self):
        """Newton iterations."""
        return SOLVERS[0](self.problem).solve()[0]

    # Errors

    def _cells(self, name):
        """This rank's owned cells of a body."""
        tags = self.scene.cell_tags
        owned = self.scene.mesh.topology.index_map(self.dim).size_local
        cells = tags.indices[tags.values == self.scene.bodies[name]]
        return cells[cells < owned]

    def errors(self, points=True):
        """Errors relative to the exact fields' norms, by name. Collective.

        `u_upper`, `H_upper` (displacement and its gradient in L2), the same of an
        elastic lower body, `pressure` (of the law, at the integration points) and
        `multiplier` (unless there is none), both in L2 of the reference surface. Without
        `points`, all but the pressure: of a solution that is not raymortar's.
        """
        found = self._displacement_errors("upper", self.fields.upper)
        if self.fields.lower is not None:
            found |= self._displacement_errors("lower", self.fields.lower)
        if points:
            found["pressure"] = self._pressure_error()
        if self.contact.multiplier is not None:
            found["multiplier"] = self._multiplier_error()
        return found

    def _displacement_errors(self, name, body):
        mesh, V = self.scene.mesh, self.u.function_space
        p, g = compat.element_info(V).degree, compat.geometry_degree(mesh)
        cells, cell = self._cells(name), compat.cell_name(mesh)
        points, weights = compat.quadrature(cell, 2 * p + 4)
        shape = lagrange(cell, g, points)[0]
        X = np.einsum("qn,cni->cqi", shape, cell_nodes(mesh)[cells])
        det = np.abs(np.linalg.det(jacobians(mesh, points)[cells]))
        nodal = self.u.x.array.reshape(-1, self.dim)[compat.dofmap_array(V)[cells]]
        u = np.einsum("qn,cni->cqi", lagrange(cell, p, points)[0], nodal)
        state = (self.motion.s1, self.motion.c)
        exact, H = body.values(X, *state), body.gradient(X, *state)
        dX = (det * weights)[..., None]
        return {
            f"u_{name}": relative(u - exact, exact, dX),
            f"H_{name}": relative(
                gradient(self.u, points)[cells] - H, H, dX[..., None]
            ),
        }

    def _exact_traction(self, X):
        """Pressure, traction on the slave and area ratio at points of its face."""
        if self.swap:
            X = self.fields.above(X, self.motion)
        p, traction, _, area = self.fields.contact_at(X, self.motion)
        if self.contact.measure == "current":
            p, traction = p / area, traction / area[:, None]
        return p, -traction if self.swap else traction

    def _slave_points(self):
        """Points X (f, q, d) of the slave's facets, their areas (f, q), and the
        multiplier's shape functions there (q, n)."""
        surface = self.contact.zones[0].facets.slave_surface
        points, weights = compat.quadrature(surface.shape, 10)
        N, dN = shape_functions(surface.shape, surface.node_degree, points)
        nodes = surface.X[surface.facet_nodes]
        tangents = np.einsum("aqk,fki->fqia", dN, nodes)
        gram = np.einsum("fqia,fqib->fqab", tangents, tangents)
        V = (self.contact.multiplier or self.u).function_space
        M, _ = shape_functions(surface.shape, compat.element_info(V).degree, points)
        area = np.sqrt(np.linalg.det(gram)) * weights
        return np.einsum("qk,fki->fqi", N, nodes), area, M

    def _traction_error(self, nodal):
        """Error of nodal pressures (f, n, 1) or tractions (f, n, d) on the slave."""
        X, area, M = self._slave_points()
        found = np.einsum("qk,fki->fqi", M, nodal).reshape(area.size, nodal.shape[-1])
        p, traction = self._exact_traction(X.reshape(-1, self.dim))
        exact = traction if found.shape[1] > 1 else p[:, None]
        return relative(found - exact, exact, area.reshape(-1, 1))

    def _multiplier_error(self):
        components = self.contact.layout.components
        lam = self.contact.multiplier.x.array.reshape(-1, components)
        return self._traction_error(lam[self.contact.zones[0].multiplier_table])

    def internal_forces(self):
        """Residual of everything but contact, an array of u. Serial."""
        r = np.zeros(len(self.u.x.array))
        compat.assemble_residual(r, self.problem.L)
        return r

    def flux_error(self, forces):
        """Error of the traction that does the work of nodal forces (dofs, d). Serial,
        and for a multiplier of the displacement's degree."""
        table = self.contact.zones[0].facets.slave_surface.facet_dofs
        _, area, M = self._slave_points()
        mass = np.zeros((len(forces),) * 2)
        local = np.einsum("fq,qa,qb->fab", area, M, M)
        np.add.at(mass, (table[:, :, None], table[:, None, :]), local)
        return self._traction_error(np.linalg.solve(mass, forces)[table])

    def _pressure_error(self):
        zone, points = self.contact.zones[0], self.contact.points()
        if COMM.allreduce(len(points["gap"])) == 0:
            raise RuntimeError("the bodies have lost contact")
        surface = zone.facets.slave_surface
        N, _ = shape_functions(surface.shape, surface.node_degree, points["xi"])
        nodes = surface.X[surface.facet_nodes[points["slave"]]]
        p, _ = self._exact_traction(np.einsum("qk,qki->qi", N, nodes))
        return relative(points["pressure"] + p, p, points["weight"])


def relative(error, exact, weights):
    """Norm of an error over that of what is exact. Collective."""
    squares = [COMM.allreduce(float((weights * f**2).sum())) for f in (error, exact)]
    return np.sqrt(squares[0] / squares[1])


def rates(errors):
    """Orders of convergence between meshes of half the size: by name, a list."""
    return {
        name: [float(np.log2(a[name] / b[name])) for a, b in zip(errors, errors[1:])]
        for name in errors[0]
    }


def value(expression, point):
    """A UFL expression of the position at a point, as an array."""
    shape = expression.ufl_shape
    entries = [
        expression[index](tuple(point)) if index else expression(tuple(point))
        for index in np.ndindex(*shape)
    ]
    return np.array(entries).reshape(shape)


def solve(*args, **options):
    """The solved problem; arguments of `Manufactured`."""
    problem = Manufactured(*args, **options)
    problem.solve()
    return problem


def flux_error(m):
    """Error of the consistent flux where the exact displacement is prescribed.

    No contact is left; what errs is the stress in the bulk, on the same mesh and with
    the multiplier's functions.
    """
    m.interpolate(m.motion.s1, m.motion.c)
    V, zone = m.u.function_space, m.contact.zones[0]
    exact = fix(
        V, m.scene, "slave", value=lambda x: m.fields.upper.values(x, m.motion.s1)
    )
    bcs, n = [*m.bcs, exact], len(m.u.x.array)
    marker, _ = dirichlet_dofs(bcs, V)
    A = m.problem.create_matrix()
    for _ in range(4):
        A.zeroEntries()
        compat.assemble_jacobian(A, m.problem.a, bcs)
        A.assemble()
        r = m.internal_forces()
        r[marker == 1] = 0.0
        m.u.x.array[:] -= np.linalg.solve(gathered.dense(A)[:n, :n], r)
    forces = m.internal_forces().reshape(-1, m.dim)[zone.facets.slave_surface.dofs]
    return m.flux_error(forces)
