"""A bolt through two plates, as a CAD system gives them: head, nut and joint carry what
its shank does."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from raymortar import (
    Contact,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Pretension,
    io,
    tools,
)

COMM = MPI.COMM_WORLD
# Lengths in mm, stresses in MPa, forces in N; a quarter has a quarter of the force
E, NU, FORCE, FRICTION, SIZE = 210e3, 0.3, 550.0, 0.15, 1.8


def solids(occ):
    """Quarters of two plates with a hole, and of both halves of a cut bolt."""

    def cylinder(begin, height, radius):
        return [(3, occ.addCylinder(0, 0, begin, 0, 0, height, radius))]

    def quarter(solid):
        box = occ.addBox(0, 0, -50, 50, 50, 100)
        return occ.intersect(solid, [(3, box)])[0][0]

    found = {}
    for name, begin in (("lower", -5), ("upper", 0)):
        plate = [(3, occ.addBox(-10, -10, begin, 20, 20, 5))]
        found[name] = quarter(occ.cut(plate, cylinder(-6, 12, 3))[0])
    found["nut"] = quarter(occ.fuse(cylinder(-8, 3, 5), cylinder(-8, 8, 2.5))[0])
    found["head"] = quarter(occ.fuse(cylinder(5, 3, 5), cylinder(0, 8, 2.5))[0])
    return found


# Faces across the bolt by solid and height
ACROSS = {
    ("lower", 0): "joint below", ("lower", -5): "foot", ("upper", 0): "joint",
    ("upper", 5): "seat", ("nut", -5): "nut", ("head", 5): "head",
    ("nut", 0): "cut below", ("head", 0): "cut above",
}  # fmt: skip


def face(name, box):
    """Name of a plane face of a solid by its box, None for others."""
    flat = [abs(box[k + 3] - box[k]) < 1e-3 for k in range(3)]
    for k, side in enumerate(("symmetry x", "symmetry y")):
        if flat[k] and box[k] < 0.1:
            return side
    if flat[2]:
        return ACROSS.get((name, round(box[2])))
    return "end" if flat[0] and name == "lower" else None


def joint(gmsh):
    """Mesh and tags of the joint."""
    gmsh.initialize(["", "-v", "1"])
    try:
        found = solids(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        sides = {}
        for name, solid in found.items():
            gmsh.model.addPhysicalGroup(3, [solid[1]])
            for _, s in gmsh.model.getBoundary([solid], oriented=False):
                of = face(name, gmsh.model.getBoundingBox(2, s))
                if of is not None:
                    sides.setdefault(of, []).append(s)
        for name, faces in sides.items():
            group = gmsh.model.addPhysicalGroup(2, faces)
            gmsh.model.setPhysicalName(2, group, name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", SIZE)
        gmsh.model.mesh.generate(3)
        return io.read_gmsh(gmsh.model, COMM, gdim=3)
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("friction", [None, Coulomb(FRICTION)], ids=["none", "0.15"])
def test_head_nut_and_joint_carry_the_force_of_the_bolt(friction):
    """Bolt and upper plate are held by contact alone."""
    read = joint(pytest.importorskip("gmsh"))
    V = tools.vector_space(read.mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    e = ufl.sym(ufl.grad(u))
    stress = 2.0 * mu * e + lmbda * ufl.tr(e) * ufl.Identity(3)
    F = ufl.inner(stress, ufl.grad(v)) * ufl.dx
    supports = (("symmetry x", 0), ("symmetry y", 1), ("end", 2))
    bcs = [tools.prescribe(V, read.find(name), component=k) for name, k in supports]
    faces = ("cut above", "cut below")
    axis = (0.0, 0.0, 1.0)
    bolt = Pretension(u, read.facet_tags, faces, axis, names=read.names)
    contacts = [
        Contact(u, read.facet_tags, [pair], names=read.names, friction=friction)
        for pair in (("head", "seat"), ("nut", "foot"), ("joint", "joint below"))
    ]
    problem = NonlinearProblem(F, [bolt, *contacts], bcs)

    def tighten(t):
        bolt.force = 0.25 * FORCE * t

    steps = LoadSteps(problem.snes_solver, tighten, 1).run()
    assert sum(step.iterations for step in steps) <= 15, steps
    np.testing.assert_allclose(4.0 * bolt.tension(), FORCE, 1e-9)
    for contact in contacts:
        force = 4.0 * contact.resultant().force[2]
        np.testing.assert_allclose(abs(force), FORCE, 1e-9)
