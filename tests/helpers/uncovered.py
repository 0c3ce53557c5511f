"""The part of a slave that has no master, and a dead load on it alone."""

import numpy as np
import states
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix

from raymortar.core import compat
from raymortar.core.discretization.facets import shape_functions


def uncovered_areas(contact):
    """Of every shape function over the uncovered part of the slave, (dofs,)."""
    contact.update()
    surface, points = contact.zones[0].facets.slave_surface, contact.points()
    off = points["status"] == states.NONE
    degree = surface.displacement_degree
    N, _ = shape_functions(surface.shape, degree, points["xi"][off])
    dofs = surface.dofs[surface.facet_dofs[points["slave"][off]]]
    areas = np.zeros(len(contact.u.x.array) // surface.gdim)
    np.add.at(areas, dofs, points["weight"][off, None] * N)
    return areas


def boundary_of(F):
    """Measure of the whole boundary, to degree 4, that may be added to a form with
    loads: DOLFINx 0.9 takes the tags of one object only."""
    integrals = F.integrals_by_type("exterior_facet")
    (tags,) = {
        id(one.subdomain_data()): one.subdomain_data() for one in integrals
    }.values()
    return ufl.Measure(
        "ds", F.ufl_domain(), metadata={"quadrature_degree": 4}, subdomain_data=tags
    )


def load_of_the_rest(contact, ds):
    """Function whose products with test functions over the boundary are the integrals
    over the slave's uncovered part, upwards, to rounding."""
    V = contact.u.function_space
    v, w = ufl.TestFunction(V), ufl.TrialFunction(V)
    M = assemble_matrix(compat.form(ufl.inner(w, v) * ds))
    M.assemble()
    dim = V.mesh.geometry.dim
    up = np.arange(dim - 1, M.size[0], dim)
    M = M[:, :][np.ix_(up, up)]
    on = M.diagonal() > 0.0
    f = fem.Function(V)
    rest = uncovered_areas(contact)
    f.x.array[up[on]] = np.linalg.solve(M[np.ix_(on, on)], rest[on])
    return f
