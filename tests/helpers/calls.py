"""Contacts of two small blocks, for tests of what is called and given wrongly."""

import pytest
from dolfinx import fem
from problems import COMM, fix, residual

import raymortar
from meshes.scenes import two_blocks
from raymortar import ContactError, NonlinearProblem
from raymortar.core import compat

PAIR = [(3, 4)]  # slave and master of `two_blocks`


def small_blocks():
    return two_blocks(COMM, 2, "triangle", 2, 2)


def refused(pattern):
    return pytest.raises(ContactError, match=pattern)


def contact(scene, pairs=PAIR, V=None, tags=None, **options):
    V = compat.vector_space(scene.mesh, 1) if V is None else V
    tags = scene.facet_tags if tags is None else tags
    return raymortar.Contact(fem.Function(V), tags, pairs, **options)


def problem(scene, F=None, J=None, **options):
    """Problem of a contact; F and J of its displacement."""
    c = contact(scene, **options)
    bcs = [fix(c.u.function_space, scene, ["bottom", "top"])]
    F = residual(scene, c.u)[0] if F is None else F(scene, c.u)
    return NonlinearProblem(F, c, bcs, None if J is None else J(scene, c.u))


def ready_problem(scene):
    """A problem whose contact has results."""
    made = problem(scene)
    made.contact.update()
    return made
