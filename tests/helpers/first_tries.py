"""Problems as a user sets them up at first: Gmsh meshes in metres, no number tuned."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from materials import lame
from problems import COMM

import raymortar
from raymortar.core import compat
from raymortar.io import read_gmsh

# Rubber
E, NU = 5e6, 0.45


def read(draw, size):
    """Mesh of degree 2 of a plane drawing. Collective.

    Parameters
    ----------
    draw
        Takes gmsh.model.occ; gives the surfaces of each body by name, and by name of a
        group what chooses its curves: (body, function of the curve's middle).
    size
        Of cells. Length.
    """
    import gmsh

    if COMM.rank == 0:
        gmsh.initialize(["", "-v", "1"])
        bodies, groups = draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        for tag, (name, surface) in enumerate(bodies.items(), 1):
            named(gmsh, 2, [surface], tag, name)
        for tag, (name, (body, chosen)) in enumerate(groups.items(), 11):
            curves = gmsh.model.getBoundary([(2, bodies[body])], oriented=False)
            inside = [c for _, c in curves if chosen(*middle(gmsh, c))]
            named(gmsh, 1, inside, tag, name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
    found = read_gmsh(gmsh.model if COMM.rank == 0 else None, COMM, gdim=2)
    if COMM.rank == 0:
        gmsh.finalize()
    return found


def named(gmsh, dim, entities, tag, name):
    """Make a physical group; older Gmsh takes its name apart."""
    gmsh.model.addPhysicalGroup(dim, entities, tag)
    gmsh.model.setPhysicalName(dim, tag, name)


def middle(gmsh, curve):
    """Coordinates of the middle of a curve."""
    low, high = gmsh.model.getParametrizationBounds(1, curve)
    return gmsh.model.getValue(1, curve, [0.5 * (low[0] + high[0])])[:2]


class Try:
    """Bodies of one neo-Hookean material, of degree 2.

    Parameters
    ----------
    mesh
        Of `read`.
    pairs
        By name.
    held
        Names of groups, or of bodies, that are prescribed.
    weight
        Force per volume of bodies, by name, (2,).
    """

    def __init__(self, mesh, pairs, held, weight=None, friction=None):
        self.mesh, names = mesh, mesh.names
        V = compat.vector_space(mesh.mesh, 2)
        self.u = fem.Function(V, name="displacement")
        mu, lmbda = lame(E, NU)
        v = ufl.TestFunction(V)
        dx = ufl.Measure("dx", mesh.mesh, subdomain_data=mesh.cell_tags)
        F = ufl.Identity(2) + ufl.grad(self.u)
        J = ufl.det(F)
        P = mu * (F - ufl.inv(F).T) + lmbda * ufl.ln(J) * ufl.inv(F).T
        form = ufl.inner(P, ufl.grad(v)) * dx
        self.forces = {}
        for body, value in (weight or {}).items():
            self.forces[body] = fem.Constant(mesh.mesh, np.zeros(2, PETSc.ScalarType))
            form -= ufl.inner(self.forces[body], v) * dx(names[body][1])
        self.weight = {body: np.array(value) for body, value in (weight or {}).items()}
        self.moves, conditions = {}, []
        for name in held:
            dim, tag = names[name]
            entities = (mesh.cell_tags if dim == 2 else mesh.facet_tags).find(tag)
            dofs = fem.locate_dofs_topological(V, dim, entities)
            self.moves[name] = fem.Constant(mesh.mesh, np.zeros(2, PETSc.ScalarType))
            conditions.append(fem.dirichletbc(self.moves[name], dofs, V))
        self.contact = raymortar.Contact(
            self.u, mesh.facet_tags, pairs, friction=friction, names=names
        )
        self.problem = raymortar.NonlinearProblem(form, self.contact, conditions)
        self.solver = raymortar.SNESSolver(self.problem)

    def load(self, t):
        """A share of the weights."""
        for body, force in self.forces.items():
            force.value[:] = t * self.weight[body]


def disc_on_block(gap):
    """A disc of radius 0.1 over a block whose bottom is held, under its weight."""
    R = 0.1

    def draw(occ):
        bodies = {
            "block": occ.addRectangle(-0.3, -0.2, 0, 0.6, 0.2),
            "disc": occ.addDisk(0, R + gap, 0, R, R),
        }
        groups = {
            "ground": ("block", lambda x, y: y < -0.19),
            "table": ("block", lambda x, y: y > -0.01),
            "rim": ("disc", lambda x, y: True),
        }
        return bodies, groups

    return Try(
        read(draw, 0.02),
        [("rim", "table")],
        ["ground"],
        {"disc": (0.0, -1e5)},
        raymortar.Coulomb(0.3),
    )


def ring_in_groove():
    """An O-ring, 5 mm thick, that lies in a groove under a lid, both rigid."""
    R = 2.5e-3

    def draw(occ):
        outer = occ.addRectangle(-6e-3, -3e-3, 0, 12e-3, 7e-3)
        inner = occ.addRectangle(-3.4e-3, 0, 0, 6.8e-3, 5e-3)
        (groove,), _ = occ.cut([(2, outer)], [(2, inner)])
        bodies = {
            "groove": groove[1],
            "ring": occ.addDisk(0, R, 0, R, R),
            "lid": occ.addRectangle(-3.2e-3, 5e-3, 0, 6.4e-3, 1e-3),
        }
        groups = {
            "walls": ("groove", lambda x, y: abs(x) < 3.5e-3 and y > -1e-4),
            "skin": ("ring", lambda x, y: True),
            "under": ("lid", lambda x, y: y < 5.1e-3),
        }
        return bodies, groups

    return Try(
        read(draw, 0.5e-3),
        [("skin", "walls"), ("skin", "under")],
        ["groove", "lid"],
        friction=raymortar.Coulomb(0.1),
    )


def snap_fit():
    """A hook on a bending arm that is pushed past a rigid latch."""
    arm, h, L = 2e-3, 2e-3, 20e-3

    def draw(occ):
        points = [(0, 0), (L + 4e-3, 0), (L + 4e-3, 0.8 * arm), (L + 1e-3, arm + h)]
        points += [(L, arm + h), (L - 1e-3, arm), (0, arm)]
        tags = [occ.addPoint(x, y, 0) for x, y in points]
        lines = [occ.addLine(a, b) for a, b in zip(tags, tags[1:] + tags[:1])]
        hook = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        latch = occ.addRectangle(L + 5e-3, 1.2 * arm, 0, 4e-3, 4e-3, -1, 0.5e-3)
        bodies = {"hook": hook, "latch": latch}
        groups = {
            "root": ("hook", lambda x, y: x < 1e-6),
            "nose": ("hook", lambda x, y: x > L - 2e-3 and y > 0.5 * arm),
            "edge": ("latch", lambda x, y: True),
        }
        return bodies, groups

    return Try(read(draw, 0.5e-3), [("nose", "edge")], ["root", "latch"])
