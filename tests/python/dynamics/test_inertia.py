"""The mass matrix without mass at contact surfaces: what it keeps, and where it is zero."""

import hosts
import numpy as np
import pytest
import revolution
import ufl
from dolfinx import fem
from problems import COMM, DIMENSION, worst

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar import (
    Contact,
    ContactError,
    ContactWarning,
    NonlinearProblem,
    Penalty,
    Tie,
    dynamics,
    tools,
)
from raymortar.core.errors import SetUpError
from raymortar.mass.massless import massless_nodes

RHO = 7.85
ALL = pytest.mark.mpi(
    where=lambda cell, degree, **_: (cell, degree)
    in [("triangle", 2), ("hexahedron", 1)]
)


def made(cell, degree, mass, kind=Contact, divisions=None, **options):
    """Inertia of two blocks, their displacement and contact."""
    d = DIMENSION[cell]
    divisions = ((5, 4) if d == 2 else (3, 2)) if divisions is None else divisions
    scene = two_blocks(COMM, d, cell, *divisions, **options)
    V = tools.vector_space(scene.mesh, degree)
    u, pair = fem.Function(V), (scene.tags["slave"], scene.tags["master"])
    contact = kind(u, scene.facet_tags, [pair])
    return of_space(V, contact, mass), u, contact


def volume_of(mesh):
    return tools.integral(fem.Constant(mesh, 1.0) * ufl.dx, mesh)


def of_space(V, contact, mass, weight=1.0):
    a, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    form = RHO * weight * ufl.inner(a, v) * ufl.dx(metadata={"quadrature_degree": 6})
    return dynamics.Inertia(form, contact, mass)


def affine_fields(u):
    """Translations along each axis, and each coordinate along each axis, owned dofs."""
    V = u.function_space
    n, d = V.dofmap.index_map.size_local, V.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:n, :d]
    ones = [np.tile(axis, (n, 1)) for axis in np.eye(d)]
    return [
        f.ravel() for f in ones + [x[:, [j]] * one for j in range(d) for one in ones]
    ]


def moments(inertia, fields):
    """Products of fields by the mass, over all ranks."""
    products = [inertia.times(f) for f in fields]
    return COMM.allreduce(np.array([[f @ p for p in products] for f in fields]))


@ALL
@pytest.mark.parametrize("mass", ["nearest", "affine"])
@pytest.mark.parametrize("degree", [1, 2])
def test_mass_centre_and_inertia_tensor(cell, degree, mass):
    inertia, u, contact = made(cell, degree, mass)
    fields, d = affine_fields(u), DIMENSION[cell]
    found = moments(inertia, fields)
    exact = moments(of_space(u.function_space, contact, "consistent"), fields)
    volume = volume_of(u.function_space.mesh)
    assert np.abs(found[:d, :d] / (RHO * volume) - np.eye(d)).max() <= 1e-13
    if mass == "affine":
        assert np.abs(found - exact).max() <= 1e-12 * np.abs(exact).max()
    else:  # mass moves inwards
        assert np.abs(found - exact).max() >= 1e-3 * np.abs(exact).max()


@ALL
@pytest.mark.parametrize("degree", [1, 2])
def test_contact_nodes_and_no_others_are_without_mass(cell, degree):
    inertia, u, contact = made(cell, degree, "nearest")
    d, owned = DIMENSION[cell], u.function_space.dofmap.index_map.size_local
    on_surfaces = np.repeat(massless_nodes(contact)[:owned], d)
    assert np.array_equal(~inertia.is_massive, on_surfaces)
    n = len(on_surfaces)
    values = np.random.default_rng(COMM.rank).normal(size=n) * on_surfaces
    assert worst(inertia.times(values)) == 0.0
    assert worst(inertia.times(np.ones(n))[on_surfaces]) == 0.0
    assert COMM.allreduce(np.count_nonzero(on_surfaces)) > 0


@pytest.mark.mpi
def test_the_matrix_is_symmetric_and_positive():
    inertia, u, _ = made("triangle", 1, "affine")
    rng = np.random.default_rng(COMM.rank)
    n = u.function_space.dofmap.index_map.size_local * 2
    a, b = rng.normal(size=(2, n))
    ab, ba, aa = COMM.allreduce(
        np.array([a @ inertia.times(b), b @ inertia.times(a), a @ inertia.times(a)])
    )
    assert abs(ab - ba) <= 1e-12 * aa
    assert aa > 0.0


@pytest.mark.mpi
def test_smoothing_twice_is_smoothing_once():
    inertia, u, _ = made("quadrilateral", 2, "affine")
    n = u.function_space.dofmap.index_map.size_local * 2
    once = inertia.smooth(np.random.default_rng(COMM.rank).normal(size=n))
    assert worst(inertia.smooth(once) - once) <= 1e-13


@pytest.mark.mpi
@pytest.mark.parametrize("mass", ["nearest", "affine"])
def test_a_solid_of_revolution_keeps_its_mass(mass):
    scene = revolution.disc("quadrilateral", 4, radius=0.5)
    V = tools.vector_space(scene.mesh, 1)
    u, tags = fem.Function(V), scene.tags
    contact = Contact(u, scene.facet_tags, [(tags["slave"], tags["bottom"])])
    r = ufl.SpatialCoordinate(scene.mesh)[0]
    inertia = of_space(V, contact, mass, 2.0 * ufl.pi * r)
    found = moments(inertia, affine_fields(u))
    exact = RHO * np.pi * (1.5**2 - 0.5**2)
    assert abs(found[1, 1] / exact - 1.0) <= 1e-13
    # Mass times the height of the centre
    if mass == "affine":
        assert abs(found[1, 5] / (0.5 * exact) - 1.0) <= 1e-12


@pytest.mark.mpi
def test_of_a_tie_the_slave_alone_is_without_mass():
    tied, _, _ = made("quadrilateral", 1, "nearest", Tie)
    pressed, _, _ = made("quadrilateral", 1, "nearest")
    counts = [COMM.allreduce(np.count_nonzero(~i.is_massive)) for i in (tied, pressed)]
    assert counts[0] == 2 * (4 + 1) < counts[1]


@pytest.mark.mpi
@pytest.mark.parametrize("way", hosts.WAYS)
def test_of_several_unknowns_the_displacement_has_inertia(way):
    hosted = hosts.taylor_hood(way)
    functions = hosted.contact.unknowns.functions
    if way == "mixed":
        W = functions[0].function_space
        a, v = ufl.split(ufl.TrialFunction(W))[0], ufl.split(ufl.TestFunction(W))[0]
        form = RHO * ufl.inner(a, v) * ufl.dx
    else:
        V = functions[0].function_space
        a, v = ufl.TrialFunction(V), ufl.TestFunction(V)
        form = [RHO * ufl.inner(a, v) * ufl.dx, None]
    inertia = dynamics.Inertia(form, hosted.contact)
    mesh = functions[0].function_space.mesh
    unknowns = hosted.contact.unknowns
    up = np.zeros(unknowns.owned_starts[-1])
    places = np.asarray(np.arange(len(up))[unknowns.u_owned]).reshape(-1, 2)
    up[places[:, 1]] = 1.0
    mass = COMM.allreduce(float(up @ inertia.times(up)))
    volume = volume_of(mesh)
    assert abs(mass / (RHO * volume) - 1.0) <= 1e-13
    none = np.ones_like(up)
    none[places.ravel()] = 0.0
    assert worst(inertia.times(none)) == 0.0


@pytest.mark.mpi
def test_the_matrix_follows_a_constant_of_the_form():
    inertia, u, contact = made("triangle", 1, "nearest")
    V = u.function_space
    a, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    rho = fem.Constant(V.mesh, 2.0)
    inertia = dynamics.Inertia(rho * ufl.inner(a, v) * ufl.dx, contact)
    one = np.ones(V.dofmap.index_map.size_local * 2)
    before, made_once = inertia.times(one), inertia.revision
    inertia.times(one)
    assert inertia.revision == made_once
    rho.value = 6.0
    assert worst(inertia.times(one) - 3.0 * before) <= 1e-12


def on_plate(mass):
    """A bar above a plate of one layer of cells, all of whose outer side is held; any
    facet may meet any other."""
    plate = {"bottom": 1, "left": 1, "right": 1}
    blocks = [
        Block((4, 4), (0.0, 0.1), (1.0, 1.1), body="bar"),
        Block((8, 1), (-1.0, -0.5), (2.0, 0.0), tags=plate, body="plate"),
    ]
    mesh, _, tags = assemble_blocks(COMM, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    contact = Contact(u, tags, "all", Penalty())
    strain = [ufl.sym(ufl.grad(w)) for w in (u, v)]
    form = ufl.inner(100.0 * strain[0], strain[1]) * ufl.dx + v[1] * ufl.dx
    bcs = [tools.prescribe(V, tags.find(1))]
    problem = NonlinearProblem(form, contact, bcs)
    return problem, of_space(V, contact, mass)


@pytest.mark.mpi
@pytest.mark.parametrize("mass", ["nearest", "affine"])
def test_held_nodes_stand_for_those_of_a_thin_body(mass):
    """No node of the plate is off the surfaces. What it has of mass rests, as told; the
    bar, and the mass of all, are whole."""
    problem, inertia = on_plate(mass)
    volume = 1.0 + 1.5
    with pytest.warns(
        ContactWarning, match="puts 0.29 .* on nodes that conditions hold"
    ):
        inertia.begin(problem.prescribed)
    V = problem.u.function_space
    n = V.dofmap.index_map.size_local
    down = np.tile([0.0, 1.0], n)

    def moved(values):
        return COMM.allreduce(float(values @ inertia.times(values)))

    assert moved(down) == pytest.approx(RHO * volume, rel=1e-12)
    assert moved(down * ~problem.prescribed) == pytest.approx(RHO, rel=1e-12)


@pytest.mark.mpi
def test_a_thin_body_that_nothing_holds_is_told_by_what_helps():
    for mass, text in (
        ("nearest", 'mass="cons'),
        ("affine", 'mass="nearest" or "cons'),
    ):
        _, inertia = on_plate(mass)
        with pytest.raises(
            SetUpError, match=f"two cells or more across, or take {text}"
        ):
            inertia.begin(np.zeros(len(inertia.contact.unknowns.owned_values()), bool))


@pytest.mark.mpi
def test_a_body_of_one_layer_is_refused_by_affine_weights():
    inertia, _, _ = made("quadrilateral", 1, "affine", divisions=(4, 1))
    with pytest.raises(ContactError, match="too thin"):
        inertia.matrix


@pytest.mark.parametrize(
    "given, text",
    [
        (lambda a, v: ufl.inner(v, v) * ufl.dx, "rank|bilinear"),
        (lambda a, v: v[0] * ufl.dx, "bilinear"),
        (lambda a, v: None, "bilinear"),
    ],
)
def test_wrong_forms_are_refused(given, text):
    _, u, contact = made("triangle", 1, "nearest")
    a, v = ufl.TrialFunction(u.function_space), ufl.TestFunction(u.function_space)
    with pytest.raises((ContactError, ValueError), match=text):
        dynamics.Inertia(given(a, v), contact)


@pytest.mark.mpi
@pytest.mark.parametrize("mass", ("nearest", "consistent"))
def test_negative_densities_are_refused(mass):
    _, u, contact = made("triangle", 1, mass)
    a, v = ufl.TrialFunction(u.function_space), ufl.TestFunction(u.function_space)
    inertia = dynamics.Inertia(-2.0 * ufl.inner(a, v) * ufl.dx, contact, mass)
    with pytest.raises(SetUpError, match="negative mass, -.* density rho"):
        inertia.matrix


def test_wrong_masses_are_refused():
    with pytest.raises(ContactError, match="mass must be one of"):
        made("triangle", 1, "lumped")
