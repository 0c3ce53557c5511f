"""Contacts that are paired and not solved: what of the slave has a master."""

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from problems import COMM

from raymortar import AugmentedLagrangian, Contact
from raymortar.core import compat

HIT = 1  # lowest status of a point with a master


def touch(scene, pairs=(("slave", "master"),), degree=1, method=None, **options):
    """Contact of a scene, paired at no displacement."""
    u = fem.Function(compat.vector_space(scene.mesh, degree))
    tags = [tuple(scene.tags[name] for name in pair) for pair in pairs]
    method = AugmentedLagrangian(1.0) if method is None else method
    contact = Contact(u, scene.facet_tags, tags, method, **options)
    contact.update()
    return contact


def total(values):
    """Sum over all ranks."""
    return COMM.allreduce(float(np.sum(values)), op=MPI.SUM)


def measures(contact, zone=0):
    """Weights of the whole slave surface, and of its points with a master."""
    points = contact.points(zone)
    hit = points["status"] >= HIT
    return total(points["weight"]), total(points["weight"][hit])


def lift(contact, height, rotation=None):
    """Move the upper body by `height` along the vertical of the scene."""
    u = contact.u
    dim = u.function_space.mesh.geometry.dim
    R = np.eye(dim) if rotation is None else rotation
    slave = contact.zones[0].facets.slave_surface.dofs
    u.x.array.reshape(-1, dim)[slave] = height * R[:, -1]
    contact.update()
