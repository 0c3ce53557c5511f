"""Bodies that touch others, and that nothing holds along them, are told of."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import ufl
from arriving import loose_stack, on_tools
from dolfinx import fem
from first_tries import read
from materials import MATERIALS, lame

import raymortar
from raymortar import rigid
from raymortar.core import compat
from raymortar.diagnose.findings import findings
from raymortar.diagnose.sliding import sliding_bodies

sys.path.append(str(Path(__file__).parents[3] / "benchmarks" / "robustness"))

import bodies_2d  # noqa: E402

SLOPE = np.sqrt(0.5)
FLOOR = [((0.0, 0.0), (0.0, 1.0))]
GROOVE = [((0.0, 0.0), (side * SLOPE, SLOPE)) for side in (-1.0, 1.0)]


def disc(lines, friction=None):
    """A disc of radius 0.5 under its weight, on lines through the origin."""
    height = 0.5 if lines == FLOOR else SLOPE

    def draw(occ):
        disc = occ.addDisk(0, height, 0, 0.5, 0.5)
        return {"disc": disc}, {"rim": ("disc", lambda x, y: True)}

    density = lambda weight: weight  # noqa: E731
    problem, _, weight = on_tools(
        read(draw, 0.1), "rim", lines, 1, 100.0, density, friction
    )
    weight.value = 0.5
    return problem


def ball(slope):
    """A ball of radius 0.5 under its weight, in a straight groove along y whose sides have
    a slope."""

    def draw(gmsh):
        ball = gmsh.model.occ.addSphere(0.0, 0.0, 0.5 / slope, 0.5)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.25)
        skin = [s for _, s in gmsh.model.getBoundary([(3, ball)], oriented=False)]
        return {"ball": ball}, {"skin": skin}

    scene = bodies_2d.read(draw, 3)
    V = compat.vector_space(scene.mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    stress = MATERIALS["neo-hookean"][0](ufl.grad(u), *lame(100.0, 0.3))
    form = (ufl.inner(stress, ufl.grad(v)) + 0.5 * v[2]) * ufl.dx
    normals = [(side * np.sqrt(1.0 - slope**2), 0.0, slope) for side in (-1.0, 1.0)]
    planes = [rigid.Body(rigid.Plane((0.0, 0.0, 0.0), n)) for n in normals]
    pairs = [("skin", plane) for plane in planes]
    contact = raymortar.Contact(u, scene.facet_tags, pairs, names=scene.tags)
    return raymortar.NonlinearProblem(form, contact)


def told(problem):
    """Whom and what is told of after a solve from where bodies rest."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", raymortar.ContactWarning)
        raymortar.LoadSteps(problem.snes_solver, lambda t: None, 1).run()
    found = findings(problem)
    return [(one.pair, one.text) for one in found if one.about[0] == "sliding"]


@pytest.mark.mpi
def test_a_disc_may_slide_along_a_floor():
    """Its own normals differ, those of the floor do not."""
    ((_, text),) = told(disc(FLOOR))
    assert text == "nothing holds it along x, so that its place is arbitrary"


@pytest.mark.mpi
@pytest.mark.parametrize(
    "lines, friction", [(FLOOR, 0.3), (GROOVE, None), (GROOVE, 0.3)]
)
def test_nothing_is_told_of_a_disc_that_friction_or_a_groove_holds(lines, friction):
    assert told(disc(lines, friction)) == []


@pytest.mark.parametrize("slope", [SLOPE, 0.9])
def test_a_ball_may_slide_along_a_groove(slope):
    """Its normals differ. It is pressed into the groove, and not solved for: some meshes
    go on to turn."""
    problem = ball(slope)
    u = problem.contact.u.x.array.reshape(-1, 3)
    u[:, 2] -= 0.02
    problem.contact.update()
    (found,) = sliding_bodies(problem)
    assert found.text.startswith("nothing holds it along y,")


@pytest.mark.mpi
def test_bodies_that_may_slide_alike_are_told_of_at_once():
    path = loose_stack(gap=0.0, friction=None)
    path.apply(1.0)
    ((body, text),) = told(path.problem)
    assert body.startswith("the body around (0.5, ")
    along = "nothing holds it along x, so that its place is arbitrary, and that of "
    assert text.startswith(along + "the body around (0.5, ")
